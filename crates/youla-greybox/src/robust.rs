//! Residuals of which a few are far too large: the loss of Huber by iteratively reweighted least squares.
//!
//! ```text
//! min sum rho(e / s),   rho(r) = r^2 / 2 for |r| <= k, else k |r| - k^2 / 2
//! weights w = min(1, k s / |e|),   s = 1.4826 median |e - median e| per output,   psi = w e
//! cov theta = (sum psi^2 / (N p - unknowns)) / (mean psi')^2 (J' J)^-1
//! ```
//! (P. J. Huber, Robust Statistics, Wiley 1981, sections 7.6 to 7.8; P. W. Holland and R. E. Welsch, Communications in
//! Statistics A6 (1977), 813). A residual counts in full up to k deviations and with a constant pull beyond.

use super::bounds::Bounds;
use super::criterion::Criterion;
use super::levenberg::{Outcome, minimise};
use super::{GreyBoxOptions, Stop};
use crate::Result;
use serde::{Deserialize, Serialize};
use youla::statistics::{median, robust_deviation};

/// Deviations up to which a residual counts in full: 95 % efficiency where the noise is normal after all.
pub(super) const LIMIT: f64 = 1.345;
/// Largest number of weightings; some ten are usual.
const ROUNDS: usize = 50;

/// How residuals count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// By their square: the maximum-likelihood estimate for normal noise.
    #[default]
    Squares,
    /// By their square up to 1.345 deviations, by their magnitude beyond: for records with outliers.
    Huber,
}

/// What the loss of Huber made of the residuals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobustReport {
    /// How often the residuals were weighted.
    pub rounds: usize,
    /// Robust standard deviation of the residual of each output, in its units.
    pub deviations: Vec<f64>,
    /// Residuals of each output that count less than in full; 18 % of normal noise do.
    pub beyond: Vec<usize>,
}

/// The estimate with converged weights.
pub(super) struct Robust {
    pub(super) outcome: Outcome,
    pub(super) report: RobustReport,
    /// Factor of `(J' J)^-1` in the covariance, J without weights.
    pub(super) variance: f64,
}

/// Weights and minimises in turn from the least-squares estimate, until a weighting moves nothing.
pub(super) fn reweighted(
    criterion: &mut Criterion<'_>,
    bounds: &Bounds,
    options: &GreyBoxOptions,
    least_squares: Outcome,
) -> Result<Robust> {
    let mut outcome = least_squares;
    let mut rounds = 0;
    let mut converged = false;
    while !converged && rounds < ROUNDS {
        let weighting = Weighting::new(criterion.residuals(&outcome.point)?, criterion.outputs());
        criterion.reweigh(weighting.roots());
        let next = minimise(criterion, bounds, &outcome.point.theta, options)?;
        converged = next.work.iterations == 0;
        outcome = Outcome { work: outcome.work.and(&next.work), ..next };
        rounds += 1;
    }
    let weighting = Weighting::new(criterion.residuals(&outcome.point)?, criterion.outputs());
    criterion.reweigh(Vec::new());
    let stop = if converged { outcome.stop } else { Stop::Iterations };
    Ok(Robust {
        outcome: Outcome { stop, ..outcome },
        report: weighting.report(rounds, criterion),
        variance: weighting.variance(criterion.degrees_of_freedom),
    })
}

/// Residuals of all experiments, sample after sample, and the deviation of each output.
struct Weighting {
    residuals: Vec<Vec<f64>>,
    deviations: Vec<f64>,
}

impl Weighting {
    fn new(residuals: Vec<Vec<f64>>, outputs: usize) -> Self {
        let of_output = |i: usize| residuals.iter().flat_map(move |e| e.iter().skip(i).step_by(outputs).copied());
        let deviation = |i: usize| {
            let middle = median(of_output(i));
            robust_deviation(of_output(i).map(|e| e - middle))
        };
        let deviations = (0..outputs).map(deviation).collect();
        Weighting { residuals, deviations }
    }

    /// Largest residual of an output that counts in full.
    fn limit(&self, output: usize) -> f64 {
        LIMIT * self.deviations[output]
    }

    /// Residual, its weight, and its output.
    fn all(&self) -> impl Iterator<Item = (f64, f64, usize)> {
        let outputs = self.deviations.len();
        let of_one = move |(k, e): (usize, &f64)| (*e, weight(*e, self.limit(k % outputs)), k % outputs);
        self.residuals.iter().flat_map(move |residuals| residuals.iter().enumerate().map(of_one))
    }

    /// Square roots of the weights, for each experiment.
    fn roots(&self) -> Vec<Vec<f64>> {
        let outputs = self.deviations.len();
        let root = |(k, e): (usize, &f64)| weight(*e, self.limit(k % outputs)).sqrt();
        self.residuals.iter().map(|residuals| residuals.iter().enumerate().map(root).collect()).collect()
    }

    fn variance(&self, degrees_of_freedom: usize) -> f64 {
        let (mut squares, mut full, mut count) = (0.0, 0.0, 0.0);
        for (e, weight, _) in self.all() {
            squares += (weight * e).powi(2);
            full += f64::from(u8::from(weight == 1.0));
            count += 1.0;
        }
        let slope: f64 = full / count;
        squares / degrees_of_freedom as f64 / slope.powi(2)
    }

    fn report(&self, rounds: usize, criterion: &Criterion<'_>) -> RobustReport {
        let mut beyond = vec![0; self.deviations.len()];
        self.all().filter(|(_, weight, _)| *weight < 1.0).for_each(|(_, _, output)| beyond[output] += 1);
        let deviations = criterion.in_units_of_outputs(&self.deviations);
        RobustReport { rounds, deviations, beyond }
    }
}

/// 1 up to the limit, then falling with the residual; 1 for all where the limit is zero.
fn weight(residual: f64, limit: f64) -> f64 {
    if limit > 0.0 && residual.abs() > limit { limit / residual.abs() } else { 1.0 }
}
