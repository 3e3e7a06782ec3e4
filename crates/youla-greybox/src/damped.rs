//! The damped least-squares step, and the damping from step to step.
//!
//! ```text
//! min |r - J step|^2 + damping |D step|^2,     J' J + damping D' D by orthogonal transformation of [J; sqrt(damping) D]
//! ```
//! with D the lengths of the columns of J, so that units of parameters do not matter (J. J. More, in Numerical Analysis,
//! Lecture Notes in Mathematics 630 (1978), 105). The damping follows the ratio of the actual to the predicted decrease (H.
//! B. Nielsen, Damping parameter in Marquardt's method, IMM-REP-1999-05, Technical University of Denmark).

use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, MatRef};

/// The damping and how fast it grows.
pub(super) struct Damping {
    pub(super) value: f64,
    growth: f64,
}

impl Damping {
    pub(super) fn new(value: f64) -> Self {
        Damping { value, growth: 2.0 }
    }

    /// After a success with the given ratio of actual to predicted decrease.
    pub(super) fn relax(&mut self, ratio: f64) {
        self.value *= (1.0 - (2.0 * ratio.clamp(0.0, 1.0) - 1.0).powi(3)).max(1.0 / 3.0);
        self.growth = 2.0;
    }

    /// After a failure.
    pub(super) fn tighten(&mut self) {
        self.value *= self.growth;
        self.growth *= 2.0;
    }
}

/// The step, one column; `scale` is the diagonal of D.
pub(super) fn damped_step(
    jacobian: MatRef<'_, f64>,
    residual: MatRef<'_, f64>,
    scale: impl Fn(usize) -> f64,
    damping: f64,
) -> Mat<f64> {
    let (rows, columns) = (jacobian.nrows(), jacobian.ncols());
    let damped = Mat::from_fn(rows + columns, columns, |i, j| match i.checked_sub(rows) {
        None => jacobian[(i, j)],
        Some(k) if k == j => damping.sqrt() * scale(j),
        Some(_) => 0.0,
    });
    let target = Mat::from_fn(rows + columns, 1, |i, _| if i < rows { residual[(i, 0)] } else { 0.0 });
    damped.qr().solve_lstsq(&target)
}

/// `|D theta|`.
pub(super) fn length(theta: &[f64], scale: &[f64]) -> f64 {
    theta.iter().zip(scale).map(|(theta, scale)| (theta * scale).powi(2)).sum::<f64>().sqrt()
}
