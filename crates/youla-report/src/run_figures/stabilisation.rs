//! Poles of the models of all orders over frequency, and beneath them their damping ratios.

use super::choice::Chosen;
use super::{RunFigure, axis, choice, key, logarithmic};
use crate::data::{PoleStability, Role, Stabilisation, StabilisationPole};
use crate::figure::{Axis, Content, Curve, Drawn, Figure, Guide, GuideKind, Panel};
use crate::with_minus;

/// Room above the largest order for the frequencies of the clusters, as a share of all orders.
const ROOM_FOR_LABELS: f64 = 0.22;

/// One per method.
pub(super) fn figures(chosen: &Chosen) -> Vec<Figure> {
    let mut diagrams: Vec<&Stabilisation> =
        chosen.data.stabilisation.iter().filter(|d| !d.orders.is_empty() && !d.poles.is_empty()).collect();
    // The poles of S are those of the loop; those of the plant are looked for first.
    let of_loop = |d: &&Stabilisation| chosen.data.methods.iter().any(|m| m.key == d.method && m.role == Role::Hansen);
    diagrams.sort_by_key(of_loop);
    let nyquist = chosen.data.sample_time.map(|ts| 0.5 / ts);
    diagrams.into_iter().map(|diagram| figure(diagram, nyquist)).collect()
}

fn figure(diagram: &Stabilisation, nyquist: Option<f64>) -> Figure {
    let x = Axis { range: view(diagram, nyquist), ..logarithmic("Frequency", "Hz") };
    let first = diagram.orders.iter().copied().min().unwrap_or(0) as f64 - 1.0;
    let last = diagram.orders.iter().copied().max().unwrap_or(1) as f64 + 1.0;
    let top = last + if diagram.clusters.is_empty() { 0.0 } else { ROOM_FOR_LABELS * (last - first) };
    let dampings = damping_range(diagram);
    let panels = vec![
        Panel {
            x: x.clone(),
            y: Axis { range: Some([first, top]), ..axis("Order", "") },
            content: Content::Curves(curves(diagram, Value::Order)),
            guides: clusters(diagram, [first, last], Some([0.72, 0.28].map(|share| last + share * (top - last))))
                .chain([level(diagram.chosen as f64)])
                .collect(),
            ..Panel::default()
        },
        Panel {
            x,
            y: Axis { range: Some(dampings), ..axis("Damping ratio ζ", "") },
            content: Content::Curves(curves(diagram, Value::Damping)),
            guides: clusters(diagram, dampings, None).chain([level(0.0)]).collect(),
            height: Some(0.6),
            ..Panel::default()
        },
    ];
    Figure {
        key: key(RunFigure::Stabilisation, &[(&diagram.method, true)]),
        title: format!("Stabilisation diagram of {}", diagram.label),
        caption: format!(
            "Poles of the models of all orders ({}). Stable: the next lower order has a pole of the same frequency, damping \
             ratio and mode shape. Frequency stable: of the same frequency only. Dashed: clusters that are stable at enough \
             orders, and the order of the model, {}.{}",
            diagram.label,
            diagram.chosen,
            if diagram.poles.iter().any(|p| p.hz_deviation.is_some()) {
                " Lines through stable poles: two standard deviations to either side."
            } else {
                ""
            }
        ),
        panels,
        choice: choice(&[("Poles of", &diagram.label)]),
        ..Figure::default()
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Value {
    Order,
    Damping,
}

fn curves(diagram: &Stabilisation, value: Value) -> Vec<Curve> {
    let standing = |pole: &StabilisationPole| match (pole.stable, pole.standing) {
        (false, _) => None,
        (true, standing) => Some(standing),
    };
    let own = diagram.method.as_str();
    let mut list: Vec<Curve> = [
        ("unstable pole", "", None, Drawn::Marks),
        ("new pole", "", Some(PoleStability::New), Drawn::Marks),
        (own, "frequency stable", Some(PoleStability::Frequency), Drawn::Marks),
        (own, "stable", Some(PoleStability::Stable), Drawn::Dots),
    ]
    .into_iter()
    .map(|(method, note, wanted, drawn)| {
        let poles = diagram.poles.iter().filter(|pole| standing(pole) == wanted).collect::<Vec<_>>();
        let y = poles.iter().map(|pole| if value == Value::Order { pole.order as f64 } else { pole.zeta }).collect();
        let along = poles.iter().map(|pole| pole.order as f64).filter(|_| value == Value::Damping).collect();
        let x = poles.iter().map(|pole| pole.hz).collect();
        let details = poles.iter().map(|pole| details(diagram, pole)).collect();
        Curve { method: method.into(), note: note.into(), drawn, x, y, along, details }
    })
    .filter(|curve| !curve.x.is_empty())
    .collect();
    list.extend(whiskers(diagram, value));
    list
}

/// Order, frequency and damping ratio with their deviations, and the cluster.
fn details(diagram: &Stabilisation, pole: &StabilisationPole) -> String {
    let deviation = |value: Option<f64>, places: usize| value.map_or(String::new(), |v| format!(" ± {v:.places$}"));
    let cluster = pole.cluster.and_then(|k| Some((k, diagram.clusters.get(k)?)));
    let cluster = cluster.map_or(String::new(), |(k, c)| format!("\ncluster {} at {} Hz", k + 1, short(c.hz)));
    with_minus(format!(
        "Order {}\n{}{} Hz\nζ = {:.4}{}{cluster}",
        pole.order,
        short(pole.hz),
        deviation(pole.hz_deviation, 3),
        pole.zeta,
        deviation(pole.zeta_deviation, 4)
    ))
}

/// Two standard deviations to either side of stable poles, one line with gaps.
fn whiskers(diagram: &Stabilisation, value: Value) -> Option<Curve> {
    let stable = diagram.poles.iter().filter(|pole| pole.stable && pole.standing == PoleStability::Stable);
    let (x, y): (Vec<f64>, Vec<f64>) = stable
        .filter_map(|pole| match value {
            Value::Order => pole.hz_deviation.map(|d| {
                let order = pole.order as f64;
                [(pole.hz - 2.0 * d, order), (pole.hz + 2.0 * d, order), (pole.hz, f64::NAN)]
            }),
            Value::Damping => pole
                .zeta_deviation
                .map(|d| [(pole.hz, pole.zeta - 2.0 * d), (pole.hz, pole.zeta + 2.0 * d), (pole.hz, f64::NAN)]),
        })
        .flatten()
        .unzip();
    (!x.is_empty()).then(|| Curve { method: "two standard deviations".into(), x, y, ..Curve::default() })
}

/// Their frequencies are in one of two rows by turns.
fn clusters(diagram: &Stabilisation, ends: [f64; 2], rows: Option<[f64; 2]>) -> impl Iterator<Item = Guide> + '_ {
    diagram.clusters.iter().enumerate().map(move |(k, cluster)| Guide {
        kind: GuideKind::Level,
        x: vec![cluster.hz; 2],
        y: ends.to_vec(),
        label: rows.map_or(String::new(), |_| format!("{} Hz", short(cluster.hz))),
        at: [cluster.hz, rows.map_or(0.0, |rows| rows[k % 2])],
    })
}

fn level(y: f64) -> Guide {
    Guide { kind: GuideKind::Level, x: vec![1e-12, 1e12], y: vec![y; 2], ..Guide::default() }
}

/// Four digits.
fn short(value: f64) -> String {
    let places = (3 - value.abs().log10().floor().clamp(-6.0, 3.0) as i32).max(0) as usize;
    format!("{value:.places$}")
}

/// Around the clusters, or everything.
fn view(diagram: &Stabilisation, nyquist: Option<f64>) -> Option<[f64; 2]> {
    let [lowest, highest] = super::span(diagram.poles.iter().map(|pole| pole.hz).filter(|hz| *hz > 0.0))?;
    let top = nyquist.unwrap_or(1.1 * highest);
    let whole = [(lowest / 1.1).max(top / 2000.0).min(top / 2.0), top];
    let near = super::span(diagram.clusters.iter().map(|cluster| cluster.hz).filter(|hz| *hz > 0.0))
        .map(|[low, high]| [(low / 2.5).max(whole[0]), (2.5 * high).min(top)]);
    let view = near.filter(|near| near[1] / near[0] <= 0.8 * whole[1] / whole[0]).unwrap_or(whole);
    (view[0] < view[1]).then_some(view)
}

/// Up to well above the clusters; without any, all but the strongest damping.
fn damping_range(diagram: &Stabilisation) -> [f64; 2] {
    let reach = |sign: f64| diagram.clusters.iter().map(move |c| c.zeta + sign * 2.0 * c.zeta_spread);
    let known: Vec<f64> = match diagram.clusters.is_empty() {
        false => reach(1.0).collect(),
        true => diagram.poles.iter().map(|pole| pole.zeta).filter(|zeta| *zeta < 0.9).collect(),
    };
    let least = reach(-1.0).fold(0.0, f64::min);
    let top = (1.8 * known.into_iter().fold(0.0, f64::max)).clamp(0.02, 1.02);
    [if least < 0.0 { 1.5 * least } else { -0.06 * top }, top]
}
