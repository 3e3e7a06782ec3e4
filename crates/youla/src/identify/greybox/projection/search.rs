//! Levenberg-Marquardt on the weighted misfit: the steps and the damping of `../levenberg.rs`.

use super::super::Stop;
use super::ProjectionOptions;
use super::misfit::{Misfit, Point};
use crate::Result;
use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, MatRef};

/// The misfit is nothing but rounding below this share of the response.
const ROUNDING: f64 = 1e-13;
/// Damping of the first step, relative to the squared lengths of the columns of the Jacobian.
const DAMPING: f64 = 1e-3;

/// Where a search ended.
pub(super) struct Outcome {
    pub(super) point: Point,
    pub(super) stop: Stop,
    pub(super) iterations: usize,
}

/// Minimises the misfit from a point.
pub(super) fn minimise(misfit: &Misfit<'_>, start: Point, options: &ProjectionOptions) -> Result<Outcome> {
    let mut point = start;
    let mut scale = vec![0.0_f64; misfit.parameters];
    let (mut damping, mut growth) = (DAMPING, 2.0);
    let mut iterations = 0;
    loop {
        let end = |point, stop| Ok(Outcome { point, stop, iterations });
        let factor = misfit.linearise(&point)?;
        let (jacobian, residual) = factor.as_ref().split_at_col(misfit.parameters);
        for (scale, column) in scale.iter_mut().zip(jacobian.col_iter()) {
            *scale = scale.max(column.norm_l2());
        }
        if point.cost.sqrt() <= ROUNDING * misfit.size {
            return end(point, Stop::Exact);
        }
        if removable(jacobian, residual) <= options.tolerance * residual.norm_l2() {
            return end(point, Stop::Converged);
        }
        if iterations == options.max_iterations {
            return end(point, Stop::Iterations);
        }
        loop {
            let step = damped_step(jacobian, residual, &scale, damping);
            let length = |v: &[f64]| v.iter().zip(&scale).map(|(v, s)| (v * s).powi(2)).sum::<f64>().sqrt();
            // Written so that a step that is not a number ends the search too.
            let moves = length(&step.step) > options.step_tolerance * length(&point.theta);
            if !moves {
                return end(point, Stop::StepTooSmall);
            }
            let theta: Vec<f64> = point.theta.iter().zip(&step.step).map(|(theta, step)| theta + step).collect();
            match misfit.evaluate(&theta) {
                Ok(trial) if trial.cost < point.cost => {
                    let ratio = ((point.cost - trial.cost) / step.predicted).clamp(0.0, 1.0);
                    damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0);
                    growth = 2.0;
                    (point, iterations) = (trial, iterations + 1);
                    break;
                }
                _ => (damping, growth) = (damping * growth, 2.0 * growth),
            }
        }
    }
}

/// Length of the part of the residual that a step can remove, to first order.
fn removable(jacobian: MatRef<'_, f64>, residual: MatRef<'_, f64>) -> f64 {
    let rank = crate::linalg::leading_rank(jacobian, jacobian.ncols());
    residual.subrows(0, rank).norm_l2()
}

struct Step {
    step: Vec<f64>,
    /// Decrease of the linearised cost.
    predicted: f64,
}

/// `min |r - J step|^2 + damping |D step|^2`.
fn damped_step(jacobian: MatRef<'_, f64>, residual: MatRef<'_, f64>, scale: &[f64], damping: f64) -> Step {
    let (rows, q) = (jacobian.nrows(), jacobian.ncols());
    let unit = |j: usize| if scale[j] > 0.0 { scale[j] } else { 1.0 };
    let damped = Mat::from_fn(rows + q, q, |i, j| match i.checked_sub(rows) {
        None => jacobian[(i, j)],
        Some(k) if k == j => damping.sqrt() * unit(j),
        Some(_) => 0.0,
    });
    let target = Mat::from_fn(rows + q, 1, |i, _| if i < rows { residual[(i, 0)] } else { 0.0 });
    let step = damped.qr().solve_lstsq(&target);
    let left = residual - jacobian * &step;
    let predicted = residual.squared_norm_l2() - left.squared_norm_l2();
    Step { step: step.col(0).iter().copied().collect(), predicted }
}
