//! Redesign in a fixed structure: the gains of a PID with notches, as the machine computes it, or of one for each loop of a square machine.
//!
//! ```text
//! maximise    ki, or kp without an integral part      (of several loops the product) such that at every plant drawn from the whole region
//!             the whole is stable, and in each loop, the others being closed, peak sensitivity, gain, phase and delay margin and command effort keep their limits
//! ```
//!
//! The objective is the rejection of slow loads (K. J. Åström, H. Panagopoulos, T. Hägglund, Design of PI controllers based on non-convex
//! optimization, Automatica 34 (1998), 585; the same authors' MIGO design of PID controllers): after a step of load at the plant input the
//! integral of y is `load / ki`. A bandwidth has no use for an integral part where the plant has one of its own, and
//! would give it up. What the search found is proved on draws that it has not seen.

mod channels;
mod evolution;
mod loops;
mod margins;
mod options;
mod pid;
mod plan;
mod proof;
mod recognise;
mod reference;
mod scenarios;
mod search;
mod space;
#[cfg(test)]
mod tests;

pub use margins::GridMargins;
pub use options::{ControllerStructure, PidOptions, PidTerms};
pub use pid::{Discretisation, Notch, PidController, PidGains, diagonal};
pub use plan::PlannedStep;
pub use proof::{Band, FigureBand, LEVEL, PidProof};
pub use reference::ReferenceWeights;

use crate::error::{Error, Result};
use channels::{couples, each};
use margins::OnGrid;
use pid::whole;
use plan::plan;
use proof::prove;
use recognise::recognise;
use scenarios::{Grid, Judged, Scenario, Scenarios};
use search::Search;
use space::Space;
use youla::control::{closed_loop, with_input_port};
use youla::identify::likelihood::Region;
use youla::lti::{Discrete, StateSpace};
use youla::validate::BandOptions;

/// The input of a PID design.
#[derive(Debug, Clone)]
pub struct PidProblem<'a> {
    /// The identified plant with its region; of several operating points, all that the one controller must serve.
    pub points: Vec<(&'a StateSpace<Discrete>, &'a Region)>,
    /// The running controller, `u = K y`, positive feedback.
    pub running: &'a StateSpace<Discrete>,
    /// Dead time in whole samples that the machine adds to its controller; it is in `running` too.
    pub delay: usize,
    /// From the references to u, where that is another path than that of the error.
    pub reference: Option<StateSpace<Discrete>>,
    /// What speaks against the models or the stated controller, a sentence each.
    pub doubts: Vec<String>,
}

/// A PID, or one for each loop, with its proof.
#[derive(Debug, Clone)]
pub struct PidRedesign {
    /// The new controllers, negative feedback: that of input k acts on output k.
    pub controllers: Vec<PidController>,
    /// The same as `u = K y`, positive feedback.
    pub system: StateSpace<Discrete>,
    /// What was designed, within which limits.
    pub options: PidOptions,
    /// The running controller.
    pub running: StateSpace<Discrete>,
    /// Its gains, where each loop has a PID.
    pub running_gains: Option<Vec<PidController>>,
    /// How much better slow loads are rejected in each loop: the quotient of the gains of the new and the running controller at the lowest line.
    pub rejections: Vec<f64>,
    /// The proof on fresh draws; of several operating points that of the worst one.
    pub proof: PidProof,
    /// How the reference enters each loop; `None` where it is no PID with weights, and its step is not predicted.
    pub reference_weights: Option<Vec<ReferenceWeights>>,
    /// The way to the new controller.
    pub steps: Vec<PlannedStep>,
    /// What speaks against the models or the stated controller on which all this rests.
    pub doubts: Vec<String>,
}

impl PidRedesign {
    /// Why the new controller should not be taken; empty where it keeps what it promises.
    pub fn reservations(&self) -> Vec<String> {
        let p = &self.proof;
        let mut reasons = self.doubts.clone();
        if let Some(reason) = super::contradicted(p.impossible, p.models) {
            reasons.push(reason);
        } else if !p.holds() {
            reasons.push(format!(
                "of {} fresh models of the region {} are unstable and {} miss a limit",
                p.models, p.unstable, p.missed
            ));
        }
        if self.rejection() < 1.0 && p.running_holds() {
            reasons.push(format!(
                "it rejects slow loads {:.2} times as well as the running controller, which keeps the limits itself",
                self.rejection()
            ));
        }
        reasons
    }

    /// What the machine computes: `system` without the dead time that the machine adds.
    ///
    /// # Errors
    /// Those of [`PidController::system`].
    pub fn computed(&self) -> Result<StateSpace<Discrete>> {
        let without = |c: &PidController| PidController { delay: 0, ..c.clone() };
        Ok(whole(&self.controllers.iter().map(without).collect::<Vec<_>>(), self.system.time())?)
    }

    /// That of the loop in which slow loads gain least.
    pub fn rejection(&self) -> f64 {
        self.rejections.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Designs a PID for each loop of an identified machine with as many outputs as inputs.
///
/// # Errors
/// [`Error::NoPid`] with the limit that stops it; [`youla::Error::OutOfRange`] for options outside of their range;
/// [`youla::Error::Unsupported`] for a machine that is not square or whose running controller couples its loops;
/// [`youla::Error::NotStabilising`] where the running controller does not stabilise the plant.
pub fn design_pid(problem: &PidProblem<'_>, options: &PidOptions, band: &BandOptions) -> Result<PidRedesign> {
    options.check()?;
    let PidProblem { points, running, delay, reference, doubts } = problem;
    let (running, delay) = (*running, *delay);
    if let Some((what, instead)) = unsupported(problem)? {
        return Err(Error::Method(youla::Error::Unsupported { what, instead }));
    }
    let mut resonant = Vec::new();
    for (plant, _) in points {
        youla::control::peak_sensitivity(plant, running)?;
        resonant.extend([(*plant).clone(), closed_loop(plant, &with_input_port(running)?)?]);
    }
    let grid = Grid::new(running.time(), &resonant.iter().collect::<Vec<_>>())?;
    let on = grid.each(running)?;
    let ran = Judged { system: running, on: &on };
    let estimates: Option<Vec<Scenario>> =
        points.iter().map(|(plant, _)| Scenario::new(&grid, (*plant).clone(), ran, |_| {})).collect();
    let missing = || Error::NoPid { reason: "the running controller has no margins on the model".into() };
    let mut estimates = estimates.filter(|found| !found.is_empty()).ok_or_else(missing)?.into_iter();
    let estimate = estimates.next().ok_or_else(missing)?;
    let draws = |seed: u64| {
        let of = |(_, region): &(_, &Region)| Scenarios::new(&grid, region, ran, (band.draws, seed));
        points.iter().map(of).collect::<Result<Vec<_>>>()
    };
    // The plants of all points are one set, in which the search asks for the worst; the estimates of the other points are among them.
    let drawn = Scenarios::joined(draws(band.seed)?, estimates);
    let rules = match options.discretisation {
        Some(rule) => vec![rule],
        None => vec![Discretisation::BackwardEuler, Discretisation::Tustin],
    };
    let known = each(running)?.iter().map(|k| recognise(&grid, k, &rules, delay)).collect::<Result<Vec<_>>>()?;
    let space = |(known, c): (&Option<PidController>, &OnGrid)| {
        let discretisation = known.as_ref().map_or(rules[0], |c| c.gains.discretisation);
        // Of a gain, of an integral (phase -90 degrees) and of what lies between.
        let sign = if c.response[0].re - c.response[0].im >= 0.0 { 1.0 } else { -1.0 };
        Space { options, discretisation, delay, sign, ts: grid.ts }
    };
    let spaces = known.iter().zip(&on).map(space).collect();
    let search =
        Search { spaces, grid: &grid, estimate: &estimate, drawn: &drawn, running: ran, running_gains: &known };
    let controllers = search.run()?;
    let system = whole(&controllers, running.time())?;
    let new = Judged { system: &system, on: &grid.each(&system)? };
    let fresh = draws(band.seed.wrapping_add(1))?;
    let proofs = fresh.iter().map(|fresh| prove(&grid, fresh, &on, new, options));
    let worse = |a: &PidProof, b: &PidProof| a.unstable.cmp(&b.unstable).then(a.at_most.total_cmp(&b.at_most));
    let proof = proofs.collect::<Result<Vec<_>>>()?.into_iter().max_by(worse).ok_or_else(missing)?;
    let fresh = Scenarios::joined(fresh, std::iter::empty());
    let reference_weights = reference::weights(&grid, reference.as_ref(), &known)?;
    let running_gains: Option<Vec<PidController>> = known.into_iter().collect();
    let size = |c: &PidController| grid.controller(c).response[0].norm();
    Ok(PidRedesign {
        rejections: controllers.iter().zip(&on).map(|(new, ran)| size(new) / ran.response[0].norm()).collect(),
        proof,
        steps: plan(&grid, &fresh, reference_weights.as_deref(), (ran, running_gains.as_deref()), (new, &controllers))?,
        reference_weights,
        running: running.clone(),
        running_gains,
        options: options.clone(),
        controllers,
        system,
        doubts: doubts.clone(),
    })
}

/// What no PID is designed for, and what to do instead.
fn unsupported(problem: &PidProblem<'_>) -> Result<Option<(&'static str, &'static str)>> {
    let other = "leave `structure` out: method = \"lqg\" and \"youla\" design for any number";
    if problem.points.iter().any(|(plant, _)| plant.inputs() != plant.outputs()) {
        return Ok(Some(("a PID for each loop of a machine with more inputs than outputs, or fewer", other)));
    }
    if couples(problem.running)? {
        let what = "a PID for each loop where the running controller leads an output to the input of another loop";
        return Ok(Some((what, other)));
    }
    let what = "a PID for a machine that no controller ran";
    let state = "state the running controller in [controller]: its command effort is the measure of the new one";
    Ok(problem.running.is_zero().then_some((what, state)))
}
