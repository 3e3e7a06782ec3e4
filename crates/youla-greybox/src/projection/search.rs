//! Levenberg-Marquardt on the weighted misfit.

use super::ProjectionOptions;
use super::misfit::{Misfit, Point};
use crate::Result;
use crate::Stop;
use crate::search::levenberg::length;
use faer::MatRef;
use youla::linalg::{Damping, Trial, damped_step, decrease, leading_rank};

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
    let mut damping = Damping::new(DAMPING);
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
        let next = damping.descend(|damping| {
            let step = damped_step(jacobian, residual, &scale, damping);
            let predicted = decrease(jacobian, residual, &step);
            let step: Vec<f64> = step.col(0).iter().copied().collect();
            // Written so that a step that is not a number ends the search too.
            let moves = length(&step, &scale) > options.step_tolerance * length(&point.theta, &scale);
            if !moves {
                return Trial::Negligible;
            }
            let theta: Vec<f64> = point.theta.iter().zip(&step).map(|(theta, step)| theta + step).collect();
            match misfit.evaluate(&theta) {
                Ok(trial) if trial.cost < point.cost => {
                    let ratio = (point.cost - trial.cost) / predicted;
                    Trial::Lower { point: trial, ratio }
                }
                _ => Trial::Rejected,
            }
        });
        match next {
            Some(lower) => (point, iterations) = (lower, iterations + 1),
            None => return end(point, Stop::StepTooSmall),
        }
    }
}

/// Length of the part of the residual that a step can remove, to first order.
fn removable(jacobian: MatRef<'_, f64>, residual: MatRef<'_, f64>) -> f64 {
    let rank = leading_rank(jacobian, jacobian.ncols());
    residual.subrows(0, rank).norm_l2()
}
