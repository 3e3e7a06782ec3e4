//! Plants under their controllers, with random parameters: flexible modes, a drive with an integrator, levitation, 2 x 2, dead time.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use youla::control::{closed_loop, with_input_port};
use youla::lti::{Continuous, Discrete, StateSpace};
use youla::{Mat, Result};

/// A plant under `u = K (y - r) + d`.
pub(crate) struct Machine {
    pub(crate) plant: StateSpace<Discrete>,
    pub(crate) controller: StateSpace<Discrete>,
    /// Dead time of the plant in samples, beside the one of the hold.
    pub(crate) dead_time: usize,
}

/// The first five are those of the clean logs and of the planted defects, all are those of the other logs.
pub(crate) const KINDS: usize = 5;
pub(crate) const ALL_KINDS: usize = 8;
const NAMES: [&str; ALL_KINDS] = [
    "flexible modes",
    "drive with integrator",
    "levitation",
    "2 x 2",
    "dead time",
    "long dead time",
    "drive with dead time",
    "tank",
];

pub(crate) fn name(kind: usize) -> &'static str {
    NAMES[kind % ALL_KINDS]
}

/// The first stable loop of random parameters.
pub(crate) fn machine(kind: usize, hold: usize, rng: &mut ChaCha8Rng) -> Result<Machine> {
    loop {
        let ts = 1.0 / [500.0, 1000.0, 2000.0, 5000.0][rng.random_range(0..4)];
        let dead_time = match kind {
            4 => rng.random_range(1..7),
            5 => rng.random_range(8..40),
            6 => rng.random_range(1..5),
            7 => rng.random_range(0..20),
            _ => 0,
        };
        let machine = match kind {
            1 | 6 => drive(rng, ts, dead_time)?,
            2 => levitation(rng, ts)?,
            3 => rotor(rng, ts)?,
            5 => slow(rng, ts, dead_time)?,
            7 => tank(rng, ts, dead_time)?,
            _ => flexible(rng, ts, dead_time)?,
        };
        let machine = if hold > 1 { slower(machine, hold) } else { machine };
        let rig = closed_loop(&every(&machine.plant, hold)?, &with_input_port(&machine.controller)?)?;
        if rig.worst_pole()?.is_some_and(|pole| pole.norm() < 0.998) {
            return Ok(machine);
        }
    }
}

/// The controller for every few samples: the difference of its error grows with the time between them.
fn slower(machine: Machine, hold: usize) -> Machine {
    let outputs = machine.controller.outputs();
    let less = Mat::from_fn(outputs, outputs, |i, j| if i == j { 1.0 / hold as f64 } else { 0.0 });
    Machine { controller: machine.controller.map_output(&less), ..machine }
}

/// A plant whose input is held for so many samples.
fn every(plant: &StateSpace<Discrete>, hold: usize) -> Result<StateSpace<Discrete>> {
    let (mut a, mut b) = (plant.a().to_owned(), plant.b().to_owned());
    for _ in 1..hold {
        (a, b) = (plant.a() * &a, plant.a() * &b + plant.b());
    }
    StateSpace::new(a, b, plant.c().to_owned(), plant.d().to_owned(), plant.time())
}

fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// Uniform in its logarithm.
fn spread(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    uniform(rng, low.ln(), high.ln()).exp()
}

/// Modes side by side: angular frequency, damping ratio, gains from the inputs, gains to the outputs.
fn modal(modes: &[(f64, f64, Vec<f64>, Vec<f64>)], ts: f64) -> Result<StateSpace<Discrete>> {
    let (n, m, p) = (2 * modes.len(), modes[0].2.len(), modes[0].3.len());
    let (mut a, mut b, mut c) = (Mat::zeros(n, n), Mat::zeros(n, m), Mat::zeros(p, n));
    for (k, (w, zeta, from, to)) in modes.iter().enumerate() {
        (a[(2 * k, 2 * k + 1)], a[(2 * k + 1, 2 * k)], a[(2 * k + 1, 2 * k + 1)]) = (*w, -w, -2.0 * zeta * w);
        (0..m).for_each(|j| b[(2 * k + 1, j)] = w * from[j]);
        (0..p).for_each(|i| c[(i, 2 * k)] = to[i]);
    }
    StateSpace::new(a, b, c, Mat::zeros(p, m), Continuous)?.zoh(Discrete::new(ts)?)
}

/// `u = -(kp e + ki sum e + kd (e - e before))` for each channel.
fn pid(channels: usize, [kp, ki, kd]: [f64; 3], ts: f64) -> Result<StateSpace<Discrete>> {
    let n = 2 * channels;
    let (mut a, mut b) = (Mat::zeros(n, n), Mat::zeros(n, channels));
    let (mut c, mut d) = (Mat::zeros(channels, n), Mat::zeros(channels, channels));
    for k in 0..channels {
        (a[(2 * k, 2 * k)], b[(2 * k, k)], b[(2 * k + 1, k)]) = (1.0, 1.0, 1.0);
        (c[(k, 2 * k)], c[(k, 2 * k + 1)], d[(k, k)]) = (-ki, kd, -kp - kd - ki);
    }
    StateSpace::new(a, b, c, d, Discrete::new(ts)?)
}

fn delayed(plant: &StateSpace<Discrete>, samples: usize) -> Result<StateSpace<Discrete>> {
    let one = Mat::from_fn(1, 1, |_, _| 1.0);
    let zero = || Mat::zeros(1, 1);
    let shift = StateSpace::new(zero(), one.clone(), one, zero(), plant.time())?;
    (0..samples).try_fold(plant.clone(), |plant, _| shift.then(&plant))
}

fn flexible(rng: &mut ChaCha8Rng, ts: f64, dead_time: usize) -> Result<Machine> {
    let gain = spread(rng, 0.1, 30.0);
    let first = TAU * spread(rng, 0.01, 0.08) / ts;
    let mut modes = vec![(first, spread(rng, 0.004, 0.1), vec![gain], vec![1.0])];
    for k in 0..rng.random_range(0..3) {
        let w = first * (uniform(rng, 1.4, 2.2) + 1.2 * f64::from(k));
        modes.push((w, spread(rng, 0.004, 0.1), vec![gain], vec![uniform(rng, -0.6, 0.8)]));
    }
    let wt = first * ts;
    let gains = [uniform(rng, 0.0, 0.3), uniform(rng, 0.02, 0.3) * wt, uniform(rng, 0.05, 0.5) / wt].map(|k| k / gain);
    let plant = delayed(&modal(&modes, ts)?, dead_time)?;
    Ok(Machine { plant, controller: pid(1, gains, ts)?, dead_time })
}

fn drive(rng: &mut ChaCha8Rng, ts: f64, dead_time: usize) -> Result<Machine> {
    let time = Discrete::new(ts)?;
    let w = TAU * spread(rng, 0.015, 0.08) / ts;
    let (gain, friction) = (spread(rng, 10.0, 1e4), w * uniform(rng, 0.001, 0.05));
    let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [0.0, -friction]][i][j]);
    let (b, c) = (Mat::from_fn(2, 1, |i, _| [0.0, gain][i]), Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]));
    let rigid = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(time)?;
    let size = gain / (w * w) * uniform(rng, -0.6, 1.0);
    let plant = rigid.plus(&modal(&[(w, spread(rng, 0.005, 0.06), vec![size], vec![1.0])], ts)?)?;
    let wc = w / uniform(rng, 4.0, 12.0);
    let integral = if rng.random() { wc * ts / 15.0 } else { 0.0 };
    let kp = wc * wc / gain * 0.5;
    let plant = delayed(&plant, dead_time)?;
    Ok(Machine { plant, controller: pid(1, [kp, kp * integral, 2.0 * kp / (wc * ts)], ts)?, dead_time })
}

fn levitation(rng: &mut ChaCha8Rng, ts: f64) -> Result<Machine> {
    let pole = TAU * spread(rng, 0.003, 0.015) / ts;
    let gain = spread(rng, 1.0, 100.0);
    let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [pole * pole, 0.0]][i][j]);
    let (b, c) = (Mat::from_fn(2, 1, |i, _| [0.0, gain * pole * pole][i]), Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]));
    let plant = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(Discrete::new(ts)?)?;
    let kp = uniform(rng, 1.6, 4.0) / gain;
    let gains = [kp, if rng.random() { 0.01 * kp * pole * ts } else { 0.0 }, uniform(rng, 1.0, 2.0) * kp / (pole * ts)];
    Ok(Machine { plant, controller: pid(1, gains, ts)?, dead_time: 0 })
}

fn rotor(rng: &mut ChaCha8Rng, ts: f64) -> Result<Machine> {
    let w = TAU * spread(rng, 0.015, 0.06) / ts;
    let other = w * uniform(rng, 1.3, 2.0);
    let mut side = || uniform(rng, -0.3, 0.3);
    let first = (w, 0.02, vec![1.0, side()], vec![1.0, side()]);
    let second = (other, 0.015, vec![side(), 1.0], vec![side(), 1.0]);
    let wt = w * ts;
    let gains = [uniform(rng, 0.05, 0.2), uniform(rng, 0.01, 0.1) * wt, uniform(rng, 0.1, 0.4) / wt];
    Ok(Machine { plant: modal(&[first, second], ts)?, controller: pid(2, gains, ts)?, dead_time: 0 })
}

/// Two lags and a dead time, under PI.
fn slow(rng: &mut ChaCha8Rng, ts: f64, dead_time: usize) -> Result<Machine> {
    let gain = spread(rng, 0.1, 30.0);
    let (first, second) = (spread(rng, 0.003, 0.03) / ts, spread(rng, 0.03, 0.3) / ts);
    let a = Mat::from_fn(2, 2, |i, j| [[-first, first], [0.0, -second]][i][j]);
    let (b, c) = (Mat::from_fn(2, 1, |i, _| [0.0, gain * second][i]), Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]));
    let plant = StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(Discrete::new(ts)?)?;
    let kp = uniform(rng, 0.3, 0.8) / (gain * first * ts * (dead_time as f64 + 1.0 / (second * ts) + 1.0));
    Ok(Machine { plant: delayed(&plant, dead_time)?, controller: pid(1, [kp, kp * first * ts, 0.0], ts)?, dead_time })
}

/// An integrator and a dead time, under P or PI.
fn tank(rng: &mut ChaCha8Rng, ts: f64, dead_time: usize) -> Result<Machine> {
    let gain = spread(rng, 0.01, 1.0);
    let one = |v: f64| Mat::from_fn(1, 1, |_, _| v);
    let plant = StateSpace::new(one(1.0), one(gain), one(1.0), one(0.0), Discrete::new(ts)?)?;
    let kp = uniform(rng, 0.1, 0.4) / (gain * (dead_time as f64 + 2.0));
    let ki = if rng.random() { 0.05 * kp / (dead_time as f64 + 2.0) } else { 0.0 };
    Ok(Machine { plant: delayed(&plant, dead_time)?, controller: pid(1, [kp, ki, 0.0], ts)?, dead_time })
}
