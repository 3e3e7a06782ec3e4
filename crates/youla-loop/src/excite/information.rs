//! Predicted accuracy of the modes of the plant: the Cramér-Rao bound of output error in closed loop with known alpha.
//!
//! ```text
//! y = G_cl(theta) alpha + S_y n,   n white with covariance diag(sigma^2)
//! S_y^-1 dG_cl alpha = dG u_alpha                          u_alpha: the part of u that alpha causes
//! I(theta) = 1/L sum over frequencies of psi* diag(sigma^-2) psi,   psi = dG/dtheta U_alpha
//! ```
//!
//! Whitened by the sensitivity, the loop drops out of the derivative: what counts is the input that alpha makes. The noise colours y by
//! S_y, which depends on theta too; that information is neglected, so the bound is conservative. Sums over frequencies hold for
//! unstable plants as well. The parameters are those of every pole p: `G = sum of C (z - P)^-1 B`, where P is r x r with `P = p I` at
//! the nominal model. A simple pole has r = 1: p, its direction C at the outputs and B at the inputs, one entry of B held. Equal poles with
//! r independent directions (a symmetric rotor) vary with all of P, C and B, r columns of B held as the identity: so each of
//! them has an input of its own, and its deviation is that of its diagonal entry of P. Delays are known: `G = G_0 diag(z^-d)`, and
//! the parameters are those of G_0. Poles without a complete set of directions, hidden ones and the feedthrough count as known.
//!
//! Source: L. Ljung, System Identification, 2nd ed. (1999), sections 7.4 and 9.4; compared with a Monte-Carlo study in
//! `tests::the_bound_is_what_prediction_error_reaches`, and with finite differences of the response in `bound.rs`.

use super::energy::transform;
use super::pole::Pole;
use crate::error::Result;
use faer::linalg::solvers::Solve;
use serde::Serialize;
use std::f64::consts::TAU;
use youla::linalg::reciprocal_condition;
use youla::lti::{Discrete, Eigen, StateSpace, TimeDomain};
use youla::{Mat, MatRef, c64};

/// A pole nearer to the origin than this is a delay.
/// A sampled mode with |z| below it has decayed by 95 % within one sample. Chosen, not measured.
const DELAY: f64 = 0.05;
/// Poles of the list of modes this near to one of the bound, over the pole, are that one. Chosen, not measured.
const APART: f64 = 1e-6;
/// Singular value of the residue of equal poles, over the largest, below which there is no further direction: half of the digits.
/// Chosen, not measured.
pub(super) const DIRECTION: f64 = 1e-8;
/// Fraction of the largest peak below which a pole is treated as not controllable.
/// Chosen, not measured.
const WEAKLY_CONTROLLABLE: f64 = 1e-10;
/// Fraction of the largest value of an impulse response below which it has not begun.
/// Rounding of products of some tens of factors. Chosen, not measured.
const BEGUN: f64 = 1e-12;
/// Frequencies that are added up in one product.
/// Memory of one product: 1024 complex columns, below 1 MB for 40 states. Chosen, not measured.
const CHUNK: usize = 1024;

/// Predicted accuracy of one mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ModeAccuracy {
    /// Natural frequency in the nominal model, Hz.
    pub hz: f64,
    /// Damping ratio in the nominal model.
    pub zeta: f64,
    /// Smallest standard deviation that an unbiased estimate of the natural frequency can have, Hz; absent where the excitation does
    /// not determine the mode.
    pub hz_deviation: Option<f64>,
    /// The same for the damping ratio.
    pub zeta_deviation: Option<f64>,
    /// Length in seconds at which the damping ratio has the required standard deviation: information is proportional to length.
    pub needed: Option<f64>,
}

/// The oscillating modes of the nominal model with their accuracies under the input `u` (samples x m, until the loop is at rest).
pub(super) fn accuracy(nominal: &StateSpace<Discrete>, u: MatRef<'_, f64>, noise: &[f64]) -> Result<Vec<ModeAccuracy>> {
    let delays = delays(nominal)?;
    let poles = poles(nominal, &delays)?;
    let information = information(nominal, &poles, &Input { u, delays }, noise);
    let mut known = deviations(&poles, &information, nominal.time());
    let all = nominal.modes()?;
    let oscillating = all.into_iter().filter(|m| m.pole.im > 0.0 && m.pole.norm() >= DELAY);
    Ok(oscillating
        .map(|m| {
            let near = |p: &(c64, [f64; 2])| (p.0 - m.pole).norm() < APART * m.pole.norm();
            // Each of the equal ones once.
            let found = known.iter().position(near).map(|place| known.remove(place).1);
            let [hz_deviation, zeta_deviation] = [found.map(|d| d[0]), found.map(|d| d[1])];
            ModeAccuracy { hz: m.hz, zeta: m.zeta, hz_deviation, zeta_deviation, needed: None }
        })
        .collect())
}

/// Whole samples by which each input is late beyond the hold, where poles at the origin make it so: the zeros at the start of its
/// impulse response, but for the one of a plant without direct path.
fn delays(nominal: &StateSpace<Discrete>) -> Result<Vec<usize>> {
    let at_origin = nominal.poles()?.iter().filter(|p| p.norm() < DELAY).count();
    let mut state = nominal.b().to_owned();
    let mut responses = vec![nominal.d().to_owned()];
    for _ in 0..=at_origin {
        responses.push(nominal.c() * &state);
        state = nominal.a() * &state;
    }
    let begins = |j: usize| {
        let sizes: Vec<f64> = responses.iter().map(|h| h.col(j).norm_max()).collect();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        sizes.iter().position(|size| *size > BEGUN * largest).unwrap_or(0)
    };
    let begins: Vec<usize> = (0..nominal.inputs()).map(begins).collect();
    let direct = begins.iter().sum::<usize>() == at_origin;
    Ok(begins.into_iter().map(|k| if direct { k } else { k.saturating_sub(1).min(at_origin) }).collect())
}

/// The poles of G_0 that are parameters, one for each pair.
fn poles(nominal: &StateSpace<Discrete>, delays: &[usize]) -> Result<Vec<Pole>> {
    if nominal.order() == 0 {
        return Ok(Vec::new());
    }
    let eigen = Eigen::new(nominal)?;
    let all = eigen.poles();
    let mut poles = Vec::new();
    for group in eigen.complete_groups() {
        let value = group.iter().fold(c64::ZERO, |sum, k| sum + all[*k]) / group.len() as f64;
        if value.norm() < DELAY || value.im < 0.0 {
            continue;
        }
        let mut residue = Mat::<c64>::zeros(nominal.outputs(), nominal.inputs());
        for k in group {
            let (c, b) = eigen.directions(*k, nominal);
            let late = |j: usize| value.powu(delays[j] as u32);
            residue += Mat::from_fn(c.len(), b.len(), |i, j| c[i] * b[j] * late(j));
        }
        poles.extend(Pole::new(value, &residue, group.len()));
    }
    let peak = |p: &Pole| p.size / (1.0 - p.value.norm()).abs().max(1e-12);
    let largest = poles.iter().map(peak).fold(0.0, f64::max);
    poles.retain(|p| peak(p) > WEAKLY_CONTROLLABLE * largest);
    Ok(poles)
}

/// The input of the plant and the samples by which it acts late.
struct Input<'a> {
    u: MatRef<'a, f64>,
    delays: Vec<usize>,
}

/// I(theta), by Parseval over the padded input.
fn information(nominal: &StateSpace<Discrete>, poles: &[Pole], input: &Input<'_>, noise: &[f64]) -> Mat<f64> {
    let (m, p, u) = (nominal.inputs(), nominal.outputs(), input.u);
    let length = u.nrows().next_power_of_two();
    let spectra: Vec<Vec<c64>> = (0..m).map(|j| transform(u, j, length)).collect();
    let count: usize = poles.iter().map(Pole::parameters).sum();
    let power = |k: usize| spectra.iter().map(|s| s[k].norm_sqr()).sum::<f64>();
    let largest = (0..=length / 2).map(power).fold(0.0, f64::max);
    let point = |k: usize| nominal.time().boundary(TAU * k as f64 / (length as f64 * nominal.time().ts()));
    // At a pole on the stability boundary u is zero, and the product has a limit that one frequency does not need.
    let regular = |k: &usize| poles.iter().all(|p| (point(*k) - p.value).norm() > 1e-9);
    let used: Vec<usize> = (0..=length / 2).filter(|k| power(*k) > 1e-20 * largest).filter(regular).collect();
    let mut total = Mat::zeros(count, count);
    for chunk in used.chunks(CHUNK) {
        let mut rows = Mat::<f64>::zeros(2 * p * chunk.len(), count);
        for (i, k) in chunk.iter().enumerate() {
            let twice = if *k == 0 || 2 * k == length { 1.0 } else { 2.0 };
            let weight = (twice / length as f64).sqrt();
            let z = point(*k);
            let at: Vec<c64> = spectra.iter().zip(&input.delays).map(|(s, d)| s[*k] * z.powi(-(*d as i32))).collect();
            let mut column = 0;
            for pole in poles {
                pole.columns(z, &at, |values| {
                    for (r, value) in values.iter().enumerate() {
                        rows[(2 * (i * p + r), column)] = weight * value.re / noise[r];
                        rows[(2 * (i * p + r) + 1, column)] = weight * value.im / noise[r];
                    }
                    column += 1;
                });
            }
        }
        total += rows.transpose() * &rows;
    }
    total
}

/// Standard deviations of natural frequency and damping ratio of each pair, none where the information is singular.
fn deviations(poles: &[Pole], information: &Mat<f64>, time: Discrete) -> Vec<(c64, [f64; 2])> {
    let n = information.nrows();
    let scale: Vec<f64> = (0..n).map(|i| information[(i, i)].sqrt().max(f64::MIN_POSITIVE)).collect();
    let scaled = Mat::from_fn(n, n, |i, j| information[(i, j)] / (scale[i] * scale[j]));
    let determined = n > 0 && scaled.is_all_finite() && reciprocal_condition(scaled.as_ref()) > 1e-13;
    if !determined {
        return Vec::new();
    }
    let covariance = scaled.partial_piv_lu().solve(Mat::<f64>::identity(n, n));
    let mut first = 0;
    let mut found = Vec::new();
    for pole in poles {
        for own in pole.own_parameters().filter(|_| pole.value.im > 0.0).map(|k| first + k) {
            let entry = |i: usize, j: usize| covariance[(own + i, own + j)] / (scale[own + i] * scale[own + j]);
            let [hz, zeta] = gradients(pole.value, time);
            let variance =
                |g: [f64; 2]| (0..4).map(|k| g[k / 2] * entry(k / 2, k % 2) * g[k % 2]).sum::<f64>().max(0.0).sqrt();
            found.push((pole.value, [variance(hz), variance(zeta)]));
        }
        first += pole.parameters();
    }
    found
}

/// Derivatives of natural frequency (Hz) and damping ratio by real and imaginary part of the pole: with `s = ln(z) / ts`,
/// `f = |s| / 2 pi` and `zeta = -Re s / |s|`.
fn gradients(pole: c64, time: Discrete) -> [[f64; 2]; 2] {
    let s = time.continuous_pole(pole);
    let size = s.norm();
    let along = |direction: c64| {
        let ds = direction / pole / time.ts();
        let change = (s.re * ds.re + s.im * ds.im) / size;
        (change / TAU, -ds.re / size + s.re * change / (size * size))
    };
    let (re, im) = (along(c64::new(1.0, 0.0)), along(c64::new(0.0, 1.0)));
    [[re.0, im.0], [re.1, im.1]]
}
