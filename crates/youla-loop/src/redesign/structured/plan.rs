//! The way from the running controller to a new one: the running gains, half way, the new gains, each with its margins and its
//! response to a step of the reference over fresh draws.

use super::margins::GridMargins;
use super::pid::{Notch, PidController, PidGains};
use super::proof::{Band, band};
use super::scenarios::{Grid, Scenario, Scenarios};
use crate::error::Result;
use rayon::prelude::*;
use std::f64::consts::TAU;
use youla::Mat;
use youla::control::{closed_loop, with_input_port};
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace, simulate};

/// Draws and instants of a step response. Chosen, not measured.
const DRAWS: usize = 60;
const INSTANTS: usize = 240;
/// Length of a step response against the time constant of the bandwidth. Chosen, not measured.
const LENGTH: f64 = 12.0;
/// The longest step response, samples.
const LONGEST: usize = 20_000;

/// One step of the way.
#[derive(Debug, Clone)]
pub struct PlannedStep {
    /// `running`, `half` or `new`.
    pub name: &'static str,
    /// Its gains, where it is a PID.
    pub controller: Option<PidController>,
    /// `u = K y`, positive feedback.
    pub system: StateSpace<Discrete>,
    /// Models at which its loop is unstable.
    pub unstable: usize,
    /// Peak of the sensitivity over the models at which it is stable.
    pub peak_sensitivity: Band,
    /// Phase margin, degrees.
    pub phase_margin: Band,
    /// Bandwidth, Hz.
    pub bandwidth: Band,
    /// Instants of the response to a unit step of the reference, seconds.
    pub seconds: Vec<f64>,
    /// y at these.
    pub response: Vec<Band>,
}

/// The steps, the running controller first; between the two the mean of their gains or, where the running
/// one is no PID, of the controllers; it is left out where it is unstable at a model.
pub(super) fn plan(
    grid: &Grid,
    fresh: &Scenarios,
    (running, of_running): (&StateSpace<Discrete>, Option<&PidController>),
    (new, of_new): (&StateSpace<Discrete>, &PidController),
) -> Result<Vec<PlannedStep>> {
    let half = of_running.map(|c| mean(c, of_new));
    let between = match &half {
        Some(c) => c.system(new.time())?,
        None => running.plus(new)?.map_output(&(faer::Scale(0.5) * eye(1))),
    };
    let slowest = fresh.judge(grid, &grid.any(new)?).into_iter().flatten().map(|m| m.bandwidth).collect();
    let length = LENGTH / (TAU * band(slowest)[1].max(1e-12) * grid.ts);
    let samples = (length as usize).clamp(INSTANTS, LONGEST);
    let steps =
        [("running", of_running.cloned(), running), ("half", half, &between), ("new", Some(of_new.clone()), new)]
            .map(|(name, controller, system)| step(grid, fresh, (name, controller, system), samples))
            .into_iter()
            .collect::<Result<Vec<_>>>()?;
    Ok(steps.into_iter().filter(|s| s.unstable == 0 || s.name != "half").collect())
}

fn step(
    grid: &Grid,
    fresh: &Scenarios,
    (name, controller, system): (&'static str, Option<PidController>, &StateSpace<Discrete>),
    samples: usize,
) -> Result<PlannedStep> {
    let stable = fresh.stable(system)?;
    let judged = fresh.judge(grid, &grid.any(system)?);
    let found: Vec<&GridMargins> = judged.iter().zip(&stable).filter_map(|(m, s)| m.as_ref().filter(|_| *s)).collect();
    let of = |pick: fn(&GridMargins) -> f64| band(found.iter().map(|m| pick(m)).collect());
    let tested = fresh.plants.iter().zip(&stable).filter(|(_, stable)| **stable).take(DRAWS);
    let plants: Vec<&Scenario> = tested.map(|(plant, _)| plant).collect();
    let responses: Vec<Vec<f64>> =
        plants.par_iter().map(|p| response(&p.plant, system, samples)).collect::<Result<_>>()?;
    let every = samples.div_ceil(INSTANTS);
    let at = |t: usize| band(responses.iter().map(|y| y[t]).collect());
    Ok(PlannedStep {
        name,
        controller,
        system: system.clone(),
        unstable: stable.len() - found.len(),
        peak_sensitivity: of(|m| m.peak_sensitivity),
        phase_margin: of(|m| m.phase),
        bandwidth: of(|m| m.bandwidth),
        seconds: (0..samples).step_by(every).map(|t| t as f64 * grid.ts).collect(),
        response: (0..samples).step_by(every).map(at).collect(),
    })
}

/// y after a unit step of the reference: the noise input of the loop is -r, its output y - r.
fn response(plant: &StateSpace<Discrete>, k: &StateSpace<Discrete>, samples: usize) -> Result<Vec<f64>> {
    let looped = closed_loop(plant, &with_input_port(k)?)?.part(1..2, 1..2);
    let start = vec![0.0; looped.order()];
    let y = simulate(&looped, Mat::from_fn(samples, 1, |_, _| -1.0).as_ref(), &start)?;
    Ok((0..samples).map(|t| 1.0 + y[(t, 0)]).collect())
}

/// Half way: the geometric mean of gains and filters, the mean where one is missing or has another sign; notches of half their depth in
/// decibels. In the geometric mean no gain is far from both of its neighbours.
fn mean(a: &PidController, b: &PidController) -> PidController {
    let middle = |pick: fn(&PidGains) -> f64| {
        let (a, b) = (pick(&a.gains), pick(&b.gains));
        if a * b > 0.0 { a.signum() * (a * b).sqrt() } else { 0.5 * (a + b) }
    };
    let gains = PidGains {
        discretisation: b.gains.discretisation,
        kp: middle(|g| g.kp),
        ki: middle(|g| g.ki),
        kd: middle(|g| g.kd),
        derivative_filter: match (a.gains.kd == 0.0, b.gains.kd == 0.0) {
            (true, _) => b.gains.derivative_filter,
            (_, true) => a.gains.derivative_filter,
            _ => middle(|g| g.derivative_filter),
        },
    };
    let notches = b.notches.iter().map(|n| Notch { depth: n.depth.sqrt(), ..*n }).collect();
    PidController { gains, notches, delay: b.delay }
}
