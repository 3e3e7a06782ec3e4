//! A loop under the uncertainty of its model: does the controller stabilise every model within the region?
//!
//! Models are drawn from the distribution of the estimate and each loop is tested exactly, by its poles. The region of level p
//! holds the share p of the models that lie nearest to the estimate. The statement is about the error that the records let
//! expect, not about what no record shows (an operating point never visited, a mode never excited).

use crate::identify::likelihood::{Draw, Interval, Region};
use crate::lti::{Discrete, Eigen, StateSpace};
use crate::{Error, Result};
use rayon::prelude::*;

/// Choices of [`certify_region`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct BandOptions {
    /// Models that are drawn.
    pub draws: usize,
    /// Seed of the drawing.
    pub seed: u64,
}

impl Default for BandOptions {
    fn default() -> Self {
        BandOptions { draws: 500, seed: 1 }
    }
}

/// What a controller does to the models within a region.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BandCertificate {
    /// Level of region and interval.
    pub level: f64,
    /// Models that were drawn but are impossible, and not tested.
    pub impossible: usize,
    /// Models that were tested.
    pub models: usize,
    /// Those of them within the region.
    pub within: usize,
    /// Models whose loop is unstable, anywhere.
    pub unstable: usize,
    /// Those of them within the region.
    pub unstable_within: usize,
    /// Largest magnitude of a closed-loop pole over the models within the region.
    pub worst_within: f64,
    /// The largest magnitude of a closed-loop pole, of the estimate, with its interval.
    pub radius: Interval,
}

impl BandCertificate {
    /// Whether the controller stabilises every model that was tested within the region, and the estimate. Where more than half of the drawn
    /// models are impossible, those that are left are no region.
    pub fn holds(&self) -> bool {
        self.unstable_within == 0 && self.radius.value < 1.0 && self.impossible <= self.models
    }
}

/// Tests the loop that `closed` makes of each plant of a region, by its largest pole. Plants in parallel; the same seed gives the same
/// result.
///
/// `possible` says which plants are left out because something else is known: the controller that ran stabilised the plant while
/// the records were taken. Where nothing else is known it is true throughout.
///
/// # Errors
/// Those of `closed` for the estimate; a loop that is not well posed counts as unstable. [`Error::OutOfRange`] for fewer than 20
/// draws.
pub fn certify_region<F>(
    region: &Region,
    options: &BandOptions,
    possible: impl Fn(&StateSpace<Discrete>) -> Result<bool> + Sync,
    closed: F,
) -> Result<BandCertificate>
where
    F: Fn(&StateSpace<Discrete>) -> Result<StateSpace<Discrete>> + Sync,
{
    if options.draws < 20 {
        let what = "the number of models to draw".into();
        return Err(Error::OutOfRange { what, value: options.draws as f64, must: "at least 20" });
    }
    let radius = |plant: &StateSpace<Discrete>| spectral_radius(&closed(plant)?);
    let draws = region.draws(options.draws, options.seed);
    let mut tested: Vec<(f64, f64)> = draws
        .par_iter()
        .filter(|draw| possible(&draw.plant).unwrap_or(true))
        .map(|Draw { plant, distance }| (*distance, radius(plant).unwrap_or(f64::INFINITY)))
        .collect();
    tested.sort_by(|a, b| a.0.total_cmp(&b.0));
    let within = (LEVEL * tested.len() as f64).floor() as usize;
    let unstable = |part: &[(f64, f64)]| part.iter().filter(|(_, radius)| *radius >= 1.0 || radius.is_nan()).count();
    Ok(BandCertificate {
        level: LEVEL,
        impossible: draws.len() - tested.len(),
        models: tested.len(),
        within,
        unstable: unstable(&tested),
        unstable_within: unstable(&tested[..within]),
        worst_within: tested[..within].iter().map(|(_, radius)| *radius).fold(0.0, f64::max),
        radius: radius_interval(region, closed)?,
    })
}

/// The interval of the largest magnitude of a pole: to first order `dz = w' dA v` by its eigenvectors.
fn radius_interval<F>(region: &Region, closed: F) -> Result<Interval>
where
    F: Fn(&StateSpace<Discrete>) -> Result<StateSpace<Discrete>> + Sync,
{
    let nominal = closed(&region.estimate()?)?;
    let exact = |plant: &StateSpace<Discrete>| Ok(vec![spectral_radius(&closed(plant)?)?]);
    let eigen = Eigen::new(&nominal)?;
    let largest = eigen.poles().iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm()));
    let near = |plant: &StateSpace<Discrete>| {
        let change = closed(plant)?.a() - nominal.a();
        Ok(vec![largest.map_or(0.0, |pole| (pole + eigen.change(pole, &change)).norm())])
    };
    Ok(region.intervals_by(LEVEL, near, exact)?[0])
}

/// Level of regions and intervals.
const LEVEL: f64 = 0.95;

fn spectral_radius(closed: &StateSpace<Discrete>) -> Result<f64> {
    Ok(closed.poles()?.iter().map(|p| p.norm()).fold(0.0, f64::max))
}
