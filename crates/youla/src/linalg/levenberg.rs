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

/// Least share of a refused step at which another is tried: the value may rise with a higher power than the second.
const LEAST_SHARE: f64 = 0.2;
/// Growth of the damping on the way to a step that promises little enough.
const FINE_GROWTH: f64 = 2.0;

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
                    self.lower(ratio);
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

    /// The same where a trial costs more than its step. After a refused step the next one tried promises what the share s of it would with the least
    /// value on the parabola through value, slope and refused value:
    ///
    /// ```text
    /// gain(s) = 2 P s - (2 P - gain(1)) s^2,     s = P / (2 P - gain(1)),     promise s (2 - s) P
    /// ```
    ///
    /// `step` makes one for a damping, with its predicted decrease P; `judge` gives the actual decrease. `None` where P is at most `negligible` or not
    /// a number.
    pub(crate) fn descend_sparingly<S, T>(
        &mut self,
        negligible: f64,
        mut step: impl FnMut(f64) -> (S, f64),
        mut judge: impl FnMut(S) -> Option<(T, f64)>,
    ) -> Option<T> {
        let mut limit = f64::INFINITY;
        loop {
            let (trial, promised) = step(self.value);
            if promised.is_nan() || promised <= negligible {
                return None;
            }
            if promised <= limit {
                let judged = judge(trial);
                let gain = judged.as_ref().map_or(f64::NEG_INFINITY, |(_, gain)| *gain);
                if let Some((point, gain)) = judged.filter(|_| gain > 0.0) {
                    self.lower(gain / promised);
                    return Some(point);
                }
                let share = (promised / (2.0 * promised - gain)).max(LEAST_SHARE);
                limit = share * (2.0 - share) * promised;
            }
            self.value *= FINE_GROWTH;
        }
    }

    /// After a step with such an actual over its predicted decrease.
    fn lower(&mut self, ratio: f64) {
        let factor = 1.0 - (2.0 * ratio.clamp(0.0, 1.0) - 1.0).powi(3);
        self.value = (self.value * factor.max(1.0 / 3.0)).max(LEAST_DAMPING);
        self.growth = 2.0;
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

    /// r = (1 - exp(x), -(x + 8) / 1e6) from -8, where the first step is some hundred times too long: the minimum near 0 in at most 40 trials, each
    /// after a refused one promising less as the parabola says.
    #[test]
    fn refused_steps_are_followed_by_distinctly_shorter_ones() {
        let residual = |x: f64| Mat::from_fn(2, 1, |i, _| [1.0 - x.exp(), -(x + 8.0) * 1e-6][i]);
        let (mut x, mut damping, mut trials) = (-8.0_f64, Damping::new(1e-6), 0);
        loop {
            let jacobian = Mat::from_fn(2, 1, |i, _| [x.exp(), 1e-6][i]);
            let (r, scale) = (residual(x), [jacobian.col(0).norm_l2()]);
            let step = |value: f64| {
                let step = damped_step(jacobian.as_ref(), r.as_ref(), &scale, value);
                let promised = decrease(jacobian.as_ref(), r.as_ref(), &step);
                ((x + step[(0, 0)], promised), promised)
            };
            let mut refused = f64::INFINITY;
            let lower = damping.descend_sparingly(1e-14, step, |(trial, promised)| {
                assert!(promised <= 0.75 * refused, "{promised} after {refused}");
                (trials, refused) = (trials + 1, promised);
                Some((trial, r.squared_norm_l2() - residual(trial).squared_norm_l2()))
            });
            let Some(lower) = lower else { break };
            x = lower;
        }
        assert!(x.abs() < 1e-6 && trials <= 40, "{x}, {trials}");
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
