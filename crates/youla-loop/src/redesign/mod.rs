//! Redesign of the controller on an identified model, with its predicted performance.
//!
//! Two ways, both LQG with output weights, so that resonances gain damping:
//! - [`RedesignMethod::Lqg`]: new F and L on the model itself, a controller in observer form of its own;
//! - [`RedesignMethod::Youla`]: F, L and observer of the running controller stay, `alpha = Q beta` is closed around S. Every
//!   closed-loop map is affine in S, and with the region of S known, `|| W Q (I - S Q)^-1 || < 1` keeps the loop stable for
//!   every S in it ([`small_gain`]).
//!
//! Several weights are tried. Of the controllers whose peak sensitivity is below its limit, the one with the highest minimum
//! damping is chosen that also stabilises every model drawn from the confidence region of S. Source: theory as in `validate::exact`;
//! B. D. O. Anderson, J. B. Moore, Optimal Control, 1990; T.-T. Tay, I. Mareels, J. B. Moore, High Performance Control, 1998.

mod figures;
mod lqg;
mod robust;
mod youla_parameter;

pub use figures::{LoopFigures, least_damping, loop_modes};
pub use lqg::Gains;
pub use robust::{region_radius, small_gain};

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::factor::CoprimeFactors;
use youla::identify::subspace::Uncertainty;
use youla::lti::{Discrete, StateSpace};
use youla::validate::{BandCertificate, BandOptions, ExactCertificate, certify_band, certify_deviation};
use youla::{ErrorKind, Mat};

/// What is redesigned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RedesignMethod {
    /// F and L on the identified model.
    #[default]
    Lqg,
    /// Q between beta and alpha of the running controller.
    Youla,
}

impl RedesignMethod {
    /// The word in run.toml and in results.
    pub fn key(self) -> &'static str {
        match self {
            RedesignMethod::Lqg => "lqg",
            RedesignMethod::Youla => "youla",
        }
    }
}

/// Choices of [`redesign`], the table `[redesign]` of run.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RedesignOptions {
    /// What is redesigned.
    pub method: RedesignMethod,
    /// Weights of the inputs relative to the outputs that are tried, both in their rms. Smaller weights give more damping and more
    /// dependence on details of the model.
    pub input_weights: Vec<f64>,
    /// Covariance of the output noise against that of the inputs, both in their rms, for the observer; not a key of run.toml.
    #[serde(skip)]
    pub output_noise: f64,
    /// Largest peak of the output sensitivity, channels in their rms. ISO 14839-3 calls up to 3 zone A.
    pub peak_sensitivity: f64,
    /// Largest value of the small-gain product over the region of S, for `youla`; below 1; not a key of run.toml.
    #[serde(skip)]
    pub small_gain: f64,
    /// Models that are drawn from the region of S for the final test; not a key of run.toml.
    #[serde(skip)]
    pub band: BandOptions,
}

impl Default for RedesignOptions {
    fn default() -> Self {
        RedesignOptions {
            method: RedesignMethod::default(),
            input_weights: vec![100.0, 30.0, 10.0, 3.0, 1.0],
            output_noise: 0.1,
            peak_sensitivity: 3.0,
            small_gain: 0.9,
            band: BandOptions::default(),
        }
    }
}

/// The input of a redesign.
#[derive(Debug, Clone, Copy)]
pub struct RedesignProblem<'a> {
    /// The model for the LQG design and the figures: G(S), or better its reduction or a physical structure, because G(S) contains
    /// modes that nearly cancel.
    pub model: &'a StateSpace<Discrete>,
    /// The factors of the running controller.
    pub factors: &'a CoprimeFactors<Discrete>,
    /// S.
    pub deviation: &'a StateSpace<Discrete>,
    /// The uncertainty of S, where it is known.
    pub uncertainty: Option<&'a Uncertainty>,
    /// Size of each plant input, its rms.
    pub input_size: &'a [f64],
    /// Size of each plant output, its rms.
    pub output_size: &'a [f64],
}

/// One weight that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct TriedWeight {
    /// Weight of the inputs.
    pub input_weight: f64,
    /// Least damping of the modes that matter; absent where the loop is unstable or the design failed.
    pub least_damping: Option<f64>,
    /// Peak of the output sensitivity.
    pub peak_sensitivity: Option<f64>,
    /// Small-gain product over the region of S, for `youla` with a known region.
    pub small_gain: Option<f64>,
    /// Whether every drawn model within the region is stabilised; absent where that was not tested.
    pub band_holds: Option<bool>,
    /// Reason for the rejection; absent for an accepted candidate.
    pub refused: Option<String>,
}

/// A new controller.
#[derive(Debug, Clone)]
pub struct NewController {
    /// `u = K y` (positive feedback).
    pub system: StateSpace<Discrete>,
    /// Model and gains of the observer form, for `lqg`.
    pub gains: Option<Gains>,
    /// Q from beta to alpha, for `youla`.
    pub q: Option<StateSpace<Discrete>>,
}

/// A new controller with its predicted performance.
#[derive(Debug, Clone)]
pub struct Redesign {
    /// What was redesigned.
    pub method: RedesignMethod,
    /// Weight of the chosen controller.
    pub input_weight: f64,
    /// The controller.
    pub controller: NewController,
    /// The loop of the model with the running controller.
    pub present: LoopFigures,
    /// The loop of the model with the new one.
    pub predicted: LoopFigures,
    /// The exact test of G(S) with K(Q), for `youla`.
    pub exact: Option<ExactCertificate>,
    /// The new loop over the region of S, where it is known.
    pub band: Option<BandCertificate>,
    /// All weights that were tried, in the order of the options.
    pub candidates: Vec<TriedWeight>,
}

impl Redesign {
    /// Whether the least damping rises.
    pub fn gains_damping(&self) -> bool {
        self.predicted.least_damping > self.present.least_damping
    }
}

/// Designs a controller on an identified model.
///
/// Predicted and measured damping on the simulated rig agree within 15 % (`tests/all/redesign.rs`).
///
/// # Errors
/// [`Error::NoRedesign`] when no weight meets the limits, with the reason of the nearest; [`youla::Error::OutOfRange`] for options outside of their
/// range; [`youla::Error::NotStabilising`] when the running controller does not stabilise G(S).
pub fn redesign(problem: &RedesignProblem<'_>, options: &RedesignOptions) -> Result<Redesign> {
    check(options)?;
    let plant = problem.factors.plant_of(problem.deviation)?;
    let running = problem.factors.controller()?;
    let sizes = (problem.input_size, problem.output_size);
    let present = LoopFigures::new(problem.model, &running, sizes)?;
    let mut tried: Vec<(TriedWeight, Option<(NewController, LoopFigures)>)> = Vec::new();
    for weight in &options.input_weights {
        tried.push(try_weight(problem, options, &plant, *weight)?);
    }
    let mut order: Vec<usize> = (0..tried.len()).filter(|k| tried[*k].1.is_some()).collect();
    let damping = |k: usize| tried[k].0.least_damping.unwrap_or(f64::NEG_INFINITY);
    order.sort_by(|a, b| damping(*b).total_cmp(&damping(*a)));
    for k in order {
        let Some((controller, predicted)) = tried[k].1.take() else { continue };
        let band = band(problem, options, &controller)?;
        tried[k].0.band_holds = band.as_ref().map(BandCertificate::holds);
        if band.as_ref().is_none_or(BandCertificate::holds) {
            let input_weight = tried[k].0.input_weight;
            let candidates = tried.into_iter().map(|t| t.0).collect();
            let method = options.method;
            let exact = controller.q.as_ref().map(|q| certify_deviation(problem.factors, problem.deviation, Some(q)));
            let exact = exact.transpose()?;
            return Ok(Redesign { method, input_weight, controller, present, predicted, exact, band, candidates });
        }
        tried[k].0.refused =
            band.map(|b| format!("unstable for {} of {} models within the region of S", b.unstable_within, b.within));
    }
    let reasons: Vec<String> =
        tried.iter().filter_map(|(c, _)| Some(format!("weight {}: {}", c.input_weight, c.refused.as_ref()?))).collect();
    Err(Error::NoRedesign { reasons: reasons.join("; ") })
}

fn check(options: &RedesignOptions) -> Result<()> {
    let refuse = |what: &str, value: f64, must: &'static str| {
        Err(Error::Method(youla::Error::OutOfRange { what: what.into(), value, must }))
    };
    let positive = |v: f64| v > 0.0 && v.is_finite();
    if let Some(bad) = options.input_weights.iter().copied().find(|w| !positive(*w)) {
        return refuse("a weight of the inputs", bad, "positive");
    }
    if options.input_weights.is_empty() {
        return refuse("the number of weights of the inputs", 0.0, "at least 1");
    }
    if !positive(options.output_noise) {
        return refuse("the output noise of the observer", options.output_noise, "positive");
    }
    if options.peak_sensitivity.is_nan() || options.peak_sensitivity <= 1.0 {
        return refuse("the limit of the peak sensitivity", options.peak_sensitivity, "above 1");
    }
    if !(options.small_gain > 0.0 && options.small_gain < 1.0) {
        return refuse("the limit of the small-gain product", options.small_gain, "above 0 and below 1");
    }
    Ok(())
}

/// Designs for one weight and compares the loop with the limits; the controller is returned only if it meets them.
fn try_weight(
    problem: &RedesignProblem<'_>,
    options: &RedesignOptions,
    plant: &StateSpace<Discrete>,
    weight: f64,
) -> Result<(TriedWeight, Option<(NewController, LoopFigures)>)> {
    let mut candidate = TriedWeight {
        input_weight: weight,
        least_damping: None,
        peak_sensitivity: None,
        small_gain: None,
        band_holds: None,
        refused: None,
    };
    let designed = match options.method {
        RedesignMethod::Lqg => lqg::design(problem, weight, options.output_noise),
        RedesignMethod::Youla => youla_parameter::design(problem, weight, options.output_noise),
    };
    let designed = designed.and_then(|controller| {
        // The loop of G(S) must be stable too; its pole is in the error.
        let ports = youla::control::with_input_port(&controller.system)?;
        let whole = youla::control::closed_loop(plant, &ports)?;
        whole.require_stable("the loop of G(S)")?;
        let figures = LoopFigures::new(problem.model, &controller.system, (problem.input_size, problem.output_size))?;
        Ok((controller, figures))
    });
    let (controller, figures) = match designed {
        Ok(found) => found,
        Err(e)
            if e.kind() == ErrorKind::Numerical || matches!(e, Error::Method(youla::Error::NotStabilising { .. })) =>
        {
            candidate.refused = Some(e.to_string());
            return Ok((candidate, None));
        }
        Err(e) => return Err(e),
    };
    candidate.least_damping = Some(figures.least_damping);
    candidate.peak_sensitivity = Some(figures.peak_sensitivity);
    if let (Some(q), Some(uncertainty)) = (&controller.q, problem.uncertainty) {
        candidate.small_gain = small_gain(problem.deviation, q, uncertainty)?;
    }
    candidate.refused = if figures.peak_sensitivity > options.peak_sensitivity {
        Some(format!("the peak of the sensitivity is {:.2}", figures.peak_sensitivity))
    } else {
        let beyond = candidate.small_gain.filter(|product| *product > options.small_gain);
        beyond.map(|product| format!("the small-gain product over the region of S is {product:.2}"))
    };
    let kept = candidate.refused.is_none().then_some((controller, figures));
    Ok((candidate, kept))
}

/// The loop of the new controller with the models of the region of S, each recombined to its plant.
fn band(
    problem: &RedesignProblem<'_>,
    options: &RedesignOptions,
    controller: &NewController,
) -> Result<Option<BandCertificate>> {
    let Some(uncertainty) = problem.uncertainty else { return Ok(None) };
    let ports = youla::control::with_input_port(&controller.system)?;
    let closed = |s: &StateSpace<Discrete>| youla::control::closed_loop(&problem.factors.plant_of(s)?, &ports);
    // The experiment ran under the running controller, so the true S is stable.
    Ok(certify_band(uncertainty, &options.band, StateSpace::is_stable, closed)?)
}

/// A diagonal matrix.
fn diagonal(values: impl Iterator<Item = f64>) -> Mat<f64> {
    let values: Vec<f64> = values.collect();
    Mat::from_fn(values.len(), values.len(), |i, j| if i == j { values[i] } else { 0.0 })
}
