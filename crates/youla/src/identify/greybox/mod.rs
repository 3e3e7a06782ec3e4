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
//! Levenberg-Marquardt (`levenberg.rs`) within bounds (`bounds.rs`), the covariance (`uncertainty.rs`), parameters that the
//! data do not determine (`identifiability.rs`). Beside them: delays of the inputs (`delays.rs`), outliers (`robust.rs`).
//! Structures are programmed (`structure.rs`) or declared (`declared/`).

mod bearing;
mod bounds;
mod closure;
mod cost;
mod criterion;
mod declared;
mod delays;
mod identifiability;
mod intervals;
mod levenberg;
mod narrow;
mod projection;
mod robust;
mod sampled;
mod sensitivity;
mod structure;
#[cfg(test)]
mod tests;
mod uncertainty;

pub use bearing::BearingStructure;
pub use bounds::{AtBound, Side};
pub use closure::LoopOutput;
pub use cost::greybox_cost;
pub use declared::{
    Declaration, DeclaredStructure, DerivedValue, Entry, Named, Parameter, ParameterDeclaration, Template,
};
pub use identifiability::{Combination, Part, Undetermined};
pub use intervals::{
    ComparedStructure, CrossCorrelation, GreyBoxIntervals, IntervalOptions, LikelihoodRatio, ParameterInterval,
    ResidualAssumption, ResidualTest, compare, greybox_intervals, greybox_intervals_in_loop, likelihood_ratio,
};
pub(crate) use projection::decayed;
pub use projection::{FrequencyTarget, Origin, Projection, ProjectionOptions, logarithmic_grid, project, projections};
pub use robust::{Loss, RobustReport};
pub use structure::{Matrix, Slope, Structure};

use super::fit::reproduction;
use super::subspace::{Experiment, InitialState};
use crate::lti::{Continuous, Discrete, Partitioned, StateSpace, simulate};
use crate::{Error, Result};
use bounds::Bounds;
use closure::Closure;
use criterion::Criterion;
use delays::Shifted;
use faer::{Mat, Scale};
use levenberg::minimise;
use robust::reweighted;
use serde::{Deserialize, Serialize};
use uncertainty::{Information, spread};

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
    /// Known delay of each input in whole samples, beyond the zero-order hold; none when empty.
    pub delays: Vec<usize>,
    /// How residuals count.
    pub loss: Loss,
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
            delays: Vec::new(),
            loss: Loss::default(),
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
    /// Their covariance, q x q, for white output noise; `None` where the data do not determine them all. Parameters that a
    /// bound holds back count as known: their rows and columns are zero.
    pub covariance: Option<Mat<f64>>,
    /// The continuous-time model, without delays.
    pub continuous: StateSpace<Continuous>,
    /// The same behind a zero-order hold, with the delays of the inputs as further states behind its own.
    pub model: StateSpace<Discrete>,
    /// Whether it is stable.
    pub stable: bool,
    /// State at the first sample of each experiment that was used (the first of all, or that of the longest delay), n numbers
    /// and those of the delays each.
    pub initial_states: Vec<Vec<f64>>,
    /// Half the sum of squares of the residuals, each divided by the deviation of its output, with their weights under the
    /// loss of Huber.
    pub cost: f64,
    /// `100 (1 - |y - yhat| / |y - mean y|)` per output over all experiments, percent, eq. (26).
    pub fit: Vec<f64>,
    /// Root-mean-square residual per output, in its units.
    pub residual: Vec<f64>,
    /// Number of residuals: samples times outputs, over all experiments.
    pub residuals: usize,
    /// Parameters and estimated initial states.
    pub unknowns: usize,
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
    /// Which parameters those are that the data do not determine.
    pub undetermined: Undetermined,
    /// Parameters that ended at a bound.
    pub at_bounds: Vec<AtBound>,
    /// Weights of the residuals, `None` where all count by their square.
    pub robust: Option<RobustReport>,
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
/// The criterion is minimised by Levenberg-Marquardt from `start`, within the bounds of the structure where it has any. A
/// trial point whose simulation is not finite is rejected and counted. An unstable result is returned and marked.
///
/// # Errors
/// [`Error::Shape`], [`Error::NotFinite`], [`Error::Ports`], [`Error::OutOfRange`] for data, start or options that do not
/// fit; [`Error::EmptyBounds`], [`Error::OutsideBounds`]; [`Error::TooFewSamples`]; [`Error::Diverged`] with the worst pole where the simulation from `start` is not finite;
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
    estimate(structure, start, experiments, time, None, options)
}

/// The same through the loop: the model is simulated under the controller that ran, from the external signal w alone, and
/// compared with y, or with beta. Needs no stable plant, only a loop that is stable with the start model and does not let the
/// model's own instability into the residual; a trial point with an unstable loop that diverges is rejected.
///
/// `controller` is `J_K` from `(y, w)` to `(u, beta)`, for example [`crate::factor::CoprimeFactors::j_k`] with `w = alpha`, or a
/// plain controller [`crate::control::with_input_port`]; the inputs of the experiments are w. Initial states are those of the
/// plant, then those of the controller; [`GreyBoxModel::fit`] is that of the simulated loop.
///
/// White output noise passes the loop, so that the residuals are coloured: the estimate is consistent whatever the noise,
/// because w does not depend on it, but the covariance is that of white residuals and too optimistic or pessimistic by their
/// colour. For a stable plant [`greybox`] on (u, y) is efficient.
///
/// # Errors
/// As [`greybox`]; [`Error::Ports`] where the controller does not fit, [`Error::OutOfRange`] for a structure with a direct path.
pub fn greybox_in_loop(
    structure: &dyn Structure,
    start: &[f64],
    controller: &Partitioned<Discrete>,
    output: LoopOutput,
    experiments: &[Experiment<'_>],
    time: Discrete,
    options: &GreyBoxOptions,
) -> Result<GreyBoxModel> {
    estimate(structure, start, experiments, time, Some(Closure::new(controller, output)), options)
}

fn estimate(
    structure: &dyn Structure,
    start: &[f64],
    experiments: &[Experiment<'_>],
    time: Discrete,
    closure: Option<Closure<'_>>,
    options: &GreyBoxOptions,
) -> Result<GreyBoxModel> {
    check(options)?;
    if structure.names().is_empty() {
        let (what, must) = ("the number of free parameters of the structure".into(), "at least 1");
        return Err(Error::OutOfRange { what, value: 0.0, must });
    }
    if closure.is_some() && options.delays.iter().any(|delay| *delay > 0) {
        let (what, must) = ("the delay of an input inside of the loop".into(), "0: put it into the controller");
        return Err(Error::OutOfRange { what, value: 1.0, must });
    }
    let shifted = Shifted::new(experiments, &options.delays)?;
    let experiments = &shifted.experiments();
    let mut criterion = Criterion::new(
        structure,
        start,
        experiments,
        time,
        closure,
        options.initial_state,
        &options.output_deviations,
    )?;
    let bounds = Bounds::new(structure, start)?;
    let mut outcome = minimise(&criterion, &bounds, start, options)?;
    let mut variance = 2.0 * outcome.point.cost / criterion.degrees_of_freedom as f64;
    let mut unweighted = outcome.face.here.clone();
    let mut report = None;
    if options.loss == Loss::Huber {
        let robust = reweighted(&mut criterion, &bounds, options, outcome)?;
        (outcome, variance, report) = (robust.outcome, robust.variance, Some(robust.report));
        unweighted = criterion.linearise(&outcome.point)?.along(&outcome.face.free);
    }
    let point = &outcome.point;
    let names = structure.names();
    let sizes: Vec<f64> =
        point.theta.iter().zip(&criterion.scales).map(|(v, scale)| if *v == 0.0 { *scale } else { v.abs() }).collect();
    let information = Information::new(&outcome.linearisation, &sizes, criterion.energy.sqrt());
    let free = &outcome.face.free;
    let free_sizes: Vec<f64> = free.iter().map(|j| sizes[*j]).collect();
    let inverse = Information::new(&unweighted, &free_sizes, criterion.energy.sqrt()).inverse;
    let continuous = structure.model(&point.theta)?;
    let model = continuous.zoh(time)?;
    let initial_states = criterion.initial_states(point);
    let measured: Vec<_> = experiments.iter().map(|e| e.y).collect();
    let outputs = reproduction(&measured, &errors(experiments, &criterion.simulated(&model)?, &initial_states)?);
    Ok(GreyBoxModel {
        covariance: inverse.map(|inverse| Scale(variance) * spread(inverse.as_ref(), free, names.len())),
        stable: model.is_stable()?,
        continuous,
        model: shifted.delays.put_before(model)?,
        initial_states: shifted.initial_states(initial_states),
        cost: point.cost,
        fit: outputs.iter().map(|o| o.fit).collect(),
        residual: outputs.iter().map(|o| o.residual).collect(),
        residuals: criterion.degrees_of_freedom + criterion.unknowns(),
        unknowns: criterion.unknowns(),
        stop: outcome.stop,
        relative_offset: outcome.face.here.relative_offset(criterion.degrees_of_freedom),
        iterations: outcome.work.iterations,
        evaluations: outcome.work.evaluations,
        diverged: outcome.work.diverged,
        rank: information.rank,
        rcond: information.rcond,
        undetermined: information.undetermined(&names, &sizes),
        at_bounds: bounds.touched(&point.theta),
        robust: report,
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

fn errors(
    experiments: &[Experiment<'_>],
    model: &StateSpace<Discrete>,
    initial_states: &[Vec<f64>],
) -> Result<Vec<Mat<f64>>> {
    let error = |(e, x0): (&Experiment<'_>, &Vec<f64>)| simulate(model, e.u, x0).map(|simulated| e.y - simulated);
    experiments.iter().zip(initial_states).map(error).collect()
}
