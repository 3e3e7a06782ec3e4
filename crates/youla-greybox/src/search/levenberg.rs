//! Levenberg-Marquardt on the triangular factor of `[J r]`.
//!
//! The step and its damping are those of [`youla::linalg::damped_step`]; the lengths of the columns of J are their largest so far.
//!
//! A parameter that its bound holds back stays for the step (`bounds.rs`); one that the step would take beyond a bound goes
//! to that bound, and the others take the step that is best with it there.

use crate::Result;
use crate::prediction::linearisation::Linearisation;
use crate::search::bounds::Bounds;
use crate::search::criterion::{Criterion, Point};
use crate::{GreyBoxOptions, Stop};
use faer::Mat;
use youla::linalg::{Damping, Trial, damped_step, decrease};

/// The residual is nothing but rounding below this share of the output.
const ROUNDING: f64 = 1e-12;

/// Where the search ended.
pub(crate) struct Outcome {
    pub(crate) point: Point,
    pub(crate) linearisation: Linearisation,
    pub(crate) face: Face,
    pub(crate) stop: Stop,
    pub(crate) work: Work,
}

/// What it took.
#[derive(Default)]
pub(crate) struct Work {
    /// Steps that lowered the criterion.
    pub(crate) iterations: usize,
    /// Values of the criterion.
    pub(crate) evaluations: usize,
    /// Values that were not finite.
    pub(crate) diverged: usize,
}

/// The parameters that no bound holds back, and the linearised criterion where only they move.
pub(crate) struct Face {
    pub(crate) free: Vec<usize>,
    pub(crate) here: Linearisation,
}

/// Minimises the criterion within the bounds from `start`.
pub(crate) fn minimise(
    criterion: &Criterion<'_>,
    bounds: &Bounds,
    start: &[f64],
    options: &GreyBoxOptions,
) -> Result<Outcome> {
    let mut work = Work { evaluations: 1, ..Work::default() };
    let mut point = criterion.evaluate(start)?;
    let mut scale = vec![0.0; criterion.parameters];
    let mut damping = Damping::new(options.damping);
    loop {
        let linearisation = criterion.linearise(&point)?;
        enlarge(&mut scale, &linearisation, &criterion.scales);
        let free = bounds.free(&point.theta, &linearisation);
        let face = Face { here: linearisation.along(&free), free };
        let next = match terminal(criterion, &point, &face.here, options) {
            Some(stop) => Err(stop),
            None if work.iterations == options.max_iterations => Err(Stop::Iterations),
            None => {
                let search = Search { criterion, bounds, point: &point, face: &face, scale: &scale, options };
                damping.descend(|damping| search.tried(damping, &mut work)).ok_or(Stop::StepTooSmall)
            }
        };
        match next {
            Ok(better) => (point, work.iterations) = (better, work.iterations + 1),
            Err(stop) => return Ok(Outcome { point, linearisation, face, stop, work }),
        }
    }
}

/// Whether the point is a minimum to the accuracy of the data or of the arithmetic.
fn terminal(criterion: &Criterion<'_>, point: &Point, here: &Linearisation, options: &GreyBoxOptions) -> Option<Stop> {
    if 2.0 * point.cost <= ROUNDING * ROUNDING * criterion.energy {
        Some(Stop::Exact)
    } else if here.relative_offset(criterion.degrees_of_freedom) <= options.offset_tolerance {
        Some(Stop::Converged)
    } else {
        None
    }
}

/// Everything that a step starts from.
struct Search<'a> {
    criterion: &'a Criterion<'a>,
    bounds: &'a Bounds,
    point: &'a Point,
    face: &'a Face,
    scale: &'a [f64],
    options: &'a GreyBoxOptions,
}

impl Search<'_> {
    /// The step with a damping.
    fn tried(&self, damping: f64, work: &mut Work) -> Trial<Point> {
        let step = self.step_within_bounds(damping);
        if length(&step.step, self.scale) <= self.options.step_tolerance * length(&self.point.theta, self.scale) {
            return Trial::Negligible;
        }
        work.evaluations += 1;
        match self.criterion.evaluate(&step.theta) {
            Ok(point) if point.cost < self.point.cost => {
                let ratio = (self.point.cost - point.cost) / step.predicted;
                Trial::Lower { point, ratio }
            }
            Ok(_) => Trial::Rejected,
            Err(_) => {
                work.diverged += 1;
                Trial::Rejected
            }
        }
    }

    /// The damped step; parameters that it takes beyond a bound go there, until none is left that does.
    fn step_within_bounds(&self, damping: f64) -> Step {
        let mut landed = vec![None; self.face.free.len()];
        loop {
            let step = self.step(damping, &landed);
            let mut inside = true;
            for (landed, parameter) in landed.iter_mut().zip(&self.face.free) {
                if landed.is_none() {
                    *landed = self.bounds.crossed(*parameter, step.theta[*parameter]);
                    inside &= landed.is_none();
                }
            }
            if inside {
                return step;
            }
        }
    }

    /// The damped Gauss-Newton step of the free parameters with those that have landed at a bound.
    fn step(&self, damping: f64, landed: &[Option<f64>]) -> Step {
        let (jacobian, residual) = (self.face.here.jacobian(), self.face.here.residual());
        let (free, theta) = (&self.face.free, &self.point.theta);
        let mut step = Mat::from_fn(free.len(), 1, |k, _| landed[k].map_or(0.0, |bound| bound - theta[free[k]]));
        let moving: Vec<usize> = (0..free.len()).filter(|k| landed[*k].is_none()).collect();
        if !moving.is_empty() {
            let columns = Mat::from_fn(jacobian.nrows(), moving.len(), |i, j| jacobian[(i, moving[j])]);
            let wanted = if moving.len() == free.len() { residual.to_owned() } else { residual - jacobian * &step };
            let scale: Vec<f64> = moving.iter().map(|k| self.scale[free[*k]]).collect();
            let solved = damped_step(columns.as_ref(), wanted.as_ref(), &scale, damping);
            moving.iter().enumerate().for_each(|(j, k)| step[(*k, 0)] = solved[(j, 0)]);
        }
        let predicted = 0.5 * decrease(jacobian, residual, &step);
        let mut found = Step { step: vec![0.0; theta.len()], theta: theta.clone(), predicted };
        for (k, parameter) in free.iter().enumerate() {
            found.step[*parameter] = step[(k, 0)];
            found.theta[*parameter] = landed[k].unwrap_or(theta[*parameter] + step[(k, 0)]);
        }
        found
    }
}

/// A damped Gauss-Newton step.
struct Step {
    step: Vec<f64>,
    /// Where it leads.
    theta: Vec<f64>,
    /// Decrease of the linearised criterion.
    predicted: f64,
}

/// `|D theta|`.
pub(crate) fn length(theta: &[f64], scale: &[f64]) -> f64 {
    theta.iter().zip(scale).map(|(theta, scale)| (theta * scale).powi(2)).sum::<f64>().sqrt()
}

/// The lengths of the columns of J where they exceed those before; one over the typical size of a parameter that has no
/// effect so far.
fn enlarge(scale: &mut [f64], here: &Linearisation, typical: &[f64]) {
    for ((scale, column), typical) in scale.iter_mut().zip(here.jacobian().col_iter()).zip(typical) {
        *scale = scale.max(column.norm_l2());
        if *scale == 0.0 {
            *scale = 1.0 / typical;
        }
    }
}
