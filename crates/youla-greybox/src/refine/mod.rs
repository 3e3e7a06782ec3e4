//! Refinement of a black-box model by the prediction-error method, for plants without a known structure.
//!
//! ```text
//! min over A, B, C [, D, K] of 1/2 sum_k |W (y(k) - yhat(k))|^2,    W = diag(1 / rms residual of the start)
//! ```
//! A model has n^2 more entries than its transfer function has parameters: those of a similarity transformation. Here only
//! the directions move that are orthogonal to them at the point where the search is: data driven local coordinates (T.
//! McKelvey, A. Helmersson and T. Ribarits, Automatica 40 (2004), 1629). That is an affine structure of discrete time around
//! the balanced estimate (`local.rs`), in which the search of `greybox` takes a few steps before new coordinates are laid, until
//! nothing moves.
//!
//! A subspace estimate is the start, not the rival: it is consistent but not efficient, and has no local minima.

mod balance;
mod local;
#[cfg(test)]
mod tests;

pub use local::LocalCoordinates;

use crate::Result;
use crate::{GreyBoxModel, GreyBoxOptions, InnovationStart, NoiseModel, Problem, Stop, greybox, greybox_cost};
use balance::Balanced;
use serde::{Deserialize, Serialize};
use youla::identify::subspace::{Experiment, InitialState};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// Steps in one set of local coordinates.
const STEPS: usize = 8;
/// An output of which the start leaves a smaller share is weighted as if it left this one.
const LEFT: f64 = 1e-6;

/// Choices of [`refine`].
///
/// ```
/// use youla_greybox::refine::{RefineNoise, RefineOptions};
/// let options = RefineOptions { noise: RefineNoise::Innovation, ..Default::default() };
/// assert!(options.stable);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RefineOptions {
    /// The model of the noise.
    pub noise: RefineNoise,
    /// Whether D is free; it keeps its value otherwise.
    pub feedthrough: bool,
    /// Whether the search takes stable models only.
    pub stable: bool,
    /// The state at the first sample of each experiment.
    pub initial_state: InitialState,
    /// Largest number of steps.
    pub max_iterations: usize,
    /// Converged where the distance to the minimum of the linearised criterion is below this share of the radius of the confidence
    /// region, as in [`crate::GreyBoxOptions::offset_tolerance`].
    pub offset_tolerance: f64,
    /// Smallest step, relative to the parameters, as in [`crate::GreyBoxOptions::step_tolerance`].
    pub step_tolerance: f64,
}

impl Default for RefineOptions {
    fn default() -> Self {
        RefineOptions {
            noise: RefineNoise::default(),
            feedthrough: false,
            stable: true,
            initial_state: InitialState::default(),
            max_iterations: 50,
            offset_tolerance: 1e-3,
            step_tolerance: 1e-10,
        }
    }
}

/// The model of the noise in a refinement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RefineNoise {
    /// White noise at the outputs: the simulation is fitted.
    #[default]
    OutputError,
    /// White innovations with a free gain K: the prediction one step ahead is fitted, by a stable predictor.
    Innovation,
}

/// Result of [`refine`].
#[derive(Debug, Clone)]
pub struct RefinedModel {
    /// The model, in balanced states.
    pub model: StateSpace<Discrete>,
    /// The gain K, n x p, with an innovation form.
    pub gain: Option<Mat<f64>>,
    /// Whether the model is stable.
    pub stable: bool,
    /// State at the first sample of each experiment.
    pub initial_states: Vec<Vec<f64>>,
    /// Standard deviations by which the residuals of each output were divided: root mean square of those of the start.
    pub deviations: Vec<f64>,
    /// Half the sum of squares of the divided residuals at the start.
    pub cost_before: f64,
    /// The same of the model.
    pub cost: f64,
    /// Fit of the simulation at the start, percent per output, eq. (26).
    pub fit_before: Vec<f64>,
    /// The same of the model.
    pub fit: Vec<f64>,
    /// Fit of the prediction that the criterion compares; that of the simulation for output error.
    pub prediction_fit: Vec<f64>,
    /// Why the search ended.
    pub stop: Stop,
    /// Distance to the minimum of the linearised criterion over the radius of the confidence region.
    pub relative_offset: f64,
    /// Steps that lowered the criterion.
    pub iterations: usize,
    /// Sets of local coordinates.
    pub charts: usize,
    /// Trial points that were rejected because they were not stable or their simulation was not finite.
    pub diverged: usize,
    /// The last local coordinates.
    pub coordinates: LocalCoordinates,
    /// The model in them.
    pub parameters: Vec<f64>,
    /// Covariance of these for white residuals; `None` where the data do not determine them all.
    pub covariance: Option<Mat<f64>>,
}

/// Refines a model, for example of [`youla::identify::subspace::subspace`], on one or more experiments. `gain` is K at the start of an
/// innovation form (n x p), zero where `None`.
///
/// # Errors
/// As [`crate::greybox`]; [`youla::Error::Unstable`] where the start, or its predictor, is not stable.
///
/// # Accuracy
/// The result does not depend on the states of the start (`tests::similar_starts_end_alike`).
///
/// ```
/// use youla_greybox::refine::{RefineOptions, refine};
/// use youla::identify::subspace::Experiment;
/// use youla::lti::{Discrete, StateSpace, simulate};
/// use youla::{Mat, linalg::eye};
/// let lag = |pole: f64, gain: f64| {
///     let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
///     StateSpace::new(number(pole), number(gain), eye(1), Mat::zeros(1, 1), Discrete::new(0.1)?)
/// };
/// let u = Mat::from_fn(300, 1, |k, _| ((k * k) as f64).sin());
/// let y = simulate(&lag(0.7, 2.0)?, u.as_ref(), &[0.0])?;
/// let records = [Experiment::new(u.as_ref(), y.as_ref())];
/// let found = refine(&lag(0.6, 1.8)?, None, &records, &RefineOptions::default())?;
/// assert!((found.model.a()[(0, 0)] - 0.7).abs() < 1e-8);
/// # Ok::<(), youla_greybox::Error>(())
/// ```
pub fn refine(
    start: &StateSpace<Discrete>,
    gain: Option<MatRef<'_, f64>>,
    experiments: &[Experiment<'_>],
    options: &RefineOptions,
) -> Result<RefinedModel> {
    let time = start.time();
    let gain = match options.noise {
        RefineNoise::OutputError => None,
        RefineNoise::Innovation => {
            Some(gain.map_or_else(|| Mat::zeros(start.order(), start.outputs()), |gain| gain.to_owned()))
        }
    };
    let mut here = Balanced::new(start, gain)?;
    let mut coordinates = LocalCoordinates::new(here.model.clone(), options.feedthrough);
    let search = |coordinates: &LocalCoordinates, choices: &GreyBoxOptions| {
        let problem = Problem::new(coordinates, experiments, time).confined(options.stable);
        greybox(&problem, &coordinates.origin(), choices)
    };
    let mut choices = choices(options, &here, 0);
    let begun = search(&coordinates, &choices)?;
    choices.output_deviations = deviations(&begun, experiments);
    let cost_before = greybox_cost(&Problem::new(&coordinates, experiments, time), &coordinates.origin(), &choices)?;
    let (mut iterations, mut charts, mut diverged) = (0, 0, 0);
    loop {
        choices.max_iterations = STEPS.min(options.max_iterations - iterations);
        choices.noise = noise(&here);
        let found = search(&coordinates, &choices)?;
        (iterations, charts, diverged) = (iterations + found.iterations, charts + 1, diverged + found.diverged);
        let converged = found.iterations == 0 || found.stop == Stop::Exact || iterations == options.max_iterations;
        if converged {
            return Ok(RefinedModel {
                stable: found.stable,
                deviations: choices.output_deviations,
                cost_before,
                cost: found.cost,
                fit_before: begun.simulation_fit,
                fit: found.simulation_fit,
                prediction_fit: found.fit,
                stop: found.stop,
                relative_offset: found.relative_offset,
                iterations,
                charts,
                diverged,
                coordinates,
                parameters: found.parameters,
                covariance: found.covariance,
                initial_states: found.initial_states,
                gain: found.gain,
                model: found.model,
            });
        }
        here = Balanced::new(&found.model, found.gain)?;
        coordinates = LocalCoordinates::new(here.model.clone(), options.feedthrough);
    }
}

fn choices(options: &RefineOptions, here: &Balanced, max_iterations: usize) -> GreyBoxOptions {
    GreyBoxOptions {
        max_iterations,
        offset_tolerance: options.offset_tolerance,
        step_tolerance: options.step_tolerance,
        initial_state: options.initial_state,
        noise: noise(here),
        ..GreyBoxOptions::default()
    }
}

fn noise(here: &Balanced) -> NoiseModel {
    match &here.gain {
        None => NoiseModel::OutputError,
        Some(gain) => NoiseModel::Innovation(InnovationStart::of(gain.as_ref())),
    }
}

/// Root mean square of the residuals of each output, not below [`LEFT`] of the output itself.
fn deviations(begun: &GreyBoxModel, experiments: &[Experiment<'_>]) -> Vec<f64> {
    let samples = experiments.iter().map(|e| e.y.nrows()).sum::<usize>() as f64;
    let size = |i: usize| experiments.iter().map(|e| e.y.col(i).norm_l2()).fold(0.0, f64::hypot) / samples.sqrt();
    let of_output = |(i, residual): (usize, &f64)| {
        let deviation = residual.max(LEFT * size(i));
        if deviation > 0.0 { deviation } else { 1.0 }
    };
    begun.residual.iter().enumerate().map(of_output).collect()
}
