//! Levenberg-Marquardt on the triangular factor of `[J r]`.
//!
//! The step solves `min |r - J step|^2 + damping |D step|^2` by orthogonal transformation of `[J; sqrt(damping) D]`, D the
//! lengths of the columns of J (their largest so far), so that units of parameters do not matter (J. J. More, in Numerical
//! Analysis, Lecture Notes in Mathematics 630 (1978), 105). The damping follows the ratio of the actual to the predicted
//! decrease (H. B. Nielsen, Damping parameter in Marquardt's method, IMM-REP-1999-05, Technical University of Denmark).

use super::criterion::{Criterion, Linearisation, Point};
use super::{GreyBoxOptions, Stop};
use crate::Result;
use faer::Mat;
use faer::prelude::*;

/// The residual is nothing but rounding below this share of the output.
const ROUNDING: f64 = 1e-12;

/// Where the search ended.
pub(super) struct Outcome {
    pub(super) point: Point,
    pub(super) linearisation: Linearisation,
    pub(super) stop: Stop,
    pub(super) work: Work,
}

/// What it took.
#[derive(Default)]
pub(super) struct Work {
    /// Steps that lowered the criterion.
    pub(super) iterations: usize,
    /// Values of the criterion.
    pub(super) evaluations: usize,
    /// Values that were not finite.
    pub(super) diverged: usize,
}

/// Minimises the criterion from `start`.
pub(super) fn minimise(criterion: &Criterion<'_>, start: &[f64], options: &GreyBoxOptions) -> Result<Outcome> {
    let mut work = Work { evaluations: 1, ..Work::default() };
    let mut point = criterion.evaluate(start)?;
    let mut scale = vec![0.0; criterion.parameters];
    let mut damping = Damping { value: options.damping, growth: 2.0 };
    loop {
        let linearisation = criterion.linearise(&point)?;
        enlarge(&mut scale, &linearisation);
        let next = match terminal(criterion, &point, &linearisation, options) {
            Some(stop) => Err(stop),
            None if work.iterations == options.max_iterations => Err(Stop::Iterations),
            None => descend(criterion, &point, &linearisation, &scale, options, &mut damping, &mut work),
        };
        match next {
            Ok(better) => (point, work.iterations) = (better, work.iterations + 1),
            Err(stop) => return Ok(Outcome { point, linearisation, stop, work }),
        }
    }
}

/// Whether the point is a minimum as far as the data or the arithmetic can tell.
fn terminal(criterion: &Criterion<'_>, point: &Point, here: &Linearisation, options: &GreyBoxOptions) -> Option<Stop> {
    if 2.0 * point.cost <= ROUNDING * ROUNDING * criterion.energy {
        Some(Stop::Exact)
    } else if here.relative_offset(criterion.degrees_of_freedom) <= options.offset_tolerance {
        Some(Stop::Converged)
    } else {
        None
    }
}

/// The next point with a lower criterion, with more damping after each trial that has none.
fn descend(
    criterion: &Criterion<'_>,
    point: &Point,
    here: &Linearisation,
    scale: &[f64],
    options: &GreyBoxOptions,
    damping: &mut Damping,
    work: &mut Work,
) -> Result<Point, Stop> {
    loop {
        let step = Step::new(here, scale, damping.value);
        if step.length(scale) <= options.step_tolerance * length(&point.theta, scale) {
            return Err(Stop::StepTooSmall);
        }
        let theta: Vec<f64> = point.theta.iter().zip(&step.step).map(|(theta, step)| theta + step).collect();
        work.evaluations += 1;
        match criterion.evaluate(&theta) {
            Ok(trial) if trial.cost < point.cost => {
                damping.relax((point.cost - trial.cost) / step.predicted);
                return Ok(trial);
            }
            Ok(_) => {}
            Err(_) => work.diverged += 1,
        }
        damping.tighten();
    }
}

/// The damping and how fast it grows.
struct Damping {
    value: f64,
    growth: f64,
}

impl Damping {
    /// After a success with the given ratio of actual to predicted decrease.
    fn relax(&mut self, ratio: f64) {
        self.value *= (1.0 - (2.0 * ratio.clamp(0.0, 1.0) - 1.0).powi(3)).max(1.0 / 3.0);
        self.growth = 2.0;
    }

    /// After a failure.
    fn tighten(&mut self) {
        self.value *= self.growth;
        self.growth *= 2.0;
    }
}

/// A damped Gauss-Newton step.
struct Step {
    step: Vec<f64>,
    /// Decrease of the linearised criterion.
    predicted: f64,
}

impl Step {
    fn new(here: &Linearisation, scale: &[f64], damping: f64) -> Self {
        let (jacobian, residual) = (here.jacobian(), here.residual());
        let (rows, q) = (jacobian.nrows(), jacobian.ncols());
        let damped = Mat::from_fn(rows + q, q, |i, j| match i.checked_sub(rows) {
            None => jacobian[(i, j)],
            Some(k) if k == j => damping.sqrt() * scale[j],
            Some(_) => 0.0,
        });
        let target = Mat::from_fn(rows + q, 1, |i, _| if i < rows { residual[(i, 0)] } else { 0.0 });
        let step = damped.qr().solve_lstsq(&target);
        let left = residual - jacobian * &step;
        let predicted = 0.5 * (residual.squared_norm_l2() - left.squared_norm_l2());
        Step { step: step.col(0).iter().copied().collect(), predicted }
    }

    fn length(&self, scale: &[f64]) -> f64 {
        length(&self.step, scale)
    }
}

/// `|D theta|`.
fn length(theta: &[f64], scale: &[f64]) -> f64 {
    theta.iter().zip(scale).map(|(theta, scale)| (theta * scale).powi(2)).sum::<f64>().sqrt()
}

/// The lengths of the columns of J where they exceed those before; 1 for a parameter that has no effect so far.
fn enlarge(scale: &mut [f64], here: &Linearisation) {
    for (scale, column) in scale.iter_mut().zip(here.jacobian().col_iter()) {
        *scale = scale.max(column.norm_l2());
        if *scale == 0.0 {
            *scale = 1.0;
        }
    }
}
