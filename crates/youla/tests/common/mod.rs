//! What the integration tests share: the bearing, random loops and distances between systems.
#![allow(dead_code, missing_docs)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::control::{LqrWeights, NoiseCovariance, kalman, lqr};
use youla::factor::CoprimeFactors;
use youla::lti::{Continuous, Discrete, StateSpace, TimeDomain, frequency_response};
use youla::rig::Bearing;
use youla::{Mat, MatRef, c64};

pub const TS: f64 = 1.0 / 5000.0;

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn normal(rng: &mut ChaCha8Rng, rows: usize, cols: usize) -> Mat<f64> {
    Mat::from_fn(rows, cols, |_, _| rng.sample(StandardNormal))
}

/// The bearing at 0 rpm, states balanced; `cross_coupling` adds a skew share of the stiffness (0.25 makes it unstable).
pub fn bearing(cross_coupling: f64) -> StateSpace<Continuous> {
    let mut b = Bearing::default();
    let k = cross_coupling * 1.8e6;
    b.stiffness[0][1] += k;
    b.stiffness[1][0] -= k;
    b.plant().unwrap().balanced().unwrap()
}

pub fn sampled(plant: &StateSpace<Continuous>) -> StateSpace<Discrete> {
    plant.zoh(Discrete::new(TS).unwrap()).unwrap()
}

/// Angular frequencies over four decades around the given centre.
pub fn grid(centre: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| centre * 10f64.powf(-2.0 + 4.0 * k as f64 / (count - 1) as f64)).collect()
}

/// A frequency grid that suits the time domain: around 200 Hz for the bearing, up to Nyquist for discrete systems.
pub fn grid_of<T: TimeDomain>(time: T, centre: f64) -> Vec<f64> {
    match time.sample_time() {
        None => grid(centre, 60),
        Some(ts) => (1..60).map(|k| std::f64::consts::PI / ts * 10f64.powf(-3.0 + 3.0 * k as f64 / 60.0)).collect(),
    }
}

/// F and L of an observer-based controller, from unit weights.
pub fn gains<T: TimeDomain>(plant: &StateSpace<T>) -> (Mat<f64>, Mat<f64>) {
    let (n, m, p) = (plant.order(), plant.inputs(), plant.outputs());
    let one = |k: usize| Mat::<f64>::identity(k, k);
    let f = lqr(plant, &LqrWeights { q: one(n), r: one(m), s: None }).unwrap().f;
    let l = kalman(plant, &NoiseCovariance { process: one(n), measurement: one(p), cross: None }).unwrap().l;
    (f, l)
}

pub fn observer_factors<T: TimeDomain>(plant: &StateSpace<T>) -> CoprimeFactors<T> {
    let (f, l) = gains(plant);
    CoprimeFactors::observer(plant, f.as_ref(), l.as_ref()).unwrap()
}

pub fn random_system<T: TimeDomain>(
    rng: &mut ChaCha8Rng,
    (n, m, p): (usize, usize, usize),
    size: f64,
    time: T,
) -> StateSpace<T> {
    let a = normal(rng, n, n) * faer::Scale(size / (n as f64).sqrt().max(1.0));
    StateSpace::new(a, normal(rng, n, m), normal(rng, p, n), normal(rng, p, m) * faer::Scale(0.5), time).unwrap()
}

/// A random stable system: discrete with spectral radius below 0.9, continuous shifted left.
pub fn random_stable<T: TimeDomain>(rng: &mut ChaCha8Rng, (n, m, p): (usize, usize, usize), time: T) -> StateSpace<T> {
    let s = random_system(rng, (n, m, p), 0.5, time);
    let a = match time.sample_time() {
        None => s.a() - Mat::<f64>::identity(n, n) * faer::Scale(1.5),
        Some(_) => {
            let radius = s.poles().unwrap().iter().map(|p| p.norm()).fold(0.0, f64::max);
            s.a() * faer::Scale(if radius > 0.9 { 0.9 / radius } else { 1.0 })
        }
    };
    StateSpace::new(a, s.b() * faer::Scale(0.3), s.c() * faer::Scale(0.3), s.d() * faer::Scale(0.2), time).unwrap()
}

/// Largest difference of two frequency responses relative to the larger of 1 and the response.
pub fn distance<T: TimeDomain>(x: &StateSpace<T>, y: &StateSpace<T>, omega: &[f64]) -> f64 {
    let (x, y) = (frequency_response(x, omega).unwrap(), frequency_response(y, omega).unwrap());
    (0..omega.len()).map(|k| (x.at(k) - y.at(k)).norm_l2() / x.at(k).norm_l2().max(1.0)).fold(0.0, f64::max)
}

/// Largest distance of a value in `x` to the nearest unused one in `y`, relative to the larger of 1 and its magnitude.
pub fn spectrum_distance(mut x: Vec<c64>, mut y: Vec<c64>) -> f64 {
    assert_eq!(x.len(), y.len(), "the spectra differ in size");
    let mut worst = 0.0f64;
    while let Some(p) = x.pop() {
        let (index, d) =
            y.iter().enumerate().map(|(i, q)| (i, (p - q).norm())).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        worst = worst.max(d / p.norm().max(1.0));
        y.swap_remove(index);
    }
    worst
}

pub fn relative(x: MatRef<'_, f64>, y: MatRef<'_, f64>) -> f64 {
    (x - y).norm_l2() / y.norm_l2().max(1.0)
}
