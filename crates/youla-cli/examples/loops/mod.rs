//! Four closed loops u = K y + d with known truth, simulated, and what is known of them.
#![allow(dead_code)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::{closed_loop, with_input_port};
use youla::identify::likelihood::{
    Experiment, LikelihoodOptions, LoopKnowledge, LoopSignals, Recommendation, recommend,
};
use youla::linalg::block;
use youla::lti::{Continuous, Discrete, StateSpace, simulate};
use youla::{Mat, Result};

pub(crate) const SAMPLES: usize = 6000;
/// A loop u = K y + d with the response of its noise to white noise, and five frequencies in Hz.
pub(crate) struct Loop {
    pub(crate) name: &'static str,
    pub(crate) plant: StateSpace<Discrete>,
    /// Dead time of the plant, samples.
    pub(crate) dead_time: usize,
    controller: StateSpace<Discrete>,
    noise: f64,
    /// n(t) = colour n(t-1) + e(t).
    colour: f64,
    pub(crate) hz: [f64; 5],
}

/// Modal masses side by side: frequencies in Hz, damping ratios, gains of each mode p x m (row by row).
fn modal(modes: &[(f64, f64, &[f64])], (outputs, inputs): (usize, usize), ts: f64) -> Result<StateSpace<Discrete>> {
    let n = 2 * modes.len();
    let mut a = Mat::zeros(n, n);
    // Each mode has its own input direction (first row of its gains) and its own output direction (first column).
    let (mut b, mut c) = (Mat::zeros(n, inputs), Mat::zeros(outputs, n));
    for (k, (hz, zeta, gains)) in modes.iter().enumerate() {
        let w = std::f64::consts::TAU * hz;
        (a[(2 * k, 2 * k + 1)], a[(2 * k + 1, 2 * k)], a[(2 * k + 1, 2 * k + 1)]) = (w, -w, -2.0 * zeta * w);
        (0..inputs).for_each(|j| b[(2 * k + 1, j)] = w * gains[j]);
        (0..outputs).for_each(|i| c[(i, 2 * k)] = gains[inputs + i]);
    }
    StateSpace::new(a, b, c, Mat::zeros(outputs, inputs), Continuous)?.zoh(Discrete::new(ts)?)
}

/// The same with a dead time of whole samples at its single input.
fn delayed(plant: &StateSpace<Discrete>, samples: usize) -> Result<StateSpace<Discrete>> {
    let n = plant.order();
    let a = Mat::from_fn(n + samples, n + samples, |i, j| match (i < n, j < n) {
        (true, true) => plant.a()[(i, j)],
        (true, false) if j == n => plant.b()[(i, 0)],
        (false, false) if j == i + 1 => 1.0,
        _ => 0.0,
    });
    let b = Mat::from_fn(n + samples, 1, |i, _| if i + 1 == n + samples { 1.0 } else { 0.0 });
    let c = Mat::from_fn(1, n + samples, |_, j| if j < n { plant.c()[(0, j)] } else { 0.0 });
    StateSpace::new(a, b, c, Mat::zeros(1, 1), plant.time())
}

/// -(kp + kd (1 - z^-1) + ki z^-1 / (1 - z^-1)) for each channel.
fn pid(channels: usize, [kp, ki, kd]: [f64; 3], ts: f64) -> Result<StateSpace<Discrete>> {
    let n = 2 * channels;
    let mut a = Mat::zeros(n, n);
    let (mut b, mut c, mut d) = (Mat::zeros(n, channels), Mat::zeros(channels, n), Mat::zeros(channels, channels));
    for k in 0..channels {
        (a[(2 * k, 2 * k)], b[(2 * k, k)], b[(2 * k + 1, k)]) = (1.0, 1.0, 1.0);
        (c[(k, 2 * k)], c[(k, 2 * k + 1)], d[(k, k)]) = (-ki, kd, -kp - kd);
    }
    StateSpace::new(a, b, c, d, Discrete::new(ts)?)
}

pub(crate) fn loops() -> Result<Vec<Loop>> {
    let siso = |ts| modal(&[(20.0, 0.02, &[1.0, 1.0]), (55.0, 0.01, &[0.5, 0.6])], (1, 1), ts);
    let levitation = |ts| {
        let a = Mat::from_fn(2, 2, |i, j| [[0.0, 1.0], [900.0, 0.0]][i][j]);
        let (b, c) = (Mat::from_fn(2, 1, |i, _| [0.0, 500.0][i]), Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]));
        StateSpace::new(a, b, c, Mat::zeros(1, 1), Continuous)?.zoh(Discrete::new(ts)?)
    };
    let rotor = |ts| modal(&[(80.0, 0.02, &[1.0, 0.2, 1.0, 0.1]), (130.0, 0.015, &[-0.1, 0.8, 0.2, 1.0])], (2, 2), ts);
    Ok(vec![
        Loop {
            name: "two modes under PD",
            plant: siso(1e-3)?,
            dead_time: 0,
            controller: pid(1, [0.2, 0.0, 1.0], 1e-3)?,
            noise: 0.3,
            colour: 0.0,
            hz: [4.0, 15.0, 25.0, 50.0, 80.0],
        },
        Loop {
            name: "levitation, unstable",
            plant: levitation(1e-3)?,
            dead_time: 0,
            controller: pid(1, [4.0, 0.0, 50.0], 1e-3)?,
            noise: 0.02,
            colour: 0.0,
            hz: [1.0, 3.0, 6.0, 12.0, 25.0],
        },
        Loop {
            name: "drive with dead time, PI, coloured noise",
            plant: delayed(&modal(&[(6.0, 0.5, &[1.0, 1.0]), (70.0, 0.015, &[0.3, 0.4])], (1, 1), 1e-3)?, 3)?,
            dead_time: 3,
            controller: pid(1, [0.3, 0.01, 0.0], 1e-3)?,
            noise: 0.05,
            colour: 0.9,
            hz: [1.0, 4.0, 10.0, 40.0, 75.0],
        },
        Loop {
            name: "rotor, 2 x 2, under PD",
            plant: rotor(5e-4)?,
            dead_time: 0,
            controller: pid(2, [0.1, 0.0, 0.8], 5e-4)?,
            noise: 0.2,
            colour: 0.0,
            hz: [20.0, 60.0, 90.0, 120.0, 200.0],
        },
    ])
}

impl Loop {
    /// Excitation d, input u and output y.
    pub(crate) fn record(&self, seed: u64) -> Result<[Mat<f64>; 3]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (m, p) = (self.plant.inputs(), self.plant.outputs());
        let mut d = Mat::zeros(SAMPLES, m);
        for j in 0..m {
            let (mut level, mut left) = (1.0, 0);
            for t in 0..SAMPLES {
                if left == 0 {
                    (level, left) = (if rng.random::<bool>() { 1.0 } else { -1.0 }, rng.random_range(1..12));
                }
                left -= 1;
                d[(t, j)] = level;
            }
        }
        let mut n = Mat::from_fn(SAMPLES, p, |_, _| self.noise * rng.sample::<f64, _>(StandardNormal));
        for t in 1..SAMPLES {
            (0..p).for_each(|i| n[(t, i)] += self.colour * n[(t - 1, i)]);
        }
        let rig = closed_loop(&self.plant, &with_input_port(&self.controller)?)?;
        let log = simulate(&rig, block(&[&[d.as_ref(), n.as_ref()]]).as_ref(), &vec![0.0; rig.order()])?;
        let (u, y) = (log.subcols(0, m).to_owned(), log.subcols(m, p).to_owned());
        Ok([d, u, y])
    }

    /// The model that is recommended for two thirds of a record, the rest kept for its verification.
    pub(crate) fn recommended(&self, [d, u, y]: &[Mat<f64>; 3], options: &LikelihoodOptions) -> Result<Recommendation> {
        let own = u - d;
        let signals = |from: usize, rows: usize| LoopSignals {
            seen: y.subrows(from, rows),
            explained: own.subrows(from, rows),
            excitation: Some(d.subrows(from, rows)),
        };
        let kept = 2 * SAMPLES / 3;
        let record = |from: usize, rows: usize| Experiment::new(u.subrows(from, rows), y.subrows(from, rows));
        let rest = SAMPLES - kept;
        let known = LoopKnowledge::new(Some(&self.controller), vec![signals(0, kept)], vec![signals(kept, rest)])?;
        recommend(&[record(0, kept)], &[record(kept, rest)], Some(&known), self.plant.time(), options)
    }
}
