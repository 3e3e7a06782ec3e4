//! The Cramér-Rao bound against one by finite differences of the response, in another parametrisation: all entries of A, B and C.

use super::energy::transform;
use super::information::accuracy;
use std::f64::consts::TAU;
use youla::linalg::block_diagonal;
use youla::lti::{Discrete, StateSpace, frequency_response, modes::mode};
use youla::{Mat, c64};

const SAMPLES: usize = 256;

fn time() -> Discrete {
    Discrete::new(1e-3).unwrap()
}

/// A mode of the given frequency (Hz) and damping, two states.
fn oscillator(hz: f64, zeta: f64) -> StateSpace<Discrete> {
    let w = TAU * hz;
    let pole = (c64::new(-zeta * w, w * (1.0 - zeta * zeta).sqrt()) * time().ts()).exp();
    let a = Mat::from_fn(2, 2, |i, j| [[pole.re, pole.im], [-pole.im, pole.re]][i][j]);
    let (b, c) = (Mat::from_fn(2, 1, |i, _| [0.3, 0.1][i]), Mat::from_fn(1, 2, |_, j| [1.0, -0.4][j]));
    StateSpace::new(a, b, c, Mat::zeros(1, 1), time()).unwrap()
}

/// The same system in other states.
fn mixed(system: &StateSpace<Discrete>) -> StateSpace<Discrete> {
    let n = system.order();
    let t = Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) + 0.2 * ((3 * i + 5 * j) as f64).sin());
    use faer::linalg::solvers::Solve;
    let lu = t.partial_piv_lu();
    let (a, b) = (lu.solve(system.a() * &t), lu.solve(system.b()));
    StateSpace::new(a, b, system.c() * &t, system.d().to_owned(), time()).unwrap()
}

fn input(inputs: usize) -> Mat<f64> {
    Mat::from_fn(SAMPLES, inputs, |k, j| ((0.37 + 0.11 * j as f64) * (k * k) as f64 * 0.1 + k as f64).sin())
}

/// Entry number k of A, B and C moved by h.
fn moved(system: &StateSpace<Discrete>, k: usize, h: f64) -> StateSpace<Discrete> {
    let [mut a, mut b, mut c] = [system.a(), system.b(), system.c()].map(|m| m.to_owned());
    let (na, nb) = (a.nrows() * a.ncols(), b.nrows() * b.ncols());
    let (m, k) = match k {
        k if k < na => (&mut a, k),
        k if k < na + nb => (&mut b, k - na),
        k => (&mut c, k - na - nb),
    };
    let rows = m.nrows();
    m[(k % rows, k / rows)] += h;
    StateSpace::new(a, b, c, system.d().to_owned(), time()).unwrap()
}

/// Bounds of natural frequency and damping of the mean of the poles within 0.1 of `pole`.
fn by_differences(system: &StateSpace<Discrete>, u: &Mat<f64>, noise: f64, pole: c64) -> [f64; 2] {
    let (n, m, p) = (system.order(), system.inputs(), system.outputs());
    let count = n * (n + m + p);
    let spectra: Vec<Vec<c64>> = (0..m).map(|j| transform(u.as_ref(), j, SAMPLES)).collect();
    let omega: Vec<f64> = (0..=SAMPLES / 2).map(|k| TAU * k as f64 / (SAMPLES as f64 * time().ts())).collect();
    const H: f64 = 1e-5;
    let mut psi = Mat::<f64>::zeros(2 * p * omega.len(), count);
    let mut gradient = Mat::<f64>::zeros(count, 2);
    for theta in 0..count {
        let [up, down] = [H, -H].map(|h| frequency_response(&moved(system, theta, h), &omega).unwrap());
        for k in 0..omega.len() {
            let twice: f64 = if k == 0 || 2 * k == SAMPLES { 1.0 } else { 2.0 };
            let weight = (twice / SAMPLES as f64).sqrt() / noise;
            for i in 0..p {
                let change =
                    (0..m).fold(c64::ZERO, |sum, j| sum + (up.at(k)[(i, j)] - down.at(k)[(i, j)]) * spectra[j][k]);
                psi[(2 * (k * p + i), theta)] = weight * change.re / (2.0 * H);
                psi[(2 * (k * p + i) + 1, theta)] = weight * change.im / (2.0 * H);
            }
        }
        let mean = |h: f64| {
            let poles = moved(system, theta, h).poles().unwrap();
            let near: Vec<c64> = poles.into_iter().filter(|z| (z - pole).norm() < 0.1).collect();
            let mode = mode(time(), near.iter().fold(c64::ZERO, |sum, z| sum + z) / near.len() as f64);
            [mode.hz, mode.zeta]
        };
        let [up, down] = [H, -H].map(mean);
        (0..2).for_each(|k| gradient[(theta, k)] = (up[k] - down[k]) / (2.0 * H));
    }
    // Directions that leave the response as it is have no singular value.
    let svd = psi.thin_svd().unwrap();
    let sizes = svd.S().column_vector();
    let along = svd.V().transpose() * gradient;
    let kept = (0..count).filter(|k| sizes[*k] > 1e-7 * sizes[0]);
    let variance = |g: usize| kept.clone().map(|k| (along[(k, g)] / sizes[k]).powi(2)).sum::<f64>();
    [variance(0).sqrt(), variance(1).sqrt()]
}

fn agree(name: &str, found: [Option<f64>; 2], expected: [f64; 2]) {
    for (found, expected) in found.into_iter().zip(expected) {
        let found = found.unwrap_or(f64::NAN);
        assert!((found / expected - 1.0).abs() < 1e-6, "{name}: {found:e} against {expected:e}");
    }
}

/// Two modes one beside the other.
#[test]
fn simple_modes_agree_with_finite_differences() {
    let system = mixed(&oscillator(40.0, 0.03).plus(&oscillator(90.0, 0.02)).unwrap());
    let u = input(1);
    let modes = accuracy(&system, u.as_ref(), &[0.1]).unwrap();
    let poles = system.modes().unwrap();
    assert_eq!(modes.len(), 2);
    for (mode, at) in modes.iter().zip(&poles) {
        agree("simple", [mode.hz_deviation, mode.zeta_deviation], by_differences(&system, &u, 0.1, at.pole));
    }
}

/// A symmetric machine: the mean of two equal modes with outputs of their own has half of the root of both variances.
#[test]
fn equal_modes_agree_with_finite_differences() {
    let one = oscillator(40.0, 0.03);
    let two = StateSpace::new(
        block_diagonal(one.a(), one.a()),
        block_diagonal(one.b(), one.b()),
        block_diagonal(one.c(), one.c()),
        Mat::zeros(2, 2),
        time(),
    )
    .unwrap();
    let u = input(2);
    for (name, system) in [("apart", two.clone()), ("mixed", mixed(&two))] {
        let modes = accuracy(&system, u.as_ref(), &[0.1, 0.1]).unwrap();
        assert_eq!(modes.len(), 2);
        let of = |k: usize| [modes[k].hz_deviation, modes[k].zeta_deviation].map(|d| d.unwrap_or(f64::NAN));
        let mean = [0, 1].map(|k| Some(0.5 * of(0)[k].hypot(of(1)[k])));
        agree(name, mean, by_differences(&system, &u, 0.1, one.modes().unwrap()[0].pole));
    }
}

/// A delay shifts the response and takes nothing from what is known of the modes.
#[test]
fn delays_take_nothing_from_the_bound() {
    let plain = oscillator(40.0, 0.03).plus(&oscillator(90.0, 0.02)).unwrap();
    let u = input(1);
    let expected = accuracy(&plain, u.as_ref(), &[0.1]).unwrap();
    let mut late = plain.clone();
    for samples in 1..=5 {
        let delay =
            StateSpace::new(Mat::zeros(1, 1), Mat::identity(1, 1), Mat::identity(1, 1), Mat::zeros(1, 1), time())
                .unwrap();
        late = late.then(&delay).unwrap();
        for (name, system) in [("plain", late.clone()), ("mixed", mixed(&late))] {
            let found = accuracy(&system, u.as_ref(), &[0.1]).unwrap();
            assert_eq!(found.len(), 2, "{name}, {samples} samples");
            for (found, expected) in found.iter().zip(&expected) {
                let deviations = [found.hz_deviation, found.zeta_deviation];
                let expected = [expected.hz_deviation.unwrap(), expected.zeta_deviation.unwrap()];
                agree(&format!("{name}, {samples} samples"), deviations, expected);
            }
        }
    }
}
