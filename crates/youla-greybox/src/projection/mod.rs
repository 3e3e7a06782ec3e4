//! Projection of a black-box model, or of a measured frequency response, on a physical structure.
//!
//! ```text
//! theta = arg min sum_k |W_k (Y_k - G_theta(e^(j omega_k ts)) U_k)|^2      entry by entry
//! ```
//! with the responses U and Y of inputs and outputs to the same excitations, `U = I` and `Y = G` for a plain response, and `G_theta` the structure behind its zero-order hold: a weighted nonlinear least squares in the frequency domain (R.
//! Pintelon and J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 9). Unlike a search
//! in records it costs the same for any number of samples, and it forgets all states that the structure does not have.
//!
//! A search finds the minimum next to its start. Structures that are linear in most parameters once their equation is
//! multiplied out, as the bearing (3)-(6), need none (in continuous time): `separable.rs` solves a weighted linear least squares for each point of a
//! small grid of the other parameters. For other structures the starts are the given ones and points around the first of
//! them (`design.rs`). The best few are polished by Levenberg-Marquardt with exact slopes (`misfit.rs`, `search.rs`).

mod design;
mod misfit;
mod search;
mod separable;
mod target;
#[cfg(test)]
mod tests;

pub(crate) use target::decayed;
pub use target::{FrequencyTarget, logarithmic_grid};

use crate::checks::check_time;
use crate::options::require_positive;
use crate::{Error, Result};
use crate::{Stop, Structure};
use design::decades;
use faer::{Mat, MatRef, c64};
use misfit::{Misfit, Point};
use search::{Outcome, minimise};
use separable::Separation;
use serde::{Deserialize, Serialize};
use youla::linalg::{check_finite, check_shape};
use youla::lti::{Discrete, StateSpace};

/// Choices of [`project`].
///
/// ```
/// let options = youla_greybox::ProjectionOptions { polished: 1, ..Default::default() };
/// assert_eq!(options.max_iterations, 30);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ProjectionOptions {
    /// Largest number of reweightings of the linear least squares, for each point of the grid.
    pub reweightings: usize,
    /// Frequencies that the linear least squares takes; of a finer response it takes every second, third ...
    pub coarse: usize,
    /// Number of best starts from which the search goes on to the end.
    pub polished: usize,
    /// Largest number of steps of a search.
    pub max_iterations: usize,
    /// Converged where what a step could remove, to first order, is below this share of the misfit.
    pub tolerance: f64,
    /// Smallest step, relative to the parameters, both in units of their effect on the response.
    pub step_tolerance: f64,
}

impl Default for ProjectionOptions {
    fn default() -> Self {
        ProjectionOptions {
            reweightings: 4,
            coarse: 30,
            polished: 2,
            max_iterations: 30,
            tolerance: 1e-3,
            step_tolerance: 1e-12,
        }
    }
}

/// Where a projection started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// At the solution of the linear least squares.
    Linear,
    /// At a parameter vector that was given, counted from 0.
    Given(usize),
    /// At a point around the first that was given.
    Around,
}

/// Result of [`project`].
#[derive(Debug, Clone)]
pub struct StructureFit {
    /// Parameters, in the order of [`Structure::names`].
    pub parameters: Vec<f64>,
    /// The structure at these behind a zero-order hold.
    pub model: StateSpace<Discrete>,
    /// `sqrt(sum |W (Y - G_theta U)|^2 / sum |W Y|^2)`.
    pub misfit: f64,
    /// The same of each entry by itself, p x r; NaN for one without weight.
    pub entries: Mat<f64>,
    /// Steps of the search.
    pub iterations: usize,
    /// Why the search ended.
    pub stop: Stop,
    /// Where it started.
    pub origin: Origin,
    /// Starts that were compared before the search.
    pub starts: usize,
}

impl StructureFit {
    /// Where a search from here starts: the parameters, those beyond a bound of the structure at that bound. The projection knows no
    /// bounds; the search does not begin outside of them.
    pub fn start(&self, structure: &dyn Structure) -> Vec<f64> {
        let within = |(value, (min, max)): (&f64, (f64, f64))| value.max(min).min(max);
        self.parameters.iter().zip(structure.bounds()).map(within).collect()
    }
}

/// Projects a response on a structure. `starts` are parameter vectors to start from besides; none is needed for a structure
/// that is linear in most parameters.
///
/// The entries of G, or of Y = G U, are compared behind the zero-order hold of the structure.
///
/// # Errors
/// [`Error::NoStart`] where neither the starts nor the linear least squares give a model; [`youla::Error::Shape`],
/// [`youla::Error::NotFinite`], [`youla::Error::OutOfRange`] for starts and options that do not fit; those of the structure.
///
/// # Accuracy
/// The exact response of the sampled bearing gives its parameters back to 1e-8, without a start (`tests::exact_response`).
///
/// ```
/// use youla_greybox::*;
/// use youla::lti::Discrete;
/// let bearing = DeclaredStructure::new(&Template::Bearing.declaration()?)?;
/// let model = bearing.model(&bearing.start())?.zoh(Discrete::new(2e-4)?)?;
/// let target = FrequencyTarget::of_model(&model, &logarithmic_grid([60.0, 6000.0], 60)?)?;
/// let found = project(&bearing, &target, &[], &ProjectionOptions::default())?;
/// assert!((found.parameters[4] / -1.869e6 - 1.0).abs() < 1e-8);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
pub fn project(
    structure: &dyn Structure,
    target: &FrequencyTarget,
    starts: &[Vec<f64>],
    options: &ProjectionOptions,
) -> Result<StructureFit> {
    let mut all = projections(structure, target, starts, options)?;
    Ok(all.swap_remove(0))
}

/// All projections that [`project`] compares, the best first: the minima next to different starts.
///
/// # Errors
/// As [`project`].
pub fn projections(
    structure: &dyn Structure,
    target: &FrequencyTarget,
    starts: &[Vec<f64>],
    options: &ProjectionOptions,
) -> Result<Vec<StructureFit>> {
    check(structure, starts, options)?;
    check_time(structure, target.time())?;
    let misfit = Misfit::new(structure, target);
    let begun = begin(&misfit, starts, options)?;
    let count = begun.len();
    let mut found = Vec::new();
    for (origin, point) in begun.into_iter().take(options.polished.max(1)) {
        let outcome = minimise(&misfit, point, options)?;
        found.push(describe(&misfit, outcome, origin, count)?);
    }
    found.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    Ok(found)
}

fn check(structure: &dyn Structure, starts: &[Vec<f64>], options: &ProjectionOptions) -> Result<()> {
    let parameters = structure.names().len();
    for start in starts {
        let theta = MatRef::from_column_major_slice(start, start.len(), 1);
        check_shape("the start vector of a projection", theta, (parameters, 1))?;
        check_finite("the start vector of a projection", theta)?;
    }
    require_positive(&[
        ("the tolerance of a projection", options.tolerance),
        ("the step tolerance of a projection", options.step_tolerance),
    ])
}

/// The starts, the lowest misfit first.
fn begin(misfit: &Misfit<'_>, starts: &[Vec<f64>], options: &ProjectionOptions) -> Result<Vec<(Origin, Point)>> {
    let mut found = Vec::new();
    for point in linear(misfit, starts, options)? {
        found.push((Origin::Linear, misfit.evaluate(&point)?));
    }
    for (k, start) in starts.iter().enumerate() {
        found.extend(misfit.evaluate(start).ok().map(|point| (Origin::Given(k), point)));
    }
    if !found.iter().any(|(origin, _)| *origin == Origin::Linear) {
        let around = starts.first().map(|first| decades(first)).unwrap_or_default();
        let points = around.iter().skip(1).filter_map(|theta| misfit.evaluate(theta).ok());
        found.extend(points.map(|point| (Origin::Around, point)));
    }
    if found.is_empty() {
        return Err(Error::NoStart);
    }
    found.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    Ok(found)
}

/// Starts from the linear least squares; none where the structure is not of that kind.
fn linear(misfit: &Misfit<'_>, starts: &[Vec<f64>], options: &ProjectionOptions) -> Result<Vec<Vec<f64>>> {
    let probe = starts.first().cloned().unwrap_or_else(|| vec![1.0; misfit.parameters]);
    let [low, high] = misfit.target.band(0.02);
    let Ok(Some(separation)) = Separation::of(misfit.structure, &probe, c64::new(0.0, (low * high).sqrt())) else {
        return Ok(Vec::new());
    };
    let thinned = misfit.target.thinned(misfit.target.omega().len().div_ceil(options.coarse.max(2)));
    let coarse = Misfit::new(misfit.structure, &thinned);
    let found = separation.candidates(&coarse, &probe, options.reweightings);
    Ok(found.into_iter().map(|point| point.theta).collect())
}

fn describe(misfit: &Misfit<'_>, outcome: Outcome, origin: Origin, starts: usize) -> Result<StructureFit> {
    let Outcome { point, stop, iterations } = outcome;
    let sums = misfit.entries(&point.response);
    let sizes = misfit.target.entries();
    Ok(StructureFit {
        model: misfit.structure.sampled(&point.theta, misfit.target.time())?,
        misfit: point.cost.sqrt() / misfit.size,
        entries: Mat::from_fn(sums.nrows(), sums.ncols(), |i, j| (sums[(i, j)] / sizes[(i, j)]).sqrt()),
        parameters: point.theta,
        iterations,
        stop,
        origin,
        starts,
    })
}
