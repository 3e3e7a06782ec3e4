//! Random systems, gains and signals for the integration tests of several crates.
#![allow(dead_code)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::{LqrWeights, NoiseCovariance, kalman, lqr};
use youla::factor::CoprimeFactors;
use youla::lti::{Continuous, Discrete, StateSpace, TimeDomain, frequency_response, simulate};
use youla::{Mat, MatRef};

pub(crate) const TS: f64 = 1.0 / 5000.0;

pub(crate) fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub(crate) fn normal(rng: &mut ChaCha8Rng, rows: usize, cols: usize) -> Mat<f64> {
    Mat::from_fn(rows, cols, |_, _| rng.sample(StandardNormal))
}

pub(crate) fn sampled(plant: &StateSpace<Continuous>) -> StateSpace<Discrete> {
    plant.zoh(Discrete::new(TS).unwrap()).unwrap()
}

/// F and L of an observer-based controller, from unit weights.
pub(crate) fn gains<T: TimeDomain>(plant: &StateSpace<T>) -> (Mat<f64>, Mat<f64>) {
    let (n, m, p) = (plant.order(), plant.inputs(), plant.outputs());
    let one = |k: usize| Mat::<f64>::identity(k, k);
    let f = lqr(plant, &LqrWeights { q: one(n), r: one(m), s: None }).unwrap().f;
    let l = kalman(plant, &NoiseCovariance { process: one(n), measurement: one(p), cross: None }).unwrap().l;
    (f, l)
}

pub(crate) fn observer_factors<T: TimeDomain>(plant: &StateSpace<T>) -> CoprimeFactors<T> {
    let (f, l) = gains(plant);
    CoprimeFactors::observer(plant, f.as_ref(), l.as_ref()).unwrap()
}

/// A random system with feedthrough; the pole farthest out is at `instability` beyond the stability boundary (its real part
/// in continuous time, `|z| - 1` in discrete time).
pub(crate) fn random_system<T: TimeDomain>(
    rng: &mut ChaCha8Rng,
    shape: (usize, usize, usize),
    instability: f64,
    time: T,
) -> StateSpace<T> {
    let (n, m, p) = shape;
    let a = normal(rng, n, n) * faer::Scale(1.0 / (n as f64).sqrt());
    let poles = youla::linalg::eigenvalues("A", a.as_ref()).unwrap();
    let a = match time.sample_time() {
        None => {
            let rightmost = poles.iter().map(|p| p.re).fold(f64::NEG_INFINITY, f64::max);
            a + Mat::<f64>::identity(n, n) * faer::Scale(instability - rightmost)
        }
        Some(_) => a * faer::Scale((1.0 + instability) / poles.iter().map(|p| p.norm()).fold(0.0, f64::max)),
    };
    StateSpace::new(a, normal(rng, n, m), normal(rng, p, n), normal(rng, p, m) * faer::Scale(0.5), time).unwrap()
}

/// A random stable system of moderate gain, with feedthrough.
pub(crate) fn random_stable<T: TimeDomain>(
    rng: &mut ChaCha8Rng,
    (n, m, p): (usize, usize, usize),
    time: T,
) -> StateSpace<T> {
    if n == 0 {
        return StateSpace::gain(normal(rng, p, m) * faer::Scale(0.1), time).unwrap();
    }
    let s = random_system(rng, (n, m, p), -0.3, time);
    StateSpace::new(
        s.a().to_owned(),
        s.b() * faer::Scale(0.3),
        s.c() * faer::Scale(0.3),
        s.d() * faer::Scale(0.2),
        time,
    )
    .unwrap()
}

/// Largest difference of two frequency responses relative to the larger of 1 and the response.
pub(crate) fn distance<T: TimeDomain>(x: &StateSpace<T>, y: &StateSpace<T>, omega: &[f64]) -> f64 {
    let (x, y) = (frequency_response(x, omega).unwrap(), frequency_response(y, omega).unwrap());
    (0..omega.len()).map(|k| (x.at(k) - y.at(k)).norm_l2() / x.at(k).norm_l2().max(1.0)).fold(0.0, f64::max)
}

/// The response from rest.
pub(crate) fn run(s: &StateSpace<Discrete>, u: MatRef<'_, f64>) -> Mat<f64> {
    simulate(s, u, &vec![0.0; s.order()]).unwrap()
}
