//! Six closed loops u = K y + d with known truth, simulated, and what is known of them.
#![allow(dead_code)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::{RunningController, closed_loop, with_input_port};
use youla::identify::likelihood::{LikelihoodOptions, Recommendation};
use youla::linalg::block;
use youla::lti::{Continuous, Discrete, StateSpace, simulate};
use youla::signal::LoopRecord;
use youla::{Mat, Result};

pub(crate) const SAMPLES: usize = 6000;
/// A loop u = K y + d with the response of its noise to white noise, and five frequencies in Hz.
pub(crate) struct Loop {
    pub(crate) name: &'static str,
    pub(crate) plant: StateSpace<Discrete>,
    /// Dead time of the plant, samples.
    pub(crate) dead_time: usize,
    pub(crate) controller: StateSpace<Discrete>,
    noise: f64,
    /// n(t) = colour n(t-1) + e(t).
    colour: f64,
    pub(crate) hz: [f64; 5],
}

/// Modal masses side by side: frequencies in Hz, damping ratios, gains of each mode p x m (row by row).
pub(crate) fn modal(
    modes: &[(f64, f64, impl AsRef<[f64]>)],
    (outputs, inputs): (usize, usize),
    ts: f64,
) -> Result<StateSpace<Discrete>> {
    let n = 2 * modes.len();
    let mut a = Mat::zeros(n, n);
    // Each mode has its own input direction (first row of its gains) and its own output direction (first column).
    let (mut b, mut c) = (Mat::zeros(n, inputs), Mat::zeros(outputs, n));
    for (k, (hz, zeta, gains)) in modes.iter().enumerate() {
        let (w, gains) = (std::f64::consts::TAU * hz, gains.as_ref());
        (a[(2 * k, 2 * k + 1)], a[(2 * k + 1, 2 * k)], a[(2 * k + 1, 2 * k + 1)]) = (w, -w, -2.0 * zeta * w);
        (0..inputs).for_each(|j| b[(2 * k + 1, j)] = w * gains[j]);
        (0..outputs).for_each(|i| c[(i, 2 * k)] = gains[inputs + i]);
    }
    StateSpace::new(a, b, c, Mat::zeros(outputs, inputs), Continuous)?.zoh(Discrete::new(ts)?)
}

/// The same with a dead time of whole samples at its single input.
pub(crate) fn delayed(plant: &StateSpace<Discrete>, samples: usize) -> Result<StateSpace<Discrete>> {
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

/// -(kp + kd (1 - z^-1) + ki z^-1 / (1 - z^-1)) for each channel; without ki no state of an integral, which nothing would stabilise.
fn pid(channels: usize, [kp, ki, kd]: [f64; 3], ts: f64) -> Result<StateSpace<Discrete>> {
    let each = if ki == 0.0 { 1 } else { 2 };
    let n = each * channels;
    let mut a = Mat::zeros(n, n);
    let (mut b, mut c, mut d) = (Mat::zeros(n, channels), Mat::zeros(channels, n), Mat::zeros(channels, channels));
    for k in 0..channels {
        (b[(each * k, k)], c[(k, each * k)], d[(k, k)]) = (1.0, kd, -kp - kd);
        if ki != 0.0 {
            let sum = each * k + 1;
            (a[(sum, sum)], b[(sum, k)], c[(k, sum)]) = (1.0, 1.0, -ki);
        }
    }
    StateSpace::new(a, b, c, d, Discrete::new(ts)?)
}

/// Two states, one input and one output.
fn of_matrices(a: [[f64; 2]; 2], b: [f64; 2], c: [f64; 2], ts: f64) -> Result<StateSpace<Discrete>> {
    let (a, b, c) =
        (Mat::from_fn(2, 2, |i, j| a[i][j]), Mat::from_fn(2, 1, |i, _| b[i]), Mat::from_fn(1, 2, |_, j| c[j]));
    StateSpace::new(a, b, c, Mat::zeros(1, 1), Discrete::new(ts)?)
}

/// `(b0 + b1 z^-1) / (1 - p z^-1)`.
fn lead([b0, b1, p]: [f64; 3], ts: f64) -> Result<StateSpace<Discrete>> {
    let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
    StateSpace::new(number(p), number(1.0), number(b1 + p * b0), number(b0), Discrete::new(ts)?)
}

/// The observer-based controller of the loop with a zero outside of the circle, gains for its own plant.
fn observer(ts: f64) -> Result<StateSpace<Discrete>> {
    let nominal = of_matrices(
        [[0.932379, 0.0877712], [0.0192647, 1.0008857]],
        [9.65644e-4, 9.74475e-6],
        [-2.652058, 37.201457],
        ts,
    )?;
    let f = Mat::from_fn(1, 2, |_, j| [-63.524565, -320.817626][j]);
    let l = Mat::from_fn(2, 1, |i, _| [-0.001181792, -0.001172431][i]);
    Ok(RunningController::observer(&nominal, f, l)?.system().clone())
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
            controller: pid(1, [0.2, 0.01, 0.0], 1e-3)?,
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
        Loop {
            name: "servo with an integrator, lead",
            plant: of_matrices([[1.0, 2.493e-4], [0.0, 0.9945]], [9.3e-5, 0.743], [1.0, 0.0], 2.5e-4)?,
            dead_time: 0,
            controller: lead([-78.4, 77.24, 0.7158], 2.5e-4)?,
            noise: 4e-4,
            colour: 0.0,
            hz: [10.0, 30.0, 60.0, 120.0, 300.0],
        },
        Loop {
            name: "unstable, with a zero outside of the circle",
            plant: of_matrices(
                [[0.93238, 0.087771], [0.019265, 1.000886]],
                [9.6564e-4, 9.7447e-6],
                [-2.652, 37.2015],
                1e-3,
            )?,
            dead_time: 0,
            controller: observer(1e-3)?,
            noise: 5e-3,
            colour: 0.0,
            hz: [0.5, 2.0, 5.0, 15.0, 50.0],
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
        let kept = 2 * SAMPLES / 3;
        let record = |from: usize, rows: usize| -> Result<LoopRecord> {
            let [d, u, y] = [d, u, y].map(|signal| signal.subrows(from, rows).to_owned());
            LoopRecord::new(self.plant.time(), u, y)?.with_input_excitation(d)
        };
        let controller = RunningController::new(self.controller.clone());
        let (records, fresh) = ([record(0, kept)?], [record(kept, SAMPLES - kept)?]);
        Ok(youla::identify(&records, &fresh, &controller, None, options)?.model)
    }
}
