//! D in a closed loop. Where the controller answers in the same sample, `u(t) = K_d y(t) + ...`, the input holds the noise of its own
//! sample, and least squares would take this for a feedthrough. The likelihood of y given the excitation does not:
//!
//! ```text
//! v = y - D u - ... = (I - D K_d) y - ...,      -2 log likelihood = N log det Lambda - 2 N log |det (I - D K_d)|
//! ```
//! so that D is found from (u, y) where K_d is known, and only there. An input at a limit answers nothing: N counts the other samples.

use super::model::Model;
use crate::linalg::TINY;
use faer::Mat;
use faer::prelude::*;

/// What the controller answers in the same sample.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    /// K_d, m x p; without entries where it is not known.
    pub(crate) gain: Mat<f64>,
    /// Share of the samples in which no input is at a limit.
    pub(crate) share: f64,
}

impl Answer {
    pub(crate) fn unknown() -> Self {
        Answer { gain: Mat::new(), share: 1.0 }
    }
}

/// `log |det (I - D K_d)|` per sample of the record; 0 without D.
pub(crate) fn log_loop(model: &Model, Answer { gain, share }: &Answer) -> f64 {
    if model.d.iter().all(|d| *d == 0.0) || gain.nrows() != model.inputs {
        return 0.0;
    }
    share * around(model, gain).determinant().abs().max(TINY).ln()
}

/// Slopes of `-log |det (I - D K_d)|` per sample in the entries of D, row by row: those of `K_d (I - D K_d)^-1`, transposed.
pub(crate) fn slopes(model: &Model, Answer { gain, share }: &Answer) -> Vec<f64> {
    let (m, p) = (model.inputs, model.outputs);
    if gain.nrows() != m {
        return vec![0.0; m * p];
    }
    let right = around(model, gain).transpose().partial_piv_lu().solve(gain.transpose());
    (0..p * m).map(|x| share * right[(x / m, x % m)]).collect()
}

fn around(model: &Model, direct: &Mat<f64>) -> Mat<f64> {
    let (m, p) = (model.inputs, model.outputs);
    let product = |i: usize, j: usize| (0..m).map(|l| model.d[i * m + l] * direct[(l, j)]).sum::<f64>();
    Mat::from_fn(p, p, |i, j| if i == j { 1.0 } else { 0.0 } - product(i, j))
}
