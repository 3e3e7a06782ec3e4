//! The stabilisation diagrams of a run: drawn from the data that the models come from.

use crate::Result;
use crate::summary::entries::{pair, pairs};
use serde::Serialize;
use youla::identify::subspace::stabilisation::{
    DiagramPole, ModeCluster, PoleStability, StabilisationDiagram, StabilisationOptions, stabilisation,
};
use youla::identify::subspace::{SubspaceData, SubspaceModel, SubspaceOptions};
use youla::signal::Channel;
use youla_report::data as draw;

/// Orders that a diagram has at least, where the horizon allows them.
/// Ten modes; clusters need several orders above that of the model. Chosen, not measured.
const LEAST_ORDERS: usize = 20;

/// The diagram beside a model from the same data.
pub(crate) fn diagram(
    data: &SubspaceData<'_>,
    found: &SubspaceModel,
    method: &SubspaceOptions,
) -> Result<StabilisationDiagram> {
    let held = (found.horizon - 1) * found.model.outputs();
    let orders: Vec<usize> = (1..=(2 * found.order.order).max(LEAST_ORDERS).min(held)).collect();
    Ok(stabilisation(data, &orders, method, &StabilisationOptions::default())?)
}

/// A diagram as an artefact; numbers that are not finite are null.
#[derive(Serialize)]
pub(crate) struct DiagramFile<'a> {
    orders: &'a [usize],
    outputs: &'a [Channel],
    clusters: Vec<ClusterEntry>,
    poles: Vec<PoleEntry>,
}

#[derive(Serialize)]
struct PoleEntry {
    order: usize,
    pole: [f64; 2],
    hz: f64,
    zeta: f64,
    hz_deviation: Option<f64>,
    zeta_deviation: Option<f64>,
    stable: bool,
    stability: PoleStability,
    cluster: Option<usize>,
    shape: Vec<[f64; 2]>,
}

#[derive(Serialize)]
struct ClusterEntry {
    hz: f64,
    zeta: f64,
    hz_spread: f64,
    zeta_spread: f64,
    hz_deviation: Option<f64>,
    zeta_deviation: Option<f64>,
    orders: usize,
    stable_orders: usize,
    shape: Vec<[f64; 2]>,
}

impl<'a> DiagramFile<'a> {
    /// Of a diagram with its outputs.
    pub(crate) fn new(diagram: &'a StabilisationDiagram, outputs: &'a [Channel]) -> Self {
        let pole = |p: &DiagramPole| PoleEntry {
            order: p.order,
            pole: pair(p.pole),
            hz: p.hz,
            zeta: p.zeta,
            hz_deviation: p.hz_deviation,
            zeta_deviation: p.zeta_deviation,
            stable: p.is_stable(),
            stability: p.standing,
            cluster: p.cluster,
            shape: pairs(&p.shape),
        };
        let cluster = |c: &ModeCluster| ClusterEntry {
            hz: c.hz,
            zeta: c.zeta,
            hz_spread: c.hz_spread,
            zeta_spread: c.zeta_spread,
            hz_deviation: c.hz_deviation,
            zeta_deviation: c.zeta_deviation,
            orders: c.orders,
            stable_orders: c.settled,
            shape: pairs(&c.shape),
        };
        DiagramFile {
            orders: &diagram.orders,
            outputs,
            clusters: diagram.clusters.iter().map(cluster).collect(),
            poles: diagram.poles.iter().map(pole).collect(),
        }
    }
}

/// The poles as lines of text; an empty field where there is no number.
pub(crate) fn as_csv(diagram: &StabilisationDiagram) -> String {
    let optional = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let outputs = diagram.poles.first().map_or(0, |p| p.shape.len());
    let mut text = String::from("order,pole_re,pole_im,hz,zeta,hz_deviation,zeta_deviation,stable,stability,cluster");
    (1..=outputs).for_each(|i| text += &format!(",shape_{i}_re,shape_{i}_im"));
    text.push('\n');
    for p in &diagram.poles {
        let standing = match p.standing {
            PoleStability::New => "new",
            PoleStability::Frequency => "frequency",
            PoleStability::Stable => "stable",
        };
        let (z, stable) = (p.pole, p.is_stable());
        let cluster = p.cluster.map(|k| k.to_string()).unwrap_or_default();
        let (hz, zeta) = (optional(Some(p.hz).filter(|x| x.is_finite())), p.zeta);
        let deviations = [p.hz_deviation, p.zeta_deviation].map(optional).join(",");
        text += &format!("{},{},{},{hz},{zeta},{deviations},{stable},{standing},{cluster}", p.order, z.re, z.im);
        p.shape.iter().for_each(|x| text += &format!(",{},{}", x.re, x.im));
        text.push('\n');
    }
    text
}

/// A diagram as the report draws it.
pub(crate) fn drawn(diagram: &StabilisationDiagram, method: &str, label: &str, chosen: usize) -> draw::Stabilisation {
    let pole = |p: &DiagramPole| draw::StabilisationPole {
        order: p.order,
        hz: p.hz,
        zeta: p.zeta,
        hz_deviation: p.hz_deviation,
        zeta_deviation: p.zeta_deviation,
        stable: p.is_stable(),
        standing: match p.standing {
            PoleStability::New => draw::PoleStability::New,
            PoleStability::Frequency => draw::PoleStability::Frequency,
            PoleStability::Stable => draw::PoleStability::Stable,
        },
        cluster: p.cluster,
    };
    let clusters = diagram.clusters.iter().map(|c| draw::StabilisationCluster {
        hz: c.hz,
        zeta: c.zeta,
        hz_spread: c.hz_spread,
        zeta_spread: c.zeta_spread,
        hz_deviation: c.hz_deviation,
        zeta_deviation: c.zeta_deviation,
        orders: c.orders,
        stable_orders: c.settled,
        shape: c.shape.iter().map(|x| [x.norm(), x.im.atan2(x.re).to_degrees()]).collect(),
    });
    draw::Stabilisation {
        method: method.into(),
        label: label.into(),
        orders: diagram.orders.clone(),
        chosen,
        poles: diagram.poles.iter().filter(|p| p.hz.is_finite()).map(pole).collect(),
        clusters: clusters.collect(),
    }
}
