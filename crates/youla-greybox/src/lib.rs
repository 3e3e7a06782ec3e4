//! Grey-box identification: the physical parameters of a structure by the prediction-error method.
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
//! Process noise or coloured output noise take another predictor, [`NoiseModel`]: the innovation form with a free gain
//! (`predictor.rs`) or a known filter (`whitening.rs`).
//!
//! The steps: exact zero-order hold with derivatives (`sampled.rs`), one recursion for all sensitivities and its
//! triangular factor (`sensitivity.rs`), the criterion with the initial states projected out (`criterion.rs`) or steady
//! (`steady.rs`),
//! Levenberg-Marquardt (`levenberg.rs`) within bounds (`bounds.rs`), the covariance (`uncertainty.rs`), parameters that the
//! data do not determine (`identifiability.rs`). Beside them: delays of the inputs (`delays.rs`), outliers (`robust.rs`), and against
//! a lost search several starts (`multi_start.rs`) and an observer that is taken away step by step (`continuation.rs`).
//! Structures are programmed (`structure.rs`) or declared (`declared/`).

mod bounds;
mod checks;
mod closure;
mod continuation;
mod cost;
mod criterion;
mod damped;
mod declared;
mod delays;
mod error;
mod estimate;
pub mod hansen_pem;
pub mod hansen_refine;
mod identifiability;
mod intervals;
mod levenberg;
mod linearisation;
mod multi_start;
mod noise;
mod options;
mod predictor;
pub mod projected_pem;
mod projection;
pub mod refine;
mod result;
mod robust;
mod sampled;
mod sensitivity;
mod sensitivity_bank;
mod simulated;
mod small_qr;
mod steady;
mod structure;
pub mod subspace_pem;
#[cfg(test)]
mod tests;
mod uncertainty;
mod whitening;

pub use bounds::{AtBound, Side};
pub use closure::LoopOutput;
pub use continuation::{Continuation, ContinuationOptions, ContinuationStage, greybox_continued};
pub use cost::greybox_cost;
pub use declared::{
    Declaration, DeclaredStructure, DerivedValue, Entry, Named, Parameter, ParameterDeclaration, Template,
};
pub use error::{Error, Result};
pub use identifiability::{Combination, Part, Undetermined};
pub use intervals::{
    ComparedStructure, CrossCorrelation, GreyBoxIntervals, IntervalOptions, LikelihoodRatio, ParameterInterval,
    ResidualAssumption, ResidualTest, compare, greybox_intervals, greybox_intervals_in_loop, likelihood_ratio,
};
pub use multi_start::{MultiStart, MultiStartOptions, SearchEnd, StartRun, greybox_multi_start};
pub use noise::{InnovationStart, NoiseFilter, NoiseModel};
pub use options::GreyBoxOptions;
pub(crate) use projection::decayed;
pub use projection::{FrequencyTarget, Origin, Projection, ProjectionOptions, logarithmic_grid, project, projections};
pub use result::{GreyBoxModel, Stop};
pub use robust::{Loss, RobustReport};
pub use structure::{Matrix, Slope, Structure};

use closure::Closure;
use estimate::{Setting, estimate};
use youla::identify::subspace::Experiment;
use youla::lti::{Discrete, Partitioned};

/// Estimates the parameters of a structure from one or more experiments by the prediction-error method.
///
/// The criterion is minimised by Levenberg-Marquardt from `start`, within the bounds of the structure where it has any. A
/// trial point whose simulation is not finite is rejected and counted. An unstable result is returned and marked.
///
/// # Errors
/// [`youla::Error::Shape`], [`youla::Error::NotFinite`], [`youla::Error::Ports`], [`youla::Error::OutOfRange`] for data, start or options that do not
/// fit; [`youla::Error::EmptyBounds`], [`youla::Error::OutsideBounds`]; [`youla::Error::TooFewSamples`]; [`youla::Error::Diverged`] with the worst pole where the simulation from `start` is not finite;
/// errors of the structure at `start`.
///
/// # Accuracy
/// The gradient agrees with differences to 1e-7 (`tests::gradient`), noise-free records give the parameters back to 1e-6 and the
/// scatter over noise is that of the covariance within 25 % (`tests::estimates`).
///
/// ```
/// use youla_greybox::{BearingStructure, GreyBoxOptions, greybox};
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
    estimate(structure, start, experiments, time, Setting { closure: None, confined: false }, options)
}

/// The same through the loop: the model is simulated under the controller that ran, from the external signal w alone, and
/// compared with y, or with beta. Needs no stable plant, only a loop that is stable with the start model and does not let the
/// model's own instability into the residual; a trial point with an unstable loop that diverges is rejected.
///
/// `controller` is `J_K` from `(y, w)` to `(u, beta)`, for example [`youla::factor::CoprimeFactors::j_k`] with `w = alpha`, or a
/// plain controller [`youla::control::with_input_port`]; the inputs of the experiments are w. Initial states are those of the
/// plant, then those of the controller; [`GreyBoxModel::fit`] is that of the simulated loop.
///
/// White output noise passes the loop, so that the residuals are coloured: the estimate is consistent whatever the noise,
/// because w does not depend on it, but the covariance is that of white residuals and too optimistic or pessimistic by their
/// colour. For a stable plant [`greybox`] on (u, y) is efficient.
///
/// # Errors
/// As [`greybox`]; [`youla::Error::Ports`] where the controller does not fit, [`youla::Error::OutOfRange`] for a structure with a direct path.
pub fn greybox_in_loop(
    structure: &dyn Structure,
    start: &[f64],
    controller: &Partitioned<Discrete>,
    output: LoopOutput,
    experiments: &[Experiment<'_>],
    time: Discrete,
    options: &GreyBoxOptions,
) -> Result<GreyBoxModel> {
    let closure = Some(Closure::new(controller, output));
    estimate(structure, start, experiments, time, Setting { closure, confined: false }, options)
}

/// The same as [`greybox`]; where `stable` says so, models that are not stable are rejected.
pub(crate) fn greybox_confined(
    structure: &dyn Structure,
    start: &[f64],
    experiments: &[Experiment<'_>],
    time: Discrete,
    stable: bool,
    options: &GreyBoxOptions,
) -> Result<GreyBoxModel> {
    estimate(structure, start, experiments, time, Setting { closure: None, confined: stable }, options)
}
