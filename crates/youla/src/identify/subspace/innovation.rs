//! Kalman gain and innovation covariance from the residuals of the state and output equations.
//!
//! With `[Q S; S' R]` the Gram matrix of the residuals `[w; v]` (positive semidefinite by construction),
//! ```text
//! P = A P A' + Q - K Lambda K',   K = (A P C' + S) Lambda^-1,   Lambda = C P C' + R
//! ```
//! (Van Overschee and De Moor, section 3.4). The residuals are those of a filter that has seen s samples: the gain is biased
//! where `(A - K C)^s` is not small. Where no stabilising solution exists this is said, and no gain is returned.

use crate::identify::subspace::output_pair::OutputPair;
use crate::linalg::{RiccatiProblem, dare};
use crate::{Error, Result};
use faer::{Mat, MatRef, Side};

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

    /// The gain with rows for so many states of delays, which the innovations do not reach.
    pub(super) fn beside_delays(self, states: usize) -> Innovation {
        match self {
            Innovation::Found { gain, covariance, residual } => {
                let n = gain.nrows();
                let row = |i: usize, j: usize| if i < n { gain[(i, j)] } else { 0.0 };
                let gain = Mat::from_fn(n + states, gain.ncols(), row);
                Innovation::Found { gain, covariance, residual }
            }
            none => none,
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

/// The innovation model from the residuals `[w v]` of the state and output equations and the outputs themselves, in the
/// coordinates of a triangular factor of so many columns; or why there is none.
pub(super) fn identify(
    residuals: Result<Mat<f64>>,
    outputs: MatRef<'_, f64>,
    columns: usize,
    pair: &OutputPair,
) -> Innovation {
    let none = |reason| Innovation::None { reason };
    let noise = match residuals.and_then(|residuals| noise_model(residuals.as_ref(), outputs, columns)) {
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
fn noise_model(residuals: MatRef<'_, f64>, outputs: MatRef<'_, f64>, columns: usize) -> Result<Option<NoiseModel>> {
    let (p, samples) = (outputs.ncols(), columns as f64);
    let n = residuals.ncols() - p;
    let moments = |rows: MatRef<'_, f64>| {
        let gram = rows.transpose() * rows;
        Mat::from_fn(gram.nrows(), gram.ncols(), |i, j| 0.5 * (gram[(i, j)] + gram[(j, i)]) / samples)
    };
    let all = moments(residuals);
    let power = moments(outputs);
    let part = |i, j, rows, columns| all.as_ref().submatrix(i, j, rows, columns).to_owned();
    let noise = NoiseModel { q: part(0, 0, n, n), s: part(0, n, n, p), r: part(n, n, p, p) };
    let relative = Mat::from_fn(p, p, |i, j| noise.r[(i, j)] / (power[(i, i)] * power[(j, j)]).sqrt());
    let failed =
        |_| Error::NoConvergence { what: "the eigenvalues of the output noise covariance".into(), iterations: 0 };
    let least = relative.self_adjoint_eigenvalues(Side::Lower).map_err(failed)?[0];
    Ok((least > NOISE_FREE).then_some(noise))
}

/// The stabilising P by the dual regulator equation, and `Lambda = C P C' + R`.
fn kalman(pair: &OutputPair, noise: &NoiseModel) -> Result<Gain> {
    let problem = RiccatiProblem {
        a: pair.a.transpose(),
        b: pair.c.transpose(),
        q: noise.q.as_ref(),
        r: noise.r.as_ref(),
        s: Some(noise.s.as_ref()),
    };
    let solution = dare("the innovations", &problem)?;
    let covariance = &pair.c * &solution.x * pair.c.transpose() + &noise.r;
    Ok(Gain { gain: solution.gain.transpose().to_owned(), covariance, residual: solution.relative_residual })
}
