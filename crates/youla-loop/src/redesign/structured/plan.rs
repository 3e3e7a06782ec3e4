//! The way from the running controller to a new one: the running gains, half way, the new gains, each with its margins and its
//! response to a step of the reference over fresh draws.

use super::margins::GridMargins;
use super::pid::{Notch, PidController, PidGains, whole};
use super::proof::{Band, band};
use super::reference::ReferenceWeights;
use super::scenarios::{Grid, Judged, Scenario, Scenarios};
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

/// Overshoot that a step of the filtered reference has at most. Chosen: that of a second-order system with a damping ratio of 0.6.
const OVERSHOOT: f64 = 0.1;

/// One step of the way.
#[derive(Debug, Clone)]
pub struct PlannedStep {
    /// `running`, `half` or `new`.
    pub name: &'static str,
    /// The gains of each loop, where all are PIDs.
    pub controllers: Option<Vec<PidController>>,
    /// `u = K y`, positive feedback.
    pub system: StateSpace<Discrete>,
    /// Models at which its loop is unstable.
    pub unstable: usize,
    /// Peak of the sensitivity over the models at which it is stable; of several loops, here and below, that of the worst.
    pub peak_sensitivity: Band,
    /// Phase margin, degrees.
    pub phase_margin: Band,
    /// Bandwidth, Hz.
    pub bandwidth: Band,
    /// Instants of the responses to a unit step of the reference, seconds; none, with those and what follows from them, where it is not predicted.
    pub seconds: Vec<f64>,
    /// y of each loop at these, after a step of its own reference.
    pub responses: Vec<Vec<Band>>,
    /// u of each loop at these, after the same step.
    pub commands: Vec<Vec<Band>>,
    /// Overshoot of each loop, upper end of its band, as a share of the step; zero for none.
    pub overshoots: Vec<f64>,
    /// Time constant of a filter of each reference, seconds, behind which it is 10 % at most; zero where it is so without one.
    pub reference_filters: Vec<f64>,
}

/// The steps, given how the reference enters each loop, the running controller first; between the two the mean of their gains or, where the running
/// one is no PID, of the controllers; it is left out where it is unstable at a model.
pub(super) fn plan(
    grid: &Grid,
    fresh: &Scenarios,
    weights: Option<&[ReferenceWeights]>,
    (running, of_running): (Judged<'_>, Option<&[PidController]>),
    (new, of_new): (Judged<'_>, &[PidController]),
) -> Result<Vec<PlannedStep>> {
    let half = of_running.map(|of| of.iter().zip(of_new).map(|(a, b)| mean(a, b)).collect::<Vec<_>>());
    let between = match &half {
        Some(of) => whole(of, new.system.time())?,
        None => running.system.plus(new.system)?.map_output(&(faer::Scale(0.5) * eye(of_new.len()))),
    };
    let between = Judged { system: &between, on: &grid.each(&between)? };
    let slowest = fresh.judge(grid, new.on).into_iter().flatten().map(|of| GridMargins::worst(&of).bandwidth).collect();
    let length = LENGTH / (TAU * band(slowest)[1].max(1e-12) * grid.ts);
    let samples = (length as usize).clamp(INSTANTS, LONGEST);
    let steps = [
        ("running", of_running.map(<[_]>::to_vec), running),
        ("half", half, between),
        ("new", Some(of_new.to_vec()), new),
    ]
    .map(|(name, controllers, judged)| step(grid, fresh, weights, (name, controllers, judged), samples))
    .into_iter()
    .collect::<Result<Vec<_>>>()?;
    Ok(steps.into_iter().filter(|s| s.unstable == 0 || s.name != "half").collect())
}

fn step(
    grid: &Grid,
    fresh: &Scenarios,
    weights: Option<&[ReferenceWeights]>,
    (name, controllers, Judged { system, on }): (&'static str, Option<Vec<PidController>>, Judged<'_>),
    samples: usize,
) -> Result<PlannedStep> {
    let stable = fresh.stable(system)?;
    let judged = fresh.judge(grid, on).into_iter().zip(&stable).filter_map(|(of, stable)| of.filter(|_| *stable));
    let found: Vec<GridMargins> = judged.map(|of| GridMargins::worst(&of)).collect();
    let of = |pick: fn(&GridMargins) -> f64| band(found.iter().map(pick).collect());
    let tested = fresh.plants.iter().zip(&stable).filter(|(_, stable)| **stable).take(DRAWS);
    let plants: Vec<&Scenario> = tested.map(|(plant, _)| plant).collect();
    let every = samples.div_ceil(INSTANTS);
    let added = |(i, weights): (usize, &ReferenceWeights)| match &controllers {
        Some(of) => weights.added(&of[i], samples, system.time()),
        None => Ok(vec![0.0; samples]),
    };
    let added = weights.into_iter().flatten().enumerate().map(added).collect::<Result<Vec<_>>>()?;
    let of_loop = |(i, added): (usize, &Vec<f64>)| {
        plants.par_iter().map(|p| response(&p.plant, system, i, added)).collect::<Result<Vec<_>>>()
    };
    let of_loops = added.iter().enumerate().map(of_loop).collect::<Result<Vec<_>>>()?.into_iter();
    let (all, commands): (Vec<_>, Vec<_>) = of_loops.map(|of| of.into_iter().unzip::<_, _, Vec<_>, Vec<_>>()).unzip();
    let bands = |of: &Vec<Vec<f64>>| {
        (0..samples).step_by(every).map(|t| band(of.iter().map(|y| y[t]).collect())).collect::<Vec<Band>>()
    };
    Ok(PlannedStep {
        name,
        controllers,
        system: system.clone(),
        unstable: stable.len() - found.len(),
        peak_sensitivity: of(|m| m.peak_sensitivity),
        phase_margin: of(|m| m.phase),
        bandwidth: of(|m| m.bandwidth),
        seconds: (0..samples).step_by(every).map(|t| t as f64 * grid.ts).filter(|_| weights.is_some()).collect(),
        responses: all.iter().map(bands).collect(),
        commands: commands.iter().map(bands).collect(),
        overshoots: all.iter().map(|of| overshoot(of, 0.0)).collect(),
        reference_filters: all.iter().map(|of| grid.ts * reference_filter(of)).collect(),
    })
}

/// Upper end of the band of the overshoots behind the filter `w += (r - w) / (1 + lag)` of the reference, which commutes with the loop.
fn overshoot(responses: &[Vec<f64>], lag: f64) -> f64 {
    let highest = |y: &Vec<f64>| {
        let mut w = 0.0;
        y.iter().fold(1.0, |most: f64, y| {
            w += (y - w) / (1.0 + lag);
            most.max(w)
        })
    };
    band(responses.iter().map(highest).collect())[2] - 1.0
}

/// The least time constant, in samples and to 1 %, behind which a step overshoots by [`OVERSHOOT`] at most.
fn reference_filter(responses: &[Vec<f64>]) -> f64 {
    let longest = responses.first().map_or(0, Vec::len) as f64;
    if responses.is_empty() || overshoot(responses, 0.0) <= OVERSHOOT {
        return 0.0;
    }
    let (mut low, mut high) = (0.01, longest);
    while high > 1.01 * low {
        let middle = (low * high).sqrt();
        if overshoot(responses, middle) > OVERSHOOT { low = middle } else { high = middle }
    }
    high
}

/// y and u of a loop after a unit step of its reference: the noise input of the loop is -r, its output y - r; `added` comes to u beside what the
/// controller makes of the error.
fn response(
    plant: &StateSpace<Discrete>,
    k: &StateSpace<Discrete>,
    i: usize,
    added: &[f64],
) -> Result<(Vec<f64>, Vec<f64>)> {
    let port = plant.inputs() + i;
    let looped = closed_loop(plant, &with_input_port(k)?)?;
    let of = |t: usize, j: usize| {
        if j == port {
            -1.0
        } else if j == i {
            added[t]
        } else {
            0.0
        }
    };
    let driven = Mat::from_fn(added.len(), looped.inputs(), of);
    let y = simulate(&looped, driven.as_ref(), &vec![0.0; looped.order()])?;
    Ok((0..added.len()).map(|t| (1.0 + y[(t, port)], y[(t, i)])).unzip())
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
