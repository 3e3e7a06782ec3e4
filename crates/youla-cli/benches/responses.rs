//! Measured responses: `cargo bench --workspace --bench responses`.
//!
//! - lines of a periodic excitation with their covariance from 1e6 samples of two inputs and two outputs;
//! - the same samples by local polynomials and by Welch's method;
//! - the recommended model of a table of 500 frequencies, one and two inputs and outputs, order and dead time chosen.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)]

mod timing;

use faer::{Mat, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;
use timing::median;
use youla::control::RunningController;
use youla::identify::identify_response;
use youla::identify::likelihood::{MeasuredResponse, ResponseTable, ResponseVariance};
use youla::lti::Discrete;
use youla::signal::{ExcitedRecord, PeriodicExperiment, Welch, indirect_response, line_response, local_response};

const SAMPLES: usize = 1_000_000;
const PERIOD: usize = 10_000;

fn main() {
    let time = Discrete::new(1e-3).unwrap();
    let (d, z) = record();
    let experiment = [PeriodicExperiment { d: d.as_ref(), z: z.as_ref() }];
    println!("lines of 1e6 samples x 4: {:.3} s", median(|| line_response(&experiment, time).unwrap()));
    let local = || local_response(&experiment, time, 1000).unwrap();
    println!("local polynomials over 1000 lines: {:.3} s", median(local));
    let excited = [ExcitedRecord { d: d.as_ref(), u: z.subcols(0, 2), y: z.subcols(2, 2) }];
    println!("Welch: {:.3} s", median(|| indirect_response(&excited, time, &Welch::default()).unwrap()));
    for channels in [1, 2] {
        let response = MeasuredResponse::of_plant(&table(channels), time).unwrap();
        let open = RunningController::none(channels, channels, time).unwrap();
        let found = || identify_response(&response, &open, None, &Default::default()).unwrap().model;
        let order = found().order;
        println!("model of 500 frequencies, {channels} x {channels}: order {order}, {:.3} s", median(found));
    }
}

/// Each input has 400 lines of its own; `y+ = 0.9 y + 0.1 u` with noise.
fn record() -> (Mat<f64>, Mat<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let phases: Vec<f64> = (0..800).map(|_| TAU * rng.random::<f64>()).collect();
    let sine = |t: usize, l: usize| (TAU * ((l + 1) * t % PERIOD) as f64 / PERIOD as f64 + phases[l]).cos();
    let period = Mat::from_fn(PERIOD, 2, |t, j| 0.05 * (j..800).step_by(2).map(|l| sine(t, l)).sum::<f64>());
    let d = Mat::from_fn(SAMPLES, 2, |t, j| period[(t % PERIOD, j)]);
    let (mut y, mut z) = ([0.0; 2], Mat::zeros(SAMPLES, 4));
    for t in 0..SAMPLES {
        for j in 0..2 {
            let measured = y[j] + 0.1 * rng.sample::<f64, _>(StandardNormal);
            (z[(t, j)], z[(t, 2 + j)]) = (d[(t, j)] - 0.5 * measured, measured);
            y[j] = 0.9 * y[j] + 0.1 * z[(t, j)];
        }
    }
    (d, z)
}

/// Ten modes in each entry, errors of 1 % stated.
fn table(channels: usize) -> ResponseTable {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let omega: Vec<f64> = (0..500).map(|k| TAU * 2.0 * 200.0_f64.powf(f64::from(k) / 499.0)).collect();
    let mut normal = || -> f64 { rng.sample(StandardNormal) };
    let modes: Vec<(c64, Vec<c64>, Vec<c64>)> = (0..5)
        .map(|k| {
            let w = TAU * 4.0 * 2.5_f64.powi(k) * 1e-3;
            let mut shape = || (0..channels).map(|_| c64::new(normal(), normal())).collect::<Vec<_>>();
            (c64::cis(w) * (-0.02 * w).exp(), shape(), shape())
        })
        .collect();
    let entry = |w: f64, i: usize, j: usize| -> c64 {
        let z = c64::cis(w * 1e-3);
        let pair =
            |(p, b, c): &(c64, Vec<c64>, Vec<c64>)| c[i] * b[j] / (z - *p) + (c[i] * b[j]).conj() / (z - p.conj());
        modes.iter().map(pair).sum()
    };
    let exact: Vec<Mat<c64>> = omega.iter().map(|w| Mat::from_fn(channels, channels, |i, j| entry(*w, i, j))).collect();
    let variance = exact.iter().map(|g| Mat::from_fn(channels, channels, |i, j| 1e-4 * g[(i, j)].norm_sqr())).collect();
    let noisy = |g: &Mat<c64>| {
        Mat::from_fn(channels, channels, |i, j| {
            g[(i, j)]
                + 0.01 * g[(i, j)].norm() * c64::new(rng.sample(StandardNormal), rng.sample(StandardNormal))
                    / 2.0_f64.sqrt()
        })
    };
    ResponseTable { values: exact.iter().map(noisy).collect(), omega, variance: ResponseVariance::Known(variance) }
}
