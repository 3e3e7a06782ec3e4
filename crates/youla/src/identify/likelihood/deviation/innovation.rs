//! The recommended model as an innovation form: plant, noise and Kalman gain.
//!
//! Each output carries an autoregression with a zero, `v(t) = -a_1 v(t-1) - ... + e(t) - b e(t-1)`, whose innovations are those
//! of the whole where the plant is stable: K is zero for the states of the plant. Where it is not, the gain comes from the Riccati
//! equation of plant and noise, which mirrors its poles. Noise at the inputs of the plant moves its states.

use crate::identify::likelihood::recommendation::Predictor;
use crate::identify::likelihood::search::autoregression::Regression;
use crate::identify::likelihood::search::driven::{Driven, Kalman};
use crate::identify::likelihood::search::noise::Noise;
use crate::linalg::{RiccatiProblem, block, block_diagonal, dare, eigenvalues};
use crate::lti::{Discrete, StateSpace};
use faer::{Mat, Scale};

/// Process noise that keeps poles on the circle within reach, as a share of the covariance of the innovations.
const TRACE: f64 = 1e-12;

/// Joins the plant (physical units) to the noise, whose covariance is in units of `sizes`.
pub(crate) fn predictor(plant: &StateSpace<Discrete>, noise: &Noise, sizes: &[f64]) -> Predictor {
    let [shift, enters, seen] = autoregressions(&noise.regression);
    let (n, p, extra) = (plant.order(), plant.outputs(), shift.nrows());
    // The innovations of a filter that mirrors poles are smaller than those of the noise at the inputs of an unstable plant.
    let mirrored = |i: usize| noise.regression[i].driven.as_ref().map_or(1.0, |driven| driven.kalman.unstable);
    let size = |i: usize| sizes[i] * mirrored(i);
    let covariance = Mat::from_fn(p, p, |i, j| noise.covariance[(i, j)] * size(i) * size(j));
    // Noise at the inputs moves the states of the plant; of many outputs each has its own, independent of the others. A colour has a state
    // for each input.
    let of_each: Vec<Option<&Driven>> = noise.regression.iter().map(|r| r.driven.as_deref()).collect();
    let shared = noise.joint.as_ref().map(|joint| &joint.kalman);
    let colours = shared.map_or(0, |kalman| kalman.of_colour.nrows());
    let copies: usize = of_each.iter().flatten().map(|driven| driven.kalman.gain.nrows()).sum();
    let own = colours + copies;
    let first = n + own;
    let mut a = block_diagonal(block_diagonal(plant.a(), Mat::zeros(own, own).as_ref()).as_ref(), shift.as_ref());
    let b = block(&[&[plant.b()], &[Mat::zeros(own + extra, plant.inputs()).as_ref()]]);
    let mut c = block(&[&[plant.c(), Mat::zeros(p, own).as_ref(), seen.as_ref()]]);
    let mut gain = block(&[&[Mat::zeros(first, p).as_ref()], &[enters.as_ref()]]);
    let mut driven_by = |a: &mut Mat<f64>, s: usize, i: usize, k: f64| {
        gain[(s, i)] = k / sizes[i];
        (0..extra).for_each(|j| a[(s, first + j)] += k / sizes[i] * seen[(i, j)]);
    };
    if let Some(Kalman { entry, gain, b, of_colour, .. }) = shared {
        for i in 0..p {
            (0..gain.nrows()).for_each(|s| driven_by(&mut a, s, i, gain[(s, i)]));
            (0..colours).for_each(|j| driven_by(&mut a, n + j, i, of_colour[(j, i)]));
        }
        for j in 0..colours {
            a[(n + j, n + j)] = entry.colour.unwrap_or(0.0);
            (0..b.nrows()).for_each(|s| a[(s, n + j)] = b[(s, j)]);
        }
    }
    let mut at = n;
    for (i, driven) in of_each.iter().enumerate() {
        let Some(Driven { kalman, a: own, c: sees, .. }) = driven else { continue };
        let states = own.nrows();
        a.submatrix_mut(at, at, states, states).copy_from(own);
        for s in 0..states {
            c[(i, at + s)] = sees[(0, s)] * sizes[i];
            driven_by(&mut a, at + s, i, kalman.gain[(s, 0)]);
        }
        at += states;
    }
    // The zero matrix solves the Riccati equation; it is the stabilising solution where the zeros of the noise are inside of the unit circle
    // without it.
    let inside =
        || eigenvalues("the predictor", (&a - &gain * &c).as_ref()).is_ok_and(|p| p.iter().all(|p| p.norm() < 1.0));
    let stable = plant.is_stable().unwrap_or(false) || inside();
    let k = if stable { Some(gain) } else { riccati(&a, &c, &gain, &covariance) };
    Predictor { a, b, c, d: plant.d().to_owned(), k, covariance }
}

/// `w+ = A w + G e`, `v = C w + e` of all outputs in observer form: a in the first column of each A, G = c - a.
fn autoregressions(regression: &[Regression]) -> [Mat<f64>; 3] {
    // A zero comes with a slow pole, so that there are always coefficients enough for it.
    let states = |r: &Regression| r.coefficients.len();
    let (p, extra) = (regression.len(), regression.iter().map(states).sum());
    let mut shift = Mat::<f64>::zeros(extra, extra);
    let mut enters = Mat::<f64>::zeros(extra, p);
    let mut seen = Mat::<f64>::zeros(p, extra);
    let mut at = 0;
    for (i, one) in regression.iter().enumerate() {
        let count = states(one);
        for j in 0..count {
            let a = one.coefficients.get(j).copied().unwrap_or(0.0);
            shift[(at + j, at)] = -a;
            enters[(at + j, i)] = -a - if j == 0 { one.zero } else { 0.0 };
            if j + 1 < count {
                shift[(at + j, at + j + 1)] = 1.0;
            }
        }
        if count > 0 {
            seen[(i, at)] = 1.0;
        }
        at += count;
    }
    [shift, enters, seen]
}

/// `K = (A P C' + S) (C P C' + R)^-1` as the dual of the regulator.
fn riccati(a: &Mat<f64>, c: &Mat<f64>, gain: &Mat<f64>, covariance: &Mat<f64>) -> Option<Mat<f64>> {
    let q = gain * covariance * gain.transpose();
    let trace = (0..covariance.nrows()).map(|i| covariance[(i, i)]).sum::<f64>() * TRACE;
    let q = (&q + q.transpose()) * Scale(0.5) + Mat::<f64>::identity(a.nrows(), a.nrows()) * Scale(trace);
    let s = gain * covariance;
    let dual = RiccatiProblem {
        a: a.transpose(),
        b: c.transpose(),
        q: q.as_ref(),
        r: covariance.as_ref(),
        s: Some(s.as_ref()),
    };
    dare("the predictor", &dual).ok().map(|solution| solution.gain.transpose().to_owned())
}
