//! A mass between spring and damper, in open and in closed loop.

mod compare;
mod coverage;
mod exact;
mod work;

use crate::{DeclaredStructure, Structure, Template};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::Mat;
use youla::control::closed_loop;
use youla::identify::subspace::Experiment;
use youla::lti::{Discrete, Partitioned, StateSpace, simulate};

/// Inputs and outputs of one experiment.
pub(super) struct Log {
    pub(super) u: Mat<f64>,
    pub(super) y: Mat<f64>,
}

impl Log {
    pub(super) fn experiment(&self) -> Experiment<'_> {
        Experiment::new(self.u.as_ref(), self.y.as_ref())
    }
}

/// 16 Hz, damping ratio 0.1.
fn oscillator() -> DeclaredStructure {
    DeclaredStructure::new(&Template::MassSpringDamper.declaration().unwrap()).unwrap()
}

fn time() -> Discrete {
    Discrete::new(5e-3).unwrap()
}

fn plant() -> StateSpace<Discrete> {
    oscillator().model(&oscillator().start()).unwrap().zoh(time()).unwrap()
}

/// `u = w - 2000 y - slope (y(k) - y(k-1))`, `beta = y`: as `(y, w) -> (u, beta)`.
fn controller(slope: f64) -> Partitioned<Discrete> {
    let number = |v: f64| Mat::from_fn(1, 1, |_, _| v);
    let d = Mat::from_fn(2, 2, |i, j| [[-2000.0 - slope, 1.0], [1.0, 0.0]][i][j]);
    let (b, c) = (Mat::from_fn(1, 2, |_, j| [1.0, 0.0][j]), Mat::from_fn(2, 1, |i, _| [slope, 0.0][i]));
    Partitioned::new(StateSpace::new(number(0.0), b, c, d, time()).unwrap(), 1, 1).unwrap()
}

/// Steps of 1 N that hold 1 to 8 samples.
fn excitation(samples: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut w = Vec::with_capacity(samples + 8);
    while w.len() < samples {
        let (level, hold) = (if rng.random::<bool>() { 1.0 } else { -1.0 }, rng.random_range(1..=8));
        w.extend(std::iter::repeat_n(level, hold));
    }
    w
}

/// The noise `n+ = colour n + e` of deviation `size` (where it is white).
fn noise(samples: usize, size: f64, colour: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut n = 0.0;
    (0..samples)
        .map(|_| {
            n = colour * n + size * rng.sample::<f64, _>(StandardNormal);
            n
        })
        .collect()
}

/// From rest, in open loop.
fn open_loop(samples: usize, size: f64, colour: f64, seed: u64) -> Log {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (w, n) = (excitation(samples, &mut rng), noise(samples, size, colour, &mut rng));
    let u = Mat::from_fn(samples, 1, |k, _| w[k]);
    let clean = simulate(&plant(), u.as_ref(), &[0.0; 2]).unwrap();
    Log { y: Mat::from_fn(samples, 1, |k, _| clean[(k, 0)] + n[k]), u }
}

/// From rest, in the loop: (u, y), and (w, y).
fn in_loop(samples: usize, size: f64, colour: f64, slope: f64, seed: u64) -> [Log; 2] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (w, n) = (excitation(samples, &mut rng), noise(samples, size, colour, &mut rng));
    let driving = Mat::from_fn(samples, 2, |k, j| if j == 0 { w[k] } else { n[k] });
    let closed = closed_loop(&plant(), &controller(slope)).unwrap();
    assert!(closed.is_stable().unwrap());
    let z = simulate(&closed, driving.as_ref(), &vec![0.0; closed.order()]).unwrap();
    let column = |m: &Mat<f64>, j: usize| m.as_ref().subcols(j, 1).to_owned();
    [Log { u: column(&z, 0), y: column(&z, 1) }, Log { u: column(&driving, 0), y: column(&z, 1) }]
}
