//! The entry to identification: records of a loop and its controller in, one model with region, deviation system and evidence out.

use super::likelihood::{self, LikelihoodOptions, LoopKnowledge, LoopSignals, MeasuredResponse, Recommendation};
use super::subspace::Experiment;
use crate::control::RunningController;
use crate::factor::{CoprimeFactors, loop_factors};
use crate::linalg::{block, least_squares};
use crate::lti::{Discrete, StateSpace};
use crate::signal::LoopRecord;
use crate::{Error, Mat, Result};

/// The model that the records of a loop support, with everything that follows from it.
#[derive(Debug)]
pub struct Identified {
    /// Plant, noise, modes, region and evidence.
    pub model: Recommendation,
    /// The deviation system of the plant; an error where the nominal model and the controller have no factors.
    pub deviation: Result<Deviation>,
}

impl Identified {
    /// Whether every question to the records is answered within its limit.
    pub fn trusted(&self) -> bool {
        self.model.trusted()
    }

    /// The questions whose figures are beyond their limits.
    pub fn reasons(&self) -> Vec<String> {
        self.model.reasons()
    }
}

/// The deviation system S of a plant with respect to the factors of a nominal model and of the controller that ran.
///
/// ```text
/// S = F_u(J_K, G),        G = F_u(J_G, S)        (inverse of (17))
/// ```
/// The poles of S are those of the loop of the plant: S is stable exactly where the controller stabilises the plant.
#[derive(Debug, Clone)]
pub struct Deviation {
    /// The factors.
    pub factors: CoprimeFactors<Discrete>,
    /// S, from alpha to beta.
    pub system: StateSpace<Discrete>,
}

impl Deviation {
    /// S of a plant.
    ///
    /// # Errors
    /// Ports, sample times, or a loop that is not well posed.
    pub fn new(factors: CoprimeFactors<Discrete>, plant: &StateSpace<Discrete>) -> Result<Self> {
        Ok(Deviation { system: factors.deviation_of(plant)?, factors })
    }
}

/// Identifies the plant of a loop from its records, without a tuning key.
///
/// Plant and noise come from one maximum-likelihood estimate on u and y, valid in closed loop and for unstable plants
/// ([`super::likelihood`]); order, dead time and noise are chosen by the evidence of the records. The records of `fresh`, which may be
/// empty, are asked whether they agree. The `nominal` model has no part in the estimate: it gives the factors with respect to which the
/// deviation system S is stated; without one S is that of the recommended plant itself, zero.
///
/// The result does not depend on the number of threads.
///
/// # Errors
/// [`Error::SampleTimeMismatch`] and [`Error::Ports`] for records, controller and nominal model that do not fit each other,
/// [`Error::ConstantChannel`] names a channel, [`Error::TooFewSamples`] says how many are needed, [`Error::OutOfRange`] names an option
/// that cannot be met; [`Error::NoCandidate`] where no search ends.
///
/// ```
#[doc = include_str!("../../assets/docs/loop.txt")]
/// use youla::{control::RunningController, signal::LoopRecord};
/// let record = LoopRecord::new(time, u, y)?.with_alpha(alpha)?;
/// let controller = RunningController::observer(&nominal, f, l)?;
/// let found = youla::identify(&[record], &[], &controller, Some(&nominal), &Default::default())?;
/// assert!((found.model.modes[0].mode.hz - 10.0).abs() < 0.1); // the nominal model says 9 Hz
/// assert!(found.deviation?.system.is_stable()?); // the controller stabilises the plant
/// # Ok::<(), youla::Error>(())
/// ```
pub fn identify(
    records: &[LoopRecord],
    fresh: &[LoopRecord],
    controller: &RunningController,
    nominal: Option<&StateSpace<Discrete>>,
    options: &LikelihoodOptions,
) -> Result<Identified> {
    let Some(first) = records.first() else {
        return Err(Error::TooFewSamples { what: "the records".into(), found: 0, needed: 1 });
    };
    check(records.iter().chain(fresh), controller, nominal)?;
    let signals = |group: &[LoopRecord]| group.iter().map(|r| Signals::new(r, controller)).collect::<Result<Vec<_>>>();
    let (estimation, verification) = (signals(records)?, signals(fresh)?);
    let law = match estimation.iter().any(|s| s.observer) {
        true => controller.observer_law(),
        false => Some(controller.system()),
    };
    let law = law.filter(|_| !controller.is_open_loop());
    let feedback = Some(controller.system()).filter(|_| !controller.is_open_loop());
    let known = LoopKnowledge::new(law, feedback, views(&estimation), views(&verification))?;
    let model = likelihood::recommend(
        &experiments(&estimation),
        &experiments(&verification),
        Some(&known),
        first.time(),
        options,
    )?;
    let deviation = deviation(nominal, controller, &model);
    Ok(Identified { model, deviation })
}

/// Identifies the plant of a loop from a measured frequency response in place of records.
///
/// Without a stated variance the lines state it by their distance from the model; a model that misses dynamics is then noticed only by
/// errors of neighbouring lines that agree. The predictor has no gain: lines do not tell how noise and initial state share the outputs.
///
/// # Errors
/// As [`identify`]; [`Error::TooFewSamples`] says how many lines are needed.
///
/// ```
/// use youla::identify::{identify_response, likelihood::{MeasuredResponse, ResponseTable, ResponseVariance}};
/// use youla::{Mat, c64, control::RunningController, lti::Discrete};
/// let (time, omega) = (Discrete::new(1.0)?, (1..60).map(|k| 0.05 * f64::from(k)).collect::<Vec<f64>>());
/// let exact = |w: &f64| 0.5 / (c64::cis(*w) - 0.9);
/// let values = omega.iter().map(|w| Mat::from_fn(1, 1, |_, _| exact(w) * (1.0 + 1e-3 * (w * 1e4).sin()))).collect();
/// let table = ResponseTable { omega, values, variance: ResponseVariance::Unknown };
/// let response = MeasuredResponse::of_plant(&table, time)?;
/// let found = identify_response(&response, &RunningController::none(1, 1, time)?, None, &Default::default())?.model;
/// assert!(found.order == 1 && (found.plant.a()[(0, 0)] - 0.9).abs() < 1e-3);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn identify_response(
    response: &MeasuredResponse,
    controller: &RunningController,
    nominal: Option<&StateSpace<Discrete>>,
    options: &LikelihoodOptions,
) -> Result<Identified> {
    let k = (!controller.is_open_loop()).then_some(controller.system());
    let model = likelihood::recommend_from_response(response, k, options)?;
    let deviation = deviation(nominal, controller, &model);
    Ok(Identified { model, deviation })
}

/// Sample times and ports of everything that belongs to one loop.
fn check<'a>(
    records: impl Iterator<Item = &'a LoopRecord> + Clone,
    controller: &RunningController,
    nominal: Option<&StateSpace<Discrete>>,
) -> Result<()> {
    let Some(first) = records.clone().next() else { return Ok(()) };
    let (m, p, ts) = (first.inputs(), first.outputs(), first.time().ts());
    let k = controller.system();
    let systems = [("the controller", Some(k), (p, m)), ("the nominal model", nominal, (m, p))];
    for (name, system, (inputs, outputs)) in systems {
        let Some(system) = system else { continue };
        same_time(name, ts, system.time().ts())?;
        let counts = [("inputs", inputs, system.inputs()), ("outputs", outputs, system.outputs())];
        if let Some((side, expected, found)) = counts.into_iter().find(|(_, expected, found)| expected != found) {
            return Err(Error::Ports { what: format!("the number of {side} of {name}"), expected, found });
        }
    }
    records.clone().try_for_each(|r| same_time(&format!("record {}", r.name()), ts, r.time().ts()))
}

/// Largest relative difference of two statements of one sample time: rounding of a time column.
const SAME_TIME: f64 = 1e-3;

fn same_time(what: &str, left: f64, right: f64) -> Result<()> {
    match (right / left - 1.0).abs() > SAME_TIME {
        true => Err(Error::SampleTimeMismatch { what: what.into(), left, right }),
        false => Ok(()),
    }
}

/// The signals of a record in the terms of the controller; see [`LoopSignals`].
struct Signals {
    u: Mat<f64>,
    y: Mat<f64>,
    seen: Mat<f64>,
    explained: Mat<f64>,
    excitation: Option<Mat<f64>>,
    observer: bool,
}

impl Signals {
    fn new(r: &LoopRecord, controller: &RunningController) -> Result<Self> {
        let observer = controller.observer_law().is_some() && r.alpha().is_some();
        let (seen, explained, excitation) = match (observer, r.alpha()) {
            (true, Some(alpha)) => (block(&[&[r.u(), r.y()]]), r.u() - alpha, Some(alpha.to_owned())),
            _ => {
                let seen = r.reference().map_or_else(|| r.y().to_owned(), |reference| r.y() - reference);
                let explained = r.input_excitation().map_or_else(|| r.u().to_owned(), |d| r.u() - d);
                // Without feedback the inputs come from outside.
                let open = || controller.is_open_loop().then(|| r.u().to_owned());
                (seen, explained, r.excitation().or_else(open))
            }
        };
        Ok(Signals { u: r.u().to_owned(), y: without_known(r)?, seen, explained, excitation, observer })
    }

    fn view(&self) -> LoopSignals<'_> {
        let excitation = self.excitation.as_ref().map(|x| x.as_ref());
        LoopSignals {
            seen: self.seen.as_ref(),
            explained: self.explained.as_ref(),
            applied: self.u.as_ref(),
            excitation,
        }
    }
}

fn views(signals: &[Signals]) -> Vec<LoopSignals<'_>> {
    signals.iter().map(Signals::view).collect()
}

fn experiments(signals: &[Signals]) -> Vec<Experiment<'_>> {
    signals.iter().map(|s| Experiment::new(s.u.as_ref(), s.y.as_ref())).collect()
}

/// Outputs without their known errors, and without the disturbances of known shape that explain them best, least squares.
fn without_known(r: &LoopRecord) -> Result<Mat<f64>> {
    let y = r.output_errors().map_or_else(|| r.y().to_owned(), |errors| r.y() - errors);
    let Some(w) = r.disturbance() else { return Ok(y) };
    let found = least_squares("the disturbances of known shape", w, y.as_ref())?;
    Ok(y - w * found.x)
}

fn deviation(
    nominal: Option<&StateSpace<Discrete>>,
    controller: &RunningController,
    model: &Recommendation,
) -> Result<Deviation> {
    let sizes = model.region.channel_scales()?;
    let factors = loop_factors(nominal.unwrap_or(&model.plant), controller, &sizes)?;
    Deviation::new(factors, &model.plant)
}
