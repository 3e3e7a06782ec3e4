//! Levenberg-Marquardt: the damped least-squares step, and the damping from step to step.
//!
//! ```text
//! min |r - J s|^2 + damping |D s|^2,     J' J + damping D' D by orthogonal transformation of [J; sqrt(damping) D]
//! ```
//! with D the lengths of the columns of J, so that units of parameters do not matter (J. J. More, in Numerical Analysis,
//! Lecture Notes in Mathematics 630 (1978), 105). The damping follows the ratio of the actual to the predicted decrease (H.
//! B. Nielsen, Damping parameter in Marquardt's method, IMM-REP-1999-05, Technical University of Denmark).

use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, MatRef};

/// Least damping, relative to the squared lengths of the columns: what keeps the step finite where the columns of J depend on each other, and
/// below the rounding of J' J.
pub(crate) const LEAST_DAMPING: f64 = 1e-20;

/// The damping and how fast it grows.
#[derive(Debug, Clone, Copy)]
pub struct Damping {
    value: f64,
    growth: f64,
}

/// What came of a trial step.
#[derive(Debug, Clone, Copy)]
pub enum Trial<T> {
    /// It lowers the criterion.
    Lower {
        /// Where it leads.
        point: T,
        /// Actual over predicted decrease.
        ratio: f64,
    },
    /// It does not lower the criterion.
    Rejected,
    /// It is too small, or promises too little, to be tried.
    Negligible,
}

impl Damping {
    /// The damping of the first step, relative to the squared lengths of the columns of J.
    pub fn new(value: f64) -> Self {
        Damping { value, growth: 2.0 }
    }

    /// One step: trials with growing damping until one lowers the criterion; `None` where their steps become negligible before.
    ///
    /// `trial` makes the step for a damping and judges it.
    pub fn descend<T>(&mut self, mut trial: impl FnMut(f64) -> Trial<T>) -> Option<T> {
        loop {
            match trial(self.value) {
                Trial::Lower { point, ratio } => {
                    let factor = 1.0 - (2.0 * ratio.clamp(0.0, 1.0) - 1.0).powi(3);
                    self.value = (self.value * factor.max(1.0 / 3.0)).max(LEAST_DAMPING);
                    self.growth = 2.0;
                    return Some(point);
                }
                Trial::Rejected => {
                    self.value *= self.growth;
                    self.growth *= 2.0;
                }
                Trial::Negligible => return None,
            }
        }
    }
}

/// The damped step, one column; `scale` is the diagonal of D, one where it is zero.
///
/// ```
/// # use youla::{Mat, linalg::{damped_step, decrease}};
/// let jacobian = Mat::from_fn(2, 1, |i, _| if i == 0 { 3.0 } else { 4.0 });
/// let residual = Mat::from_fn(2, 1, |i, _| if i == 0 { 6.0 } else { 8.0 });
/// let step = damped_step(jacobian.as_ref(), residual.as_ref(), &[5.0], 1.0);
/// assert!((step[(0, 0)] - 1.0).abs() < 1e-14); // the undamped one is 2
/// assert!((decrease(jacobian.as_ref(), residual.as_ref(), &step) - 75.0).abs() < 1e-12);
/// ```
pub fn damped_step(jacobian: MatRef<'_, f64>, residual: MatRef<'_, f64>, scale: &[f64], damping: f64) -> Mat<f64> {
    let (rows, columns) = (jacobian.nrows(), jacobian.ncols());
    if columns == 0 {
        return Mat::zeros(0, 1);
    }
    let length = |j: usize| if scale[j] > 0.0 { scale[j] } else { 1.0 };
    let damped = Mat::from_fn(rows + columns, columns, |i, j| match i.checked_sub(rows) {
        None => jacobian[(i, j)],
        Some(k) if k == j => damping.sqrt() * length(j),
        Some(_) => 0.0,
    });
    let target = Mat::from_fn(rows + columns, 1, |i, _| if i < rows { residual[(i, 0)] } else { 0.0 });
    damped.qr().solve_lstsq(&target)
}

/// `|r|^2 - |r - J s|^2`, what a step lowers the sum of squares by to first order.
pub fn decrease(jacobian: MatRef<'_, f64>, residual: MatRef<'_, f64>, step: &Mat<f64>) -> f64 {
    residual.squared_norm_l2() - (residual - jacobian * step).squared_norm_l2()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, r = (1 - x, 10 (y - x^2)), from (-1.2, 1): the minimum (1, 1) within 40 steps.
    #[test]
    fn the_minimum_of_a_curved_valley_is_found() {
        let residual = |p: &[f64; 2]| Mat::from_fn(2, 1, |i, _| [1.0 - p[0], 10.0 * (p[1] - p[0] * p[0])][i]);
        let (mut point, mut damping, mut steps) = ([-1.2, 1.0], Damping::new(1e-3), 0);
        loop {
            let jacobian = Mat::from_fn(2, 2, |i, j| [[1.0, 0.0], [20.0 * point[0], -10.0]][i][j]);
            let (r, scale) = (residual(&point), [jacobian.col(0).norm_l2(), 10.0]);
            let better = damping.descend(|value| {
                let step = damped_step(jacobian.as_ref(), r.as_ref(), &scale, value);
                let promised = decrease(jacobian.as_ref(), r.as_ref(), &step);
                let trial = [point[0] + step[(0, 0)], point[1] + step[(1, 0)]];
                let gain = r.squared_norm_l2() - residual(&trial).squared_norm_l2();
                match promised {
                    p if p < 1e-20 => Trial::Negligible,
                    p if gain > 0.0 => Trial::Lower { point: trial, ratio: gain / p },
                    _ => Trial::Rejected,
                }
            });
            let Some(better) = better else { break };
            (point, steps) = (better, steps + 1);
        }
        assert!((point[0] - 1.0).abs() < 1e-9 && (point[1] - 1.0).abs() < 1e-9 && steps < 40, "{point:?} {steps}");
    }

    /// Columns that depend on each other: the step is finite and shared by both.
    #[test]
    fn dependent_columns_share_the_step() {
        let jacobian = Mat::from_fn(3, 2, |i, _| 1.0 + i as f64);
        let residual = Mat::from_fn(3, 1, |i, _| 2.0 + 2.0 * i as f64);
        let step = damped_step(jacobian.as_ref(), residual.as_ref(), &[14.0_f64.sqrt(); 2], LEAST_DAMPING);
        assert!((step[(0, 0)] - 1.0).abs() < 1e-4 && (step[(1, 0)] - 1.0).abs() < 1e-4, "{step:?}");
    }
}
