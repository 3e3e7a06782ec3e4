//! Kalman gain and innovation covariance from the residuals of the state and output equations.
//!
//! With `[Q S; S' R]` the Gram matrix of the residuals `[w; v]` (positive semidefinite by construction),
//! ```text
//! P = A P A' + Q - K Lambda K',   K = (A P C' + S) Lambda^-1,   Lambda = C P C' + R
//! ```
//! (Van Overschee and De Moor, section 3.4). Where no stabilising solution exists this is said, and no gain is returned.

use super::realisation::{OutputPair, StateSequences};
use crate::linalg::{check_finite, eigenvalues, solve, solve_right};
use crate::{Error, Result};
use faer::{Mat, MatRef, Side, c64};

/// Residual powers below this share of the output power are rounding.
const NOISE_FREE: f64 = 1e-20;

/// The stochastic part of the model: `x+ = A x + B u + K e, y = C x + D u + e`.
#[derive(Debug, Clone)]
pub enum Innovation {
    /// There is a Kalman gain, and A - K C is stable.
    Found {
        /// Gain K, n x p.
        gain: Mat<f64>,
        /// Covariance of the innovations e, p x p.
        covariance: Mat<f64>,
        /// Relative residual of the Riccati equation.
        residual: f64,
    },
    /// There is none.
    None {
        /// Why.
        reason: NoInnovation,
    },
}

/// Why there is no Kalman gain.
#[derive(Debug, Clone, PartialEq)]
pub enum NoInnovation {
    /// The model explains an output to working precision; no noise is left to model.
    NoiseFree,
    /// The Riccati equation has no solution for which A - K C is stable; the equation's own words.
    NotSolvable(String),
}

impl Innovation {
    /// The Kalman gain, if there is one.
    pub fn gain(&self) -> Option<MatRef<'_, f64>> {
        match self {
            Innovation::Found { gain, .. } => Some(gain.as_ref()),
            Innovation::None { .. } => None,
        }
    }

    /// The covariance of the innovations, if there is a gain.
    pub fn covariance(&self) -> Option<MatRef<'_, f64>> {
        match self {
            Innovation::Found { covariance, .. } => Some(covariance.as_ref()),
            Innovation::None { .. } => None,
        }
    }

    /// Back into the units of the record.
    pub(super) fn unscale(self, y: &[f64]) -> Self {
        match self {
            Innovation::Found { gain, covariance, residual } => Innovation::Found {
                gain: Mat::from_fn(gain.nrows(), gain.ncols(), |i, j| gain[(i, j)] / y[j]),
                covariance: Mat::from_fn(y.len(), y.len(), |i, j| y[i] * covariance[(i, j)] * y[j]),
                residual,
            },
            none => none,
        }
    }
}

/// Second moments of the residuals.
struct NoiseModel {
    /// State noise, n x n.
    q: Mat<f64>,
    /// Between state and output noise, n x p.
    s: Mat<f64>,
    /// Output noise, p x p.
    r: Mat<f64>,
}

/// The gain of a stable predictor and the covariance that belongs to it.
struct Gain {
    gain: Mat<f64>,
    covariance: Mat<f64>,
    residual: f64,
}

/// The innovation model, or why there is none.
pub(super) fn identify(states: &StateSequences<'_>, pair: &OutputPair) -> Innovation {
    let none = |reason| Innovation::None { reason };
    let noise = match noise_model(states, pair) {
        Ok(Some(noise)) => noise,
        Ok(None) => return none(NoInnovation::NoiseFree),
        Err(error) => return none(NoInnovation::NotSolvable(error.to_string())),
    };
    match kalman(pair, &noise) {
        Ok(Gain { gain, covariance, residual }) => Innovation::Found { gain, covariance, residual },
        Err(error) => none(NoInnovation::NotSolvable(error.to_string())),
    }
}

/// A gain that stabilises A - K C whatever the noise: that of unit covariances.
pub(super) fn observer_gain(pair: &OutputPair) -> Result<Mat<f64>> {
    let (n, p) = (pair.a.nrows(), pair.c.nrows());
    let unit = NoiseModel { q: Mat::identity(n, n), s: Mat::zeros(n, p), r: Mat::identity(p, p) };
    Ok(kalman(pair, &unit)?.gain)
}

/// `None` where an output leaves no residual.
fn noise_model(states: &StateSequences<'_>, pair: &OutputPair) -> Result<Option<NoiseModel>> {
    let residuals = states.residuals(pair)?;
    let (n, p, samples) = (pair.a.nrows(), pair.c.nrows(), states.columns as f64);
    let moments = |rows: MatRef<'_, f64>| {
        let gram = rows.transpose() * rows;
        Mat::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] / samples)
    };
    let all = moments(residuals.as_ref());
    let power = moments(states.target.as_ref().subcols(n, p));
    let part = |i, j, rows, columns| all.as_ref().submatrix(i, j, rows, columns).to_owned();
    let noise = NoiseModel { q: part(0, 0, n, n), s: part(0, n, n, p), r: part(n, n, p, p) };
    let relative = Mat::from_fn(p, p, |i, j| noise.r[(i, j)] / (power[(i, i)] * power[(j, j)]).sqrt());
    let failed =
        |_| Error::NoConvergence { what: "the eigenvalues of the output noise covariance".into(), iterations: 0 };
    let least = relative.self_adjoint_eigenvalues(Side::Lower).map_err(failed)?[0];
    Ok((least > NOISE_FREE).then_some(noise))
}

/// `K = (A P C' + S) Lambda^-1` with the stabilising P.
fn kalman(pair: &OutputPair, noise: &NoiseModel) -> Result<Gain> {
    let (a, c) = (&pair.a, &pair.c);
    let p = riccati(pair, noise)?;
    let covariance = c * &p * c.transpose() + &noise.r;
    let cross = a * &p * c.transpose() + &noise.s;
    let gain = solve_right("the innovation covariance", covariance.as_ref(), cross.as_ref())?;
    let next = a * &p * a.transpose() + &noise.q - &gain * cross.transpose();
    let residual = (&next - &p).norm_l2() / p.norm_l2().max(noise.q.norm_l2()).max(f64::MIN_POSITIVE);
    let predictor = a - &gain * c;
    let poles = eigenvalues("the predictor", predictor.as_ref())?;
    let worst = poles.iter().copied().fold(c64::new(0.0, 0.0), |w, z| if z.norm() > w.norm() { z } else { w });
    if worst.norm() >= 1.0 || !(residual < 1e-6) {
        let condition =
            format!("no solution makes A - K C stable (its largest pole has magnitude {:.6})", worst.norm());
        return Err(Error::NoSolution { what: "the Riccati equation of the innovations".into(), condition, residual });
    }
    Ok(Gain { gain, covariance, residual })
}

/// The stabilising P by the structure-preserving doubling algorithm (Chu, Fan, Lin, Wang, Int. J. Control 77, 767, 2004).
fn riccati(pair: &OutputPair, noise: &NoiseModel) -> Result<Mat<f64>> {
    let n = pair.a.nrows();
    let whitened = solve("the output noise covariance", noise.r.as_ref(), block_row(&pair.c, &noise.s).as_ref())?;
    let (rc, rs) = (whitened.as_ref().subcols(0, n), whitened.as_ref().subcols(n, n));
    let mut a = (&pair.a - &noise.s * rc).transpose().to_owned();
    let mut g = pair.c.transpose() * rc;
    let mut h = &noise.q - &noise.s * rs;
    for _ in 0..60 {
        let w =
            solve("the doubling step", (Mat::<f64>::identity(n, n) + &g * &h).as_ref(), block_row(&a, &g).as_ref())?;
        let (wa, wg) = (w.as_ref().subcols(0, n), w.as_ref().subcols(n, n));
        let step = a.transpose() * &h * wa;
        g = &g + &a * wg * a.transpose();
        a = &a * wa;
        h = &h + &step;
        check_finite("the solution of the Riccati equation", h.as_ref())?;
        if step.norm_l2() <= 1e-15 * h.norm_l2() {
            return Ok(Mat::from_fn(n, n, |i, j| 0.5 * (h[(i, j)] + h[(j, i)])));
        }
    }
    Err(Error::NoConvergence { what: "the Riccati equation of the innovations".into(), iterations: 60 })
}

/// `[C S']`.
fn block_row(c: &Mat<f64>, s: &Mat<f64>) -> Mat<f64> {
    crate::linalg::block(&[&[c.as_ref(), if c.nrows() == s.nrows() { s.as_ref() } else { s.transpose() }]])
}
