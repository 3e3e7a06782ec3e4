//! The stabilisation diagram: the poles of the models of many orders, which of them repeat, and their clusters.
//!
//! All orders come from one factorisation and one projection. A pole z of A with eigenvector v has
//! ```text
//! s = ln(z) / ts,   frequency |s| / 2 pi,   damping ratio -Re s / |s|,   mode shape C v (outputs in the units of the record)
//! ```
//! and settles at an order where the next lower one has a pole within 1 % in frequency and 5 % in damping whose shape
//! has a modal assurance criterion `MAC = |a' b|^2 / (|a|^2 |b|^2)` above 0.95. Poles of the machine settle and stay; those
//! that a model needs for noise move from order to order. What stays is collected by `cluster.rs`: see there.
//!
//! References: Peeters, Van der Auweraer, Guillaume, Leuridan, Shock and Vibration 11, 395 (2004), diagram; Allemang, Sound
//! and Vibration 37(8), 14 (2003), MAC; Reynders, Houbrechts, De Roeck, Mech. Syst. Signal Process. 29, 228 (2012), distance
//! of poles.

mod cluster;

pub use cluster::ModeCluster;

use super::projected::Projected;
use super::uncertainty::pole_deviations;
use super::{SubspaceData, SubspaceOptions, UncertaintyMethod};
use crate::linalg::Eigenvectors;
use crate::lti::modes::mode;
use crate::{Error, Mat, MatRef, Result, c64};
use rayon::prelude::*;

/// When poles of different orders count as the same.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct StabilisationOptions {
    /// Largest change of the frequency from one order to the next, as a part of it.
    pub frequency: f64,
    /// Largest change of the damping ratio, as a part of it.
    pub damping: f64,
    /// Least modal assurance criterion of the mode shapes.
    pub mac: f64,
    /// How the distance of two clusters follows from those of their poles.
    pub linkage: Linkage,
    /// Largest distance `|s1 - s2| / max(|s1|, |s2|) + 1 - MAC` at which clusters are joined.
    pub distance: f64,
    /// Least share of the orders at which a cluster must be settled to be listed.
    pub share: f64,
}

impl Default for StabilisationOptions {
    fn default() -> Self {
        StabilisationOptions {
            frequency: 0.01,
            damping: 0.05,
            mac: 0.95,
            linkage: Linkage::default(),
            distance: 0.05,
            share: 0.5,
        }
    }
}

/// Distance of two clusters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Linkage {
    /// Mean over all pairs of their poles.
    #[default]
    Average,
    /// That of their nearest poles; clusters may become chains.
    Single,
}

/// What the next lower order says of a pole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum PoleStability {
    /// There is none of this frequency.
    New,
    /// There is one of this frequency, with another damping ratio or mode shape.
    Frequency,
    /// There is one of this frequency, damping ratio and mode shape.
    Stable,
}

/// One real pole or one conjugate pair of the model of one order.
#[derive(Debug, Clone, PartialEq)]
pub struct DiagramPole {
    /// Order of the model.
    pub order: usize,
    /// The pole in z, imaginary part not negative.
    pub pole: c64,
    /// Natural frequency, Hz.
    pub hz: f64,
    /// Damping ratio; negative where the mode grows.
    pub zeta: f64,
    /// Standard deviation of the frequency, Hz, where the method asks for the uncertainty by the delta method.
    pub hz_deviation: Option<f64>,
    /// Standard deviation of the damping ratio, likewise.
    pub zeta_deviation: Option<f64>,
    /// C v, one number per output, the largest of them 1.
    pub shape: Vec<c64>,
    /// What the next lower order says.
    pub standing: PoleStability,
    /// The cluster of the diagram to which it belongs, by its place.
    pub cluster: Option<usize>,
}

impl DiagramPole {
    /// Whether it lies inside of the unit circle.
    pub fn is_stable(&self) -> bool {
        self.pole.norm() < 1.0
    }
}

/// Poles over orders.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilisationDiagram {
    /// The orders, rising.
    pub orders: Vec<usize>,
    /// The poles by order, then frequency.
    pub poles: Vec<DiagramPole>,
    /// What is settled at many orders, by frequency.
    pub clusters: Vec<ModeCluster>,
}

/// The diagram of the method and horizons of `method` (its order and what concerns B, D and stability have no part in it).
///
/// # Errors
/// [`Error::OutOfRange`] where the orders do not rise from at least 1 or a tolerance is not a positive number,
/// [`Error::Order`], and those of [`SubspaceData::identify`] before a model is made.
///
/// ```
/// use youla::{Mat, lti::Discrete};
/// use youla::identify::subspace::stabilisation::{StabilisationOptions, stabilisation};
/// use youla::identify::subspace::{Experiment, SubspaceData, SubspaceOptions};
/// // 1.2 y(k) - 0.7 y(k-1): a mode of 12.60 Hz at 100 Hz sampling, under a little noise.
/// let u = Mat::from_fn(900, 1, |k, _| ((k * k) as f64).sin());
/// let mut y = Mat::zeros(900, 1);
/// for k in 1..899 {
///     y[(k + 1, 0)] = 1.2 * y[(k, 0)] - 0.7 * y[(k - 1, 0)] + u[(k, 0)] + 0.01 * ((7 * k * k) as f64).cos();
/// }
/// let method = SubspaceOptions { horizon: 12.into(), ..Default::default() };
/// let data = SubspaceData::new(&[Experiment::new(u.as_ref(), y.as_ref())], Discrete::new(0.01)?, &method)?;
/// let orders: Vec<usize> = (1..=8).collect();
/// let diagram = stabilisation(&data, &orders, &method, &StabilisationOptions::default())?;
/// assert_eq!(diagram.clusters.len(), 1);
/// assert!((diagram.clusters[0].hz - 12.60).abs() < 0.05);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn stabilisation(
    data: &SubspaceData<'_>,
    orders: &[usize],
    method: &SubspaceOptions,
    options: &StabilisationOptions,
) -> Result<StabilisationDiagram> {
    check(orders, options)?;
    let method = &data.checked(method)?;
    let projected = data.project(method)?;
    let by_order: Vec<Result<Vec<DiagramPole>>> =
        orders.par_iter().map(|order| poles(data, &projected, *order)).collect();
    let mut by_order = by_order.into_iter().collect::<Result<Vec<_>>>()?;
    if method.uncertainty.method == UncertaintyMethod::Delta {
        add_deviations(&mut by_order, data, method, orders)?;
    }
    for k in 1..by_order.len() {
        let (lower, higher) = by_order.split_at_mut(k);
        higher[0].iter_mut().for_each(|pole| pole.standing = standing(pole, &lower[k - 1], options));
    }
    let mut poles: Vec<DiagramPole> = by_order.into_iter().flatten().collect();
    let clusters = cluster::find(&mut poles, orders, data.time, options);
    Ok(StabilisationDiagram { orders: orders.to_vec(), poles, clusters })
}

fn add_deviations(
    by_order: &mut [Vec<DiagramPole>],
    data: &SubspaceData<'_>,
    method: &SubspaceOptions,
    orders: &[usize],
) -> Result<()> {
    let poles: Vec<Vec<c64>> = by_order.iter().map(|poles| poles.iter().map(|p| p.pole).collect()).collect();
    let deviations = pole_deviations(data, method, orders, &poles)?;
    for (pole, [hz, zeta]) in by_order.iter_mut().flatten().zip(deviations.into_iter().flatten()) {
        (pole.hz_deviation, pole.zeta_deviation) = (Some(hz), Some(zeta));
    }
    Ok(())
}

/// `|a' b|^2 / (|a|^2 |b|^2)`: 1 for equal mode shapes, 0 for orthogonal ones and where one is zero.
pub fn modal_assurance(a: &[c64], b: &[c64]) -> f64 {
    let product = |a: &[c64], b: &[c64]| a.iter().zip(b).map(|(a, b)| a.conj() * b).sum::<c64>();
    let size = product(a, a).re * product(b, b).re;
    if size > 0.0 { product(a, b).norm_sqr() / size } else { 0.0 }
}

fn check(orders: &[usize], options: &StabilisationOptions) -> Result<()> {
    let rising = std::iter::once(&0).chain(orders).zip(orders).find(|(lower, higher)| lower >= higher);
    if let Some((_, order)) = rising {
        let must = "at least 1 and above the order before it";
        return Err(Error::OutOfRange { what: "an order of the diagram".into(), value: *order as f64, must });
    }
    let StabilisationOptions { frequency, damping, mac, distance, share, .. } = *options;
    let part = |x: f64| (0.0..=1.0).contains(&x);
    let bad = [
        ("tolerance of the frequency", frequency, part(frequency)),
        ("tolerance of the damping ratio", damping, part(damping)),
        ("least modal assurance criterion", mac, part(mac)),
        ("distance of clusters", distance, part(distance)),
        ("share of the orders", share, part(share)),
    ];
    match bad.into_iter().find(|(_, _, good)| !good) {
        Some((what, value, _)) => {
            let what = format!("the {what} in the stabilisation diagram");
            Err(Error::OutOfRange { what, value, must: "from 0 to 1" })
        }
        None => Ok(()),
    }
}

/// The poles of one order by frequency, all new.
fn poles(data: &SubspaceData<'_>, projected: &Projected, order: usize) -> Result<Vec<DiagramPole>> {
    super::order::check(order)?;
    let pair = projected.realise(order)?;
    let Eigenvectors { values, right, .. } = Eigenvectors::of(&format!("the model of order {order}"), pair.a.as_ref())?;
    let mut found: Vec<DiagramPole> = (0..order)
        .filter(|j| values[*j].im >= 0.0)
        .map(|j| {
            let mode = mode(data.time, values[j]);
            DiagramPole {
                order,
                pole: mode.pole,
                hz: mode.hz,
                zeta: mode.zeta,
                hz_deviation: None,
                zeta_deviation: None,
                shape: shape(&pair.c, right.as_ref(), j, data.channels.y_scale()),
                standing: PoleStability::New,
                cluster: None,
            }
        })
        .collect();
    found.sort_by(|a, b| a.hz.total_cmp(&b.hz).then(a.zeta.total_cmp(&b.zeta)));
    Ok(found)
}

/// Column j of `C V` in the units of the record, divided by its largest number.
fn shape(c: &Mat<f64>, v: MatRef<'_, c64>, j: usize, y_scale: &[f64]) -> Vec<c64> {
    let entry = |i: usize| (0..c.ncols()).map(|k| v[(k, j)] * (y_scale[i] * c[(i, k)])).sum::<c64>();
    let all: Vec<c64> = (0..c.nrows()).map(entry).collect();
    let largest = all.iter().fold(c64::new(0.0, 0.0), |l, x| if x.norm() > l.norm() { *x } else { l });
    if largest.norm() > 0.0 { all.iter().map(|x| x / largest).collect() } else { all }
}

fn standing(pole: &DiagramPole, lower: &[DiagramPole], options: &StabilisationOptions) -> PoleStability {
    let near = |l: &&DiagramPole| (pole.hz - l.hz).abs() <= options.frequency * l.hz;
    let settled = |l: &DiagramPole| {
        (pole.zeta - l.zeta).abs() <= options.damping * l.zeta.abs()
            && modal_assurance(&pole.shape, &l.shape) >= options.mac
    };
    match lower.iter().any(|l| near(&l)) {
        false => PoleStability::New,
        true if lower.iter().filter(near).any(settled) => PoleStability::Stable,
        true => PoleStability::Frequency,
    }
}
