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
//! unstable plants as well. The parameters are those of every simple pole: `G = sum of c b / (z - p)` with the pole p, its
//! direction c at the outputs and b at the inputs, one entry of b held. Poles that repeat or lie at the origin (delays), with
//! their residues, hidden ones and the feedthrough count as known.
//!
//! Source: L. Ljung, System Identification, 2nd ed. (1999), sections 7.4 and 9.4; compared with a Monte-Carlo study in
//! `tests::the_bound_is_what_prediction_error_reaches`.

use super::energy::transform;
use crate::error::Result;
use faer::linalg::solvers::Solve;
use serde::Serialize;
use std::f64::consts::TAU;
use youla::linalg::reciprocal_condition;
use youla::lti::{Discrete, Eigen, Mode, StateSpace, TimeDomain, modes::mode};
use youla::{Mat, MatRef, c64};

/// A pole nearer to the origin than this is a delay.
/// A sampled mode with |z| below it has decayed by 95 % within one sample. Chosen, not measured.
const DELAY: f64 = 0.05;
/// Poles nearer to each other than this count as one that repeats.
/// Residues of two poles this close cancel to half of the digits of double precision, `sqrt(2^-52) = 1.5e-8`, with a margin. Chosen,
/// not measured.
const APART: f64 = 1e-6;
/// Fraction of the largest peak below which a pole is treated as not controllable.
/// Chosen, not measured.
const WEAKLY_CONTROLLABLE: f64 = 1e-10;
/// Frequencies that are added up in one product.
/// Memory of one product: 1024 complex columns, below 1 MB for 40 states. Chosen, not measured.
const CHUNK: usize = 1024;

/// The derivative of `c b / (z - p)` times u by one parameter, from p, c and b.
type Derivative<'a> = dyn Fn(c64, &[c64], &[c64]) -> Vec<c64> + 'a;

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

/// One pole of an upper half plane with its parameters.
struct Pole {
    mode: Mode,
    value: c64,
    c: Vec<c64>,
    b: Vec<c64>,
    held: usize,
}

/// The oscillating modes of the nominal model with their accuracies under the input `u` (samples x m, until the loop is at rest).
pub(super) fn accuracy(nominal: &StateSpace<Discrete>, u: MatRef<'_, f64>, noise: &[f64]) -> Result<Vec<ModeAccuracy>> {
    let poles = simple_poles(nominal)?;
    let information = information(nominal, &poles, u, noise);
    let deviations = deviations(&poles, &information, nominal.time());
    let all = nominal.modes()?;
    let oscillating = all.into_iter().filter(|m| m.pole.im > 0.0 && m.pole.norm() >= DELAY);
    Ok(oscillating
        .map(|m| {
            let near = |p: &&(Mode, Option<[f64; 2]>)| (p.0.pole - m.pole).norm() < APART;
            let found = deviations.iter().find(near).and_then(|p| p.1);
            let [hz_deviation, zeta_deviation] = [found.map(|d| d[0]), found.map(|d| d[1])];
            ModeAccuracy { hz: m.hz, zeta: m.zeta, hz_deviation, zeta_deviation, needed: None }
        })
        .collect())
}

fn simple_poles(nominal: &StateSpace<Discrete>) -> Result<Vec<Pole>> {
    if nominal.order() == 0 {
        return Ok(Vec::new());
    }
    let eigen = Eigen::new(nominal)?;
    let all = eigen.poles();
    let alone = |k: usize| {
        all[k].norm() >= DELAY && (0..all.len()).all(|j| j == k || (all[j] - all[k]).norm() >= APART * all[k].norm())
    };
    let size = |v: &[c64]| v.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
    let candidates = (0..all.len()).filter(|k| all[*k].im >= 0.0 && alone(*k)).map(|k| {
        let (c, b) = eigen.directions(k, nominal);
        let held = (0..b.len()).max_by(|i, j| b[*i].norm().total_cmp(&b[*j].norm())).unwrap_or(0);
        Pole { mode: mode(nominal.time(), all[k]), value: all[k], c, b, held }
    });
    let mut poles: Vec<Pole> = candidates.collect();
    let peak = |p: &Pole| size(&p.c) * size(&p.b) / (1.0 - p.value.norm()).abs().max(1e-12);
    let largest = poles.iter().map(peak).fold(0.0, f64::max);
    poles.retain(|p| peak(p) > WEAKLY_CONTROLLABLE * largest);
    Ok(poles)
}

impl Pole {
    /// Real parameters, for p, c and b but for the entry that is held: twice as many for a pair.
    fn parameters(&self) -> usize {
        (if self.value.im > 0.0 { 2 } else { 1 }) * (self.c.len() + self.b.len())
    }

    /// The columns `dG/dtheta U` of this pole at z, each of p values.
    fn columns(&self, z: c64, u: &[c64], mut take: impl FnMut(&[c64])) {
        let pair = self.value.im > 0.0;
        let mut emit = |one: Vec<c64>, other: Vec<c64>| {
            if pair {
                take(&one.iter().zip(&other).map(|(a, b)| a + b).collect::<Vec<_>>());
                let turned = |(a, b): (&c64, &c64)| c64::new(0.0, 1.0) * (a - b);
                take(&one.iter().zip(&other).map(turned).collect::<Vec<_>>());
            } else {
                take(&one);
            }
        };
        // Each derivative of the term and of its conjugate.
        let both = |derive: &Derivative| {
            let conjugate = |v: &[c64]| v.iter().map(|x| x.conj()).collect::<Vec<_>>();
            (derive(self.value, &self.c, &self.b), derive(self.value.conj(), &conjugate(&self.c), &conjugate(&self.b)))
        };
        let along = |b: &[c64]| b.iter().zip(u).fold(c64::new(0.0, 0.0), |sum, (b, u)| sum + b * u);
        let (one, other) = both(&|p, c, b| c.iter().map(|c| c * along(b) / ((z - p) * (z - p))).collect::<Vec<_>>());
        emit(one, other);
        for r in 0..self.c.len() {
            let unit = |p: c64, b: &[c64]| {
                let mut column = vec![c64::new(0.0, 0.0); self.c.len()];
                column[r] = along(b) / (z - p);
                column
            };
            let (one, other) = both(&|p, _, b| unit(p, b));
            emit(one, other);
        }
        for s in (0..self.b.len()).filter(|s| *s != self.held) {
            let (one, other) = both(&|p, c, _| c.iter().map(|c| c * u[s] / (z - p)).collect());
            emit(one, other);
        }
    }
}

/// I(theta), by Parseval over the padded input.
fn information(nominal: &StateSpace<Discrete>, poles: &[Pole], u: MatRef<'_, f64>, noise: &[f64]) -> Mat<f64> {
    let (m, p) = (nominal.inputs(), nominal.outputs());
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
            let at: Vec<c64> = spectra.iter().map(|s| s[*k]).collect();
            let mut column = 0;
            for pole in poles {
                pole.columns(point(*k), &at, |values| {
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

/// Standard deviations of natural frequency and damping ratio of each pole, none where the information is singular.
fn deviations(poles: &[Pole], information: &Mat<f64>, time: Discrete) -> Vec<(Mode, Option<[f64; 2]>)> {
    let n = information.nrows();
    let scale: Vec<f64> = (0..n).map(|i| information[(i, i)].sqrt().max(f64::MIN_POSITIVE)).collect();
    let scaled = Mat::from_fn(n, n, |i, j| information[(i, j)] / (scale[i] * scale[j]));
    let determined = n > 0 && scaled.is_all_finite() && reciprocal_condition(scaled.as_ref()) > 1e-13;
    let covariance = determined.then(|| scaled.partial_piv_lu().solve(Mat::<f64>::identity(n, n)));
    let mut first = 0;
    let mut found = Vec::new();
    for pole in poles {
        let pair = pole.value.im > 0.0;
        let deviation = covariance.as_ref().filter(|_| pair).map(|of| {
            let entry = |i: usize, j: usize| of[(first + i, first + j)] / (scale[first + i] * scale[first + j]);
            let [hz, zeta] = gradients(pole.value, time);
            let variance =
                |g: [f64; 2]| (0..4).map(|k| g[k / 2] * entry(k / 2, k % 2) * g[k % 2]).sum::<f64>().max(0.0).sqrt();
            [variance(hz), variance(zeta)]
        });
        found.push((pole.mode, deviation));
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
