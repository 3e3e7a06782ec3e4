//! Redesign of the controller on an identified model, with its predicted performance.
//!
//! Two ways, both LQG with output weights, so that resonances gain damping:
//! - [`RedesignMethod::Lqg`]: new F and L on the model itself, a controller in observer form of its own;
//! - [`RedesignMethod::Youla`]: F, L and observer of the running controller stay, `alpha = Q beta` is closed around S. Every
//!   closed-loop map is affine in S, and with the region of the plant known, `|| W Q (I - S Q)^-1 || < 1` keeps the loop stable for
//!   every S in it ([`DeviationRegion::small_gain`]).
//!
//! Several weights are tried. Of the controllers whose peak sensitivity is below its limit, the one with the highest minimum
//! damping is chosen that also stabilises every model drawn from the confidence region of the plant. Source: theory as in `validate::exact`;
//! B. D. O. Anderson, J. B. Moore, Optimal Control, 1990; T.-T. Tay, I. Mareels, J. B. Moore, High Performance Control, 1998.

mod figures;
mod lqg;
mod robust;
pub mod structured;
mod youla_parameter;

use figures::followed_damping;
pub use figures::{LoopFigures, disturbance_response, least_damping, loop_modes};
pub use lqg::Gains;
pub use robust::DeviationRegion;

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use structured::{ControllerStructure, PidOptions};
use youla::control::{ChannelScales, closed_loop, margins, with_input_port};
use youla::factor::CoprimeFactors;
use youla::identify::likelihood::{Interval, Region, figure};
use youla::lti::{Discrete, StateSpace};
use youla::validate::{
    BandCertificate, BandOptions, ExactCertificate, MarginInterval, certify_deviation, certify_region, margin_intervals,
};
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
    /// Largest value of the small-gain product over the region of the plant, for `youla`; below 1; not a key of run.toml.
    #[serde(skip)]
    pub small_gain: f64,
    /// Models that are drawn from the region of the plant for the final test; not a key of run.toml.
    #[serde(skip)]
    pub band: BandOptions,
    /// A fixed structure in which the controller is designed, in place of `method`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub structure: Option<ControllerStructure>,
    /// Parts and limits of a PID, for `structure = "pid"`.
    #[serde(skip_serializing_if = "PidOptions::is_default")]
    pub pid: PidOptions,
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
            structure: None,
            pid: PidOptions::default(),
        }
    }
}

/// The input of a redesign.
#[derive(Debug, Clone, Copy)]
pub struct RedesignProblem<'a> {
    /// The identified plant, on which every new controller is tested.
    pub plant: &'a StateSpace<Discrete>,
    /// The model for the LQG design and the figures: the plant itself, its reduction or a physical structure.
    pub model: &'a StateSpace<Discrete>,
    /// The factors of the running controller.
    pub factors: &'a CoprimeFactors<Discrete>,
    /// The region of the plant, where it is known.
    pub region: Option<&'a Region>,
    /// Size of each plant input, its rms.
    pub input_size: &'a [f64],
    /// Size of each plant output, its rms.
    pub output_size: &'a [f64],
    /// Dead time in whole samples that the machine adds to its controller; it is in the factors too.
    pub delay: usize,
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
    /// Small-gain product over the region of the plant, for `youla` with a known region.
    pub small_gain: Option<f64>,
    /// Whether every drawn model within the region is stabilised; absent where that was not tested.
    pub band_holds: Option<bool>,
    /// Reason for the rejection; absent for an accepted candidate.
    pub refused: Option<String>,
}

/// A new controller.
#[derive(Debug, Clone)]
pub struct NewController {
    /// `u = K y` (positive feedback), behind the dead time that the machine adds.
    pub system: StateSpace<Discrete>,
    /// What the machine computes: `system` without that dead time. The factors of `youla` hold the dead time, and so does its controller.
    pub computed: StateSpace<Discrete>,
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
    /// The exact test of the plant with K(Q), for `youla`.
    pub exact: Option<ExactCertificate>,
    /// The new loop over the region of the plant, where it is known.
    pub band: Option<BandCertificate>,
    /// Figures of the new loop of the plant with their intervals, where the region is known.
    pub intervals: Option<PredictedIntervals>,
    /// How much better slow loads are rejected: the largest gain from a load at the plant input to y, running over new controller, channels in their
    /// rms, at [`SLOW`] of the Nyquist frequency.
    pub rejection: f64,
    /// All weights that were tried, in the order of the options.
    pub candidates: Vec<TriedWeight>,
}

/// The frequency of slow loads, as a part of the Nyquist frequency. Chosen, not measured.
pub const SLOW: f64 = 1e-3;
/// A new controller that rejects slow loads worse than by this factor has lost what the running one was for, as an integral part. Chosen, not
/// measured.
const LEAST_REJECTION: f64 = 0.5;

/// What the region of the plant leaves open of the new loop.
#[derive(Debug, Clone)]
pub struct PredictedIntervals {
    /// Least damping of the loop, see [`LoopFigures::least_damping`].
    pub least_damping: Option<Interval>,
    /// Its margins.
    pub margins: Vec<MarginInterval>,
}

impl Redesign {
    /// Whether the least damping rises.
    pub fn gains_damping(&self) -> bool {
        self.predicted.least_damping > self.present.least_damping
    }

    /// Why the new controller should not be taken without a look at slow loads.
    pub fn reservations(&self) -> Vec<String> {
        let lost = || {
            format!("a slow load moves y {} times as far as with the running controller", figure(1.0 / self.rejection))
        };
        (self.rejection < LEAST_REJECTION).then(lost).into_iter().collect()
    }
}

/// Designs a controller on an identified model.
///
/// Predicted and measured damping on the simulated rig agree within 15 % (`tests/running_loop/redesign.rs`).
///
/// # Errors
/// [`Error::NoRedesign`] when no weight meets the limits, with the reason of the nearest; [`youla::Error::OutOfRange`] for options outside of their
/// range; [`youla::Error::NotStabilising`] when the running controller does not stabilise the plant.
pub fn redesign(problem: &RedesignProblem<'_>, options: &RedesignOptions) -> Result<Redesign> {
    check(options)?;
    let deviation = problem.factors.deviation_of(problem.plant)?;
    let running = problem.factors.controller()?;
    let sizes = (problem.input_size, problem.output_size);
    let present = LoopFigures::new(problem.model, &running, sizes)?;
    let mut tried: Vec<(TriedWeight, Option<(NewController, LoopFigures)>)> = Vec::new();
    for weight in &options.input_weights {
        tried.push(try_weight(problem, options, &deviation, *weight)?);
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
            let exact = controller.q.as_ref().map(|q| certify_deviation(problem.factors, &deviation, Some(q)));
            let exact = exact.transpose()?;
            let intervals = match (problem.region, &band) {
                (Some(region), Some(band)) => Some(predicted_intervals(problem, region, &controller, band.level)?),
                _ => None,
            };
            let slow = [SLOW * std::f64::consts::PI / problem.model.time().ts()];
            return Ok(Redesign {
                rejection: present.gain(&slow)?[0] / predicted.gain(&slow)?[0],
                method,
                input_weight,
                controller,
                present,
                predicted,
                exact,
                band,
                intervals,
                candidates,
            });
        }
        tried[k].0.refused = band.map(|b| {
            let unstable =
                || format!("unstable for {} of {} models within the region of the plant", b.unstable_within, b.within);
            contradicted(b.impossible, b.models).unwrap_or_else(unstable)
        });
    }
    let reasons: Vec<String> =
        tried.iter().filter_map(|(c, _)| Some(format!("weight {}: {}", c.input_weight, c.refused.as_ref()?))).collect();
    Err(Error::NoRedesign { reasons: reasons.join("; ") })
}

/// Why models that are left of a region prove nothing, where they are less than half.
fn contradicted(impossible: usize, models: usize) -> Option<String> {
    let all = impossible + models;
    (impossible > models).then(|| {
        format!("the running controller does not stabilise {impossible} of {all} models of the region, which the log contradicts")
    })
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
    deviation: &StateSpace<Discrete>,
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
        RedesignMethod::Youla => youla_parameter::design(problem, deviation, weight, options.output_noise),
    };
    let designed = designed.and_then(|controller| {
        // The loop of the plant must be stable too; its pole is in the error.
        let whole = closed_loop(problem.plant, &with_input_port(&controller.system)?)?;
        whole.require_stable("the loop of the identified plant")?;
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
    if let (Some(q), Some(region)) = (&controller.q, problem.region) {
        let deviations = DeviationRegion { factors: problem.factors, plant: problem.plant, region };
        candidate.small_gain = Some(deviations.small_gain(deviation, q)?);
    }
    candidate.refused = if figures.peak_sensitivity > options.peak_sensitivity {
        Some(format!("the peak of the sensitivity is {:.2}", figures.peak_sensitivity))
    } else {
        let beyond = candidate.small_gain.filter(|product| *product > options.small_gain);
        beyond.map(|product| format!("the small-gain product over the region of the plant is {product:.2}"))
    };
    let kept = candidate.refused.is_none().then_some((controller, figures));
    Ok((candidate, kept))
}

/// The loop of the new controller with the plants of the region.
fn band(
    problem: &RedesignProblem<'_>,
    options: &RedesignOptions,
    controller: &NewController,
) -> Result<Option<BandCertificate>> {
    let Some(region) = problem.region else { return Ok(None) };
    let running = with_input_port(&problem.factors.controller()?)?;
    // The records were taken under the running controller, so that it stabilises the true plant.
    let possible = |plant: &StateSpace<Discrete>| closed_loop(plant, &running)?.is_stable();
    let ports = with_input_port(&controller.system)?;
    Ok(Some(certify_region(region, &options.band, possible, |plant| closed_loop(plant, &ports))?))
}

/// Intervals of the new loop: of the damping by the delta method over the region, of the margins by their slopes where they are critical.
fn predicted_intervals(
    problem: &RedesignProblem<'_>,
    region: &Region,
    controller: &NewController,
    level: f64,
) -> Result<PredictedIntervals> {
    let (plant, k) = (problem.plant, &controller.system);
    let response = disturbance_response(plant, k)?.in_units(problem.input_size, problem.output_size);
    let followed = followed_damping(&loop_modes(&response)?);
    let damping = |plant: &StateSpace<Discrete>| Ok(vec![followed(&disturbance_response(plant, k)?)?]);
    // Damping ratios are of that size; where two poles meet, the slope of theirs has no bound.
    let possible = |i: &Interval| Interval { bounds: i.bounds.map(|bound| bound.clamp(-1.0, 1.0)), ..*i };
    let least_damping = region.intervals(level, damping)?.first().map(possible);
    let scales = ChannelScales::new(problem.input_size.to_vec(), problem.output_size.to_vec())?;
    let margins = margin_intervals(&margins(plant, k)?, plant, k, region, Some(&scales), level)?;
    Ok(PredictedIntervals { least_damping, margins })
}

/// A diagonal matrix.
fn diagonal(values: impl Iterator<Item = f64>) -> Mat<f64> {
    let values: Vec<f64> = values.collect();
    Mat::from_fn(values.len(), values.len(), |i, j| if i == j { values[i] } else { 0.0 })
}
