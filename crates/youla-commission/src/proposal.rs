//! From a record to a switch that can be answered for: model, verdict, new controller, certificate, prediction.

use crate::campaign::Goal;
use crate::error::refuse;
use crate::figures::{LoopState, Sizes, least_damping};
use crate::identify::{CleanRows, identified, loop_response};
use crate::parameter::{NewLoop, parameter_of};
use crate::rehearse::{DampingPrediction, predict};
use crate::{Error, Result};
use youla::identify::likelihood::Recommendation;
use youla_loop::redesign::{
    DeviationRegion, Redesign, RedesignOptions, RedesignProblem, disturbance_response, redesign,
};
use youla_run::{Identification, ModeEntry, shown_modes};
use youla_twin::RunningLoop;

/// What a record gives.
pub(crate) struct Proposal {
    pub(crate) found: Identification,
    pub(crate) before: LoopState,
    pub(crate) sizes: (Vec<f64>, Vec<f64>),
    pub(crate) new: NewLoop,
    pub(crate) prediction: DampingPrediction,
    pub(crate) modes: Vec<ModeEntry>,
    /// Largest departure of S within its region, over frequency.
    pub(crate) region: Option<f64>,
}

/// A proposal, or the reason why there is none.
pub(crate) enum Outcome {
    Proposed(Box<Proposal>),
    Refused { reason: String, found: Option<Box<Identification>> },
}

/// Identifies and designs.
///
/// # Errors
/// Files; all else is a reason to refuse.
pub(crate) fn propose(running: &RunningLoop, rows: &CleanRows, name: &str, goal: &Goal) -> Result<Outcome> {
    let found = match refusable(identified(running, rows, name))? {
        Ok(found) => found,
        Err(reason) => return Ok(Outcome::Refused { reason, found: None }),
    };
    match refusable(designed(running, rows, &found, goal))? {
        Ok(parts) => {
            let sizes = found.records.sizes();
            let (before, new, prediction) = parts;
            let modes = found.recommended.as_ref().map_or_else(|_| Vec::new(), shown_modes);
            let region = region(running, &found)?;
            Ok(Outcome::Proposed(Box::new(Proposal { found, before, sizes, new, prediction, modes, region })))
        }
        Err(reason) => Ok(Outcome::Refused { reason, found: Some(Box::new(found)) }),
    }
}

/// What makes a proposal impossible, as a sentence: all but files.
fn refusable<T>(outcome: Result<T>) -> Result<Result<T, String>> {
    match outcome {
        Err(e @ (Error::File(_) | Error::Campaign { .. })) => Err(e),
        Err(e) => Ok(Err(e.to_string())),
        Ok(value) => Ok(Ok(value)),
    }
}

fn region(running: &RunningLoop, found: &Identification) -> Result<Option<f64>> {
    let Ok(model) = &found.recommended else { return Ok(None) };
    let deviations = DeviationRegion { factors: &running.factors, plant: &model.plant, region: &model.region };
    Ok(Some(deviations.radius()?))
}

fn designed(
    running: &RunningLoop,
    rows: &CleanRows,
    found: &Identification,
    goal: &Goal,
) -> Result<(LoopState, NewLoop, DampingPrediction)> {
    let model = match &found.recommended {
        Ok(model) if model.trusted() => model,
        Ok(model) => return refuse(format!("the model is not trusted: {}", model.reasons().join("; "))),
        Err(e) => return refuse(format!("there is no recommended model: {e}")),
    };
    let (input, output) = found.records.sizes();
    let sizes = Sizes { input: &input, output: &output };
    let measured = loop_response(running, None, rows)?;
    let before = LoopState::new(&measured, &running.factors.controller()?, sizes)?;
    let new = new_loop(running, model, sizes, goal.damping * before.damping)?;
    let prediction = predict(running, model, &new, rows, sizes)?;
    let relative = prediction.deviation / prediction.damping;
    if relative.is_nan() || relative > goal.deviation {
        return refuse(format!(
            "the relative standard deviation of the predicted damping is {relative:.3}, above the goal of {}",
            goal.deviation
        ));
    }
    Ok((before, new, prediction))
}

/// The controller of the smallest input weight, and so of the most damping, that keeps every limit, stabilises every model within the
/// region of S and can be loaded as Q.
fn new_loop(running: &RunningLoop, model: &Recommendation, sizes: Sizes<'_>, wanted: f64) -> Result<NewLoop> {
    let problem = RedesignProblem {
        plant: &model.plant,
        model: &model.plant,
        factors: &running.factors,
        region: Some(&model.region),
        input_size: sizes.input,
        output_size: sizes.output,
        delay: 0,
    };
    let mut weights = RedesignOptions::default().input_weights;
    weights.sort_by(f64::total_cmp);
    let mut reasons = Vec::new();
    for weight in weights {
        let options = RedesignOptions { input_weights: vec![weight], ..RedesignOptions::default() };
        let candidate = redesign(&problem, &options).map_err(Error::from).and_then(|new| loaded(running, new));
        let reason = match refusable(candidate)? {
            Ok(new) => {
                let response = disturbance_response(&model.plant, &new.controller)?.in_units(sizes.input, sizes.output);
                let damping = least_damping(&response)?;
                if damping >= wanted {
                    return Ok(new);
                }
                format!("the predicted damping {damping:.3} is below {wanted:.3}")
            }
            Err(reason) => reason,
        };
        reasons.push(format!("weight {weight}: {reason}"));
    }
    refuse(format!("no new controller meets the goal ({})", reasons.join("; ")))
}

fn loaded(running: &RunningLoop, new: Redesign) -> Result<NewLoop> {
    let Some(band) = new.band.filter(|band| band.holds()) else {
        return refuse("there is no certificate over the region of S".into());
    };
    let damping = new.intervals.and_then(|intervals| intervals.least_damping);
    let controller = new.controller.system;
    if !controller.is_stable()? {
        return refuse("the new controller is unstable itself".into());
    }
    let q = parameter_of(running, &controller)?;
    let damping_deviation = damping.map_or(f64::INFINITY, |interval| interval.deviation);
    Ok(NewLoop { controller, q, models: band.within, worst_pole: band.worst_within, damping_deviation })
}
