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
mod damped;
mod declared;
mod delays;
mod identifiability;
mod levenberg;
mod narrow;
mod options;
mod projection;
mod result;
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
pub use options::GreyBoxOptions;
pub(crate) use projection::decayed;
pub use projection::{FrequencyTarget, Origin, Projection, ProjectionOptions, logarithmic_grid, project, projections};
pub use result::{GreyBoxModel, Stop};
pub use robust::{Loss, RobustReport};
pub use structure::{Matrix, Slope, Structure};

use super::fit::reproduction;
use super::subspace::Experiment;
use crate::lti::{Discrete, Partitioned, StateSpace, simulate};
use crate::{Error, Result};
use bounds::Bounds;
use closure::Closure;
use criterion::Criterion;
use delays::Shifted;
use faer::{Mat, Scale};
use levenberg::minimise;
use robust::reweighted;
use uncertainty::{Information, spread};

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
    options.check()?;
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

fn errors(
    experiments: &[Experiment<'_>],
    model: &StateSpace<Discrete>,
    initial_states: &[Vec<f64>],
) -> Result<Vec<Mat<f64>>> {
    let error = |(e, x0): (&Experiment<'_>, &Vec<f64>)| simulate(model, e.u, x0).map(|simulated| e.y - simulated);
    experiments.iter().zip(initial_states).map(error).collect()
}
