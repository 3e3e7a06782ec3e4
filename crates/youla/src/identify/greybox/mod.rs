//! Grey-box identification: the physical parameters of a continuous-time structure by the prediction-error method.
//!
//! For white output noise, `y = G(theta) u + n`, the predictor is the simulation and the estimate
//! ```text
//! theta = arg min 1/2 sum_k |y(k) - yhat(k; theta)|^2,
//! x(k+1) = Ad(theta) x(k) + Bd(theta) u(k),   yhat(k) = C(theta) x(k) + D(theta) u(k)
//! ```
//! is the maximum-likelihood one: consistent and efficient, in closed loop too (L. Ljung, System Identification: Theory for
//! the User, 2nd ed., 1999, sections 7.2, 8.4, 9.4 and 13.4). Its weakness is that it finds the minimum next to its start:
//! lightly damped modes that are far off leave it in a local one, which [`Stop::Converged`] cannot tell from the global one;
//! [`GreyBoxModel::fit`] can, next to the fit of another method.
//!
//! The steps: exact zero-order hold with derivatives (`sampled.rs`), one recursion for all sensitivities and its
//! triangular factor (`sensitivity.rs`), the criterion with the initial states projected out (`criterion.rs`),
//! Levenberg-Marquardt (`levenberg.rs`), the covariance (`uncertainty.rs`).

mod bearing;
mod cost;
mod criterion;
mod levenberg;
mod narrow;
mod projection;
mod sampled;
mod sensitivity;
mod structure;
#[cfg(test)]
mod tests;
mod uncertainty;

pub use bearing::BearingStructure;
pub use cost::greybox_cost;
pub(crate) use projection::decayed;
pub use projection::{FrequencyTarget, Origin, Projection, ProjectionOptions, logarithmic_grid, project, projections};
pub use structure::{Matrix, Slope, Structure};

use super::subspace::{Experiment, InitialState};
use crate::lti::{Continuous, Discrete, StateSpace, simulate};
use crate::{Error, Result};
use criterion::Criterion;
use faer::{Mat, Scale};
use levenberg::minimise;
use serde::{Deserialize, Serialize};
use uncertainty::Information;

/// Choices of [`greybox`].
///
/// ```
/// use youla::identify::{greybox::GreyBoxOptions, subspace::InitialState};
/// let options = GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() };
/// assert_eq!(options.max_iterations, 50);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GreyBoxOptions {
    /// Largest number of steps. From nominal models of the bearing that are up to 60 % wrong the search takes 5 to 20; one
    /// that is lost creeps on to the limit.
    pub max_iterations: usize,
    /// Converged where the distance to the minimum of the linearised criterion is below this share of the radius of the
    /// confidence region: the relative offset (D. M. Bates and D. G. Watts, Technometrics 23 (1981), 179).
    pub offset_tolerance: f64,
    /// Smallest step, relative to the parameters, both in units of their effect on the output.
    pub step_tolerance: f64,
    /// Damping of the first step, relative to the squared lengths of the columns of the Jacobian.
    pub damping: f64,
    /// The state at the first sample of each experiment.
    pub initial_state: InitialState,
    /// Standard deviation of the noise of each output, of which only the ratios count; empty where all are equal.
    pub output_deviations: Vec<f64>,
}

impl Default for GreyBoxOptions {
    fn default() -> Self {
        GreyBoxOptions {
            max_iterations: 50,
            offset_tolerance: 1e-4,
            step_tolerance: 1e-10,
            damping: 1e-3,
            initial_state: InitialState::default(),
            output_deviations: Vec::new(),
        }
    }
}

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// At a minimum, as exactly as the noise lets it be known.
    Converged,
    /// The model reproduces the data to rounding.
    Exact,
    /// No step that is longer than the tolerance lowers the criterion.
    StepTooSmall,
    /// The limit of iterations was reached.
    Iterations,
}

/// Result of [`greybox`].
#[derive(Debug, Clone)]
pub struct GreyBoxModel {
    /// Estimated parameters, in the order of [`Structure::names`].
    pub parameters: Vec<f64>,
    /// Their covariance, q x q, for white output noise; `None` where the data do not determine them all.
    pub covariance: Option<Mat<f64>>,
    /// The continuous-time model.
    pub continuous: StateSpace<Continuous>,
    /// The same behind a zero-order hold.
    pub model: StateSpace<Discrete>,
    /// Whether it is stable.
    pub stable: bool,
    /// State at the first sample of each experiment, n numbers each.
    pub initial_states: Vec<Vec<f64>>,
    /// Half the sum of squares of the residuals, each divided by the deviation of its output.
    pub cost: f64,
    /// `100 (1 - |y - yhat| / |y - mean y|)` per output over all experiments, percent, eq. (26).
    pub fit: Vec<f64>,
    /// Root-mean-square residual per output, in its units.
    pub residual: Vec<f64>,
    /// Why the search ended.
    pub stop: Stop,
    /// Distance to the minimum of the linearised criterion over the radius of the confidence region.
    pub relative_offset: f64,
    /// Steps that lowered the criterion; there is one linearisation more.
    pub iterations: usize,
    /// Simulations of all records for the value of the criterion, those of rejected trial points included.
    pub evaluations: usize,
    /// Trial points that were rejected because the model could not be computed or its simulation was not finite.
    pub diverged: usize,
    /// Number of parameters (in combination) that the data determine: rank of the Jacobian, columns of unit length.
    pub rank: usize,
    /// Reciprocal condition number of that Jacobian.
    pub rcond: f64,
}

impl GreyBoxModel {
    /// Standard deviations of the parameters, `None` where the data do not determine them all.
    pub fn standard_deviations(&self) -> Option<Vec<f64>> {
        self.covariance
            .as_ref()
            .map(|covariance| covariance.diagonal().column_vector().iter().map(|v| v.sqrt()).collect())
    }
}

/// Estimates the parameters of a structure from one or more experiments by the output-error method.
///
/// The criterion is minimised by Levenberg-Marquardt from `start`. A trial point whose simulation is not finite is rejected
/// and counted. Nothing keeps the parameters in a range; an unstable result is returned and marked.
///
/// # Errors
/// [`Error::Shape`], [`Error::NotFinite`], [`Error::Ports`], [`Error::OutOfRange`] for data, start or options that do not
/// fit; [`Error::TooFewSamples`]; [`Error::Diverged`] with the worst pole where the simulation from `start` is not finite;
/// errors of the structure at `start`.
///
/// # Accuracy
/// The gradient agrees with differences to 1e-7 (`tests::gradient`), noise-free records give the parameters back to 1e-6 and the
/// scatter over noise is that of the covariance within 25 % (`tests::estimates`).
///
/// ```
/// use youla::identify::greybox::{BearingStructure, GreyBoxOptions, greybox};
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, simulate};
/// use youla::{Mat, rig::Bearing};
/// let time = Discrete::new(2e-4)?;
/// let u = Mat::from_fn(1000, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
/// let y = simulate(&Bearing::default().plant()?.zoh(time)?, u.as_ref(), &[0.0; 6])?;
/// let truth = BearingStructure::parameters(&Bearing::default());
/// let start: Vec<f64> = truth.iter().map(|v| 0.9 * v).collect();
/// let experiment = Experiment { u: u.as_ref(), y: y.as_ref() };
/// let found = greybox(&BearingStructure, &start, &[experiment], time, &GreyBoxOptions::default())?;
/// assert!((found.parameters[0] / truth[0] - 1.0).abs() < 1e-6);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn greybox(
    structure: &dyn Structure,
    start: &[f64],
    experiments: &[Experiment<'_>],
    time: Discrete,
    options: &GreyBoxOptions,
) -> Result<GreyBoxModel> {
    check(options)?;
    let criterion =
        Criterion::new(structure, start, experiments, time, options.initial_state, &options.output_deviations)?;
    let outcome = minimise(&criterion, start, options)?;
    let information = Information::new(&outcome.linearisation);
    let point = &outcome.point;
    let variance = 2.0 * point.cost / criterion.degrees_of_freedom as f64;
    let continuous = structure.model(&point.theta)?;
    let model = continuous.zoh(time)?;
    let initial_states = criterion.initial_states(point);
    let outputs = outputs(experiments, &model, &initial_states)?;
    Ok(GreyBoxModel {
        covariance: information.inverse.map(|inverse| Scale(variance) * inverse),
        stable: model.is_stable()?,
        continuous,
        model,
        initial_states,
        cost: point.cost,
        fit: outputs.iter().map(|o| o.fit).collect(),
        residual: outputs.iter().map(|o| o.residual).collect(),
        stop: outcome.stop,
        relative_offset: outcome.linearisation.relative_offset(criterion.degrees_of_freedom),
        iterations: outcome.work.iterations,
        evaluations: outcome.work.evaluations,
        diverged: outcome.work.diverged,
        rank: information.rank,
        rcond: information.rcond,
        parameters: outcome.point.theta,
    })
}

fn check(options: &GreyBoxOptions) -> Result<()> {
    let positive = [
        ("the offset tolerance", options.offset_tolerance),
        ("the step tolerance", options.step_tolerance),
        ("the damping", options.damping),
    ];
    match positive.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite())) {
        Some((what, value)) => Err(Error::OutOfRange { what: what.into(), value, must: "a positive number" }),
        None => Ok(()),
    }
}

/// How well one output is reproduced.
struct Output {
    fit: f64,
    residual: f64,
}

fn outputs(
    experiments: &[Experiment<'_>],
    model: &StateSpace<Discrete>,
    initial_states: &[Vec<f64>],
) -> Result<Vec<Output>> {
    let simulated = |(e, x0): (&Experiment<'_>, &Vec<f64>)| simulate(model, e.u, x0).map(|model| e.y - model);
    let errors: Vec<Mat<f64>> = experiments.iter().zip(initial_states).map(simulated).collect::<Result<_>>()?;
    let samples = errors.iter().map(|e| e.nrows()).sum::<usize>() as f64;
    let output = |i: usize| {
        let measured = || experiments.iter().flat_map(|e| e.y.col(i).iter());
        let mean = measured().sum::<f64>() / samples;
        let spread = measured().map(|y| (y - mean).powi(2)).sum::<f64>().sqrt();
        let error = errors.iter().map(|e| e.col(i).norm_l2()).fold(0.0, f64::hypot);
        Output { fit: 100.0 * (1.0 - error / spread), residual: error / samples.sqrt() }
    };
    Ok((0..model.outputs()).map(output).collect())
}
