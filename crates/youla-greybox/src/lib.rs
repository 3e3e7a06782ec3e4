//! Physical parameters from measured records, by the prediction-error method.
//!
//! A structure gives the matrices of a state-space model as functions of named parameters theta, in continuous time behind a
//! zero-order hold or in discrete time. For white output noise, `y = G(theta) u + n`, the predictor is the simulation and the
//! estimate is
//! ```text
//! theta = arg min 1/2 sum_k |y(k) - yhat(k; theta)|^2,
//! x(k+1) = Ad(theta) x(k) + Bd(theta) u(k),   yhat(k) = C(theta) x(k) + D(theta) u(k)
//! ```
//! the maximum-likelihood estimate: consistent and efficient, in closed loop too (L. Ljung, System Identification: Theory for
//! the User, 2nd ed., 1999, sections 7.2, 8.4, 9.4 and 13.4). The search finds the minimum next to its start. For lightly damped
//! modes far from their true frequency this is often a local minimum, which [`Stop`] cannot distinguish from the global one;
//! [`hansen_pem`] starts at the projection of a black-box model and compares the fits.
//!
//! ```
//! use youla::{Mat, identify::subspace::Experiment, lti::{Discrete, simulate}};
//! use youla_greybox::{DeclaredStructure, GreyBoxOptions, Problem, Structure, Template, greybox};
//! let structure = DeclaredStructure::new(&Template::MassSpringDamper.declaration()?)?;
//! let (truth, time) = (structure.start(), Discrete::new(5e-3)?);
//! let u = Mat::from_fn(600, 1, |k, _| if (k * k / 90) % 2 == 0 { 1.0 } else { -1.0 });
//! let y = simulate(&structure.sampled(&truth, time)?, u.as_ref(), &[0.0; 2])?;
//! let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
//! let start: Vec<f64> = truth.iter().map(|v| 1.1 * v).collect();
//! let estimate = greybox(&Problem::new(&structure, &experiments, time), &start, &GreyBoxOptions::default())?;
//! assert!((estimate.parameters[0] / truth[0] - 1.0).abs() < 1e-6);
//! # Ok::<(), youla_greybox::Error>(())
//! ```
//!
//! Modules in the order of the data:
//!
//! | task | files |
//! |---|---|
//! | structures in code and as declarations | `structure`, `declared` |
//! | structure, records, simulated loop | `problem`, `checks`, `delays`, `closure` |
//! | sampled model with derivatives | `sampled` |
//! | predictors of noise models | `noise`, `predictor`, `whitening`, `simulated` |
//! | sensitivities and their triangular factor | `sensitivity`, `sensitivity_bank`, `small_qr` |
//! | criterion, initial states | `criterion`, `steady`, `linearisation` |
//! | search within bounds | `levenberg`, `bounds`, `options` |
//! | result, covariance, undetermined parameters | `estimate`, `result`, `uncertainty`, `identifiability` |
//! | intervals, test of the residuals, comparison of structures | `intervals` |
//! | projection of a frequency response on a structure | `projection` |
//! | searches from a projection | [`projected_pem`], [`hansen_pem`] |

mod checks;
mod closure;
mod declared;
mod delays;
mod error;
pub mod hansen_pem;
mod intervals;
mod options;
mod prediction;
mod problem;
pub mod projected_pem;
mod projection;
mod result;
mod search;
mod structure;
#[cfg(test)]
mod tests;

pub use closure::LoopOutput;
pub use declared::{
    Declaration, DeclaredStructure, DerivedValue, Entry, NamedExpression, Parameter, ParameterDeclaration, Template,
};
pub use error::{Error, Result};
pub use intervals::{
    ComparedStructure, CrossCorrelation, GreyBoxIntervals, IntervalOptions, LikelihoodRatio, ModeBand,
    ParameterInterval, ResidualAssumption, ResidualTest, ResponseBand, compare, greybox_intervals, likelihood_ratio,
};
pub use options::GreyBoxOptions;
pub use prediction::noise::{InnovationStart, NoiseFilter, NoiseKind, NoiseModel};
pub use problem::Problem;
pub(crate) use projection::decayed;
pub use projection::{
    FrequencyTarget, Origin, ProjectionOptions, StructureFit, logarithmic_grid, project, projections,
};
pub use result::{GreyBoxModel, Stop};
pub use search::bounds::{AtBound, Side};
pub(crate) use search::cost::greybox_cost;
pub use search::identifiability::{Combination, Part, Undetermined};
pub use structure::{Matrix, Slope, Structure};

use search::estimate::estimate;

/// Estimates the parameters of a structure by the prediction-error method.
///
/// The criterion is minimised by Levenberg-Marquardt from `start`, within the bounds of the structure where it has any. A
/// trial point whose simulation is not finite is rejected and counted. An unstable result is returned and marked.
///
/// # Errors
/// [`youla::Error::Shape`], [`youla::Error::NotFinite`], [`youla::Error::Ports`], [`youla::Error::OutOfRange`] for data, start or options that do not
/// fit; [`crate::Error::EmptyBounds`], [`crate::Error::OutsideBounds`]; [`youla::Error::TooFewSamples`]; [`youla::Error::Diverged`] with the worst pole where the simulation from `start` is not finite;
/// errors of the structure at `start`.
///
/// # Accuracy
/// The gradient agrees with differences to 1e-7 (`tests::gradient`), noise-free records give the parameters back to 1e-6 and the
/// scatter over noise is that of the covariance within 25 % (`tests::estimates`).
///
/// ```
/// use youla_greybox::{DeclaredStructure, GreyBoxOptions, Problem, Structure, Template, greybox};
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, simulate};
/// use youla::Mat;
/// let time = Discrete::new(2e-4)?;
/// let u = Mat::from_fn(1000, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
/// let bearing = DeclaredStructure::new(&Template::Bearing.declaration()?)?;
/// let y = simulate(&bearing.model(&bearing.start())?.zoh(time)?, u.as_ref(), &[0.0; 6])?;
/// let truth = bearing.start();
/// let start: Vec<f64> = truth.iter().map(|v| 0.9 * v).collect();
/// let experiment = Experiment::new(u.as_ref(), y.as_ref());
/// let found = greybox(&Problem::new(&bearing, &[experiment], time), &start, &GreyBoxOptions::default())?;
/// assert!((found.parameters[0] / truth[0] - 1.0).abs() < 1e-6);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
pub fn greybox(problem: &Problem<'_>, start: &[f64], options: &GreyBoxOptions) -> Result<GreyBoxModel> {
    estimate(problem, start, options)
}
