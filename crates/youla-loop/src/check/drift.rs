//! Drift: a slow trend of the outputs that neither the input nor the memory of the plant explains.
//!
//! The regression of y on past u and y has a line and a parabola of time beside,
//! ```text
//! y(k) = sum_i (A_i y(k-i) + B_i u(k-i)) + g0 + g1 P1(k) + g2 P2(k) + e(k),    trend = (I - sum_i A_i)^-1 (g1 P1 + g2 P2)
//! ```
//! so that the random walk of an integrating plant is not reported. F of g1 and g2 is divided by what the means of 20 blocks
//! of the residual vary more than white residuals would, which leaves the test valid for slow residuals. The trend is at the output; where the plant
//! integrates, `I - sum_i A_i` is singular and a trend of the sensor cannot be distinguished from one of the machine. In a loop
//! that holds such a plant at a constant reference the means of 20 blocks of `y - r` are regressed on time instead.
//!
//! Source: L. Ljung, System Identification, 2nd ed. (1999), section 14.1, for trends as parameters.

use super::finding::{Finding, Severity, Test, few, with_unit};
use super::options::CheckOptions;
use super::regression::{Lagged, paulson};
use crate::error::Result;
use faer::prelude::*;
use youla::Mat;
use youla::signal::Channel;

/// The trend of one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Highest less lowest value of the trend over the record, in the unit of the channel.
    pub size: f64,
    /// The same in standard deviations of the channel.
    pub relative: f64,
    /// Standard deviations by which it is more than chance.
    pub deviations: f64,
}

/// Blocks of the means of a record: 17 degrees of freedom beside a parabola. Chosen, not measured.
const BLOCKS: usize = 20;
/// Singular values of `I - sum A_i` below which the plant integrates.
/// A pole of a first-order plant within 2 % of 1 is one of more than 50 samples, which 20 lags do not distinguish from an integrator.
/// Chosen, not measured.
const INTEGRATES: f64 = 0.02;

/// Trends of all outputs; `first` is the place of the first output among the signals. `None` where the plant integrates.
pub(super) fn by_regression(lagged: &Lagged, m: usize, p: usize) -> Result<Option<Vec<Drift>>> {
    let targets: Vec<usize> = (m..m + p).map(|s| lagged.column(s, 0)).collect();
    let trends = [lagged.trend(1), lagged.trend(2)];
    let columns = [lagged.past(0..m + p, 1), vec![lagged.trend(0)], trends.to_vec()].concat();
    let fit = lagged.fit(&targets, columns)?;
    let place = |column: usize| fit.columns.iter().position(|c| *c == column);
    let coefficient = |column: usize, output: usize| place(column).map_or(0.0, |k| fit.coefficients[(k, output)]);
    let rest = Mat::from_fn(p, p, |i, j| {
        let sum: f64 = (1..=lagged.lags as isize).map(|lag| coefficient(lagged.column(m + j, lag), i)).sum();
        f64::from(u8::from(i == j)) - sum
    });
    let least = rest.singular_values().ok().and_then(|s| s.last().copied()).unwrap_or(0.0);
    if least < INTEGRATES {
        return Ok(None);
    }
    let g = Mat::from_fn(p, 2, |i, d| coefficient(trends[d], i));
    let line = rest.partial_piv_lu().solve(&g);
    let places = trends.map(|c| place(c).unwrap_or(0));
    let covariance = Mat::from_fn(2, 2, |i, j| fit.inverse[(places[i], places[j])]);
    let mut all = Vec::new();
    for i in 0..p {
        let e = lagged.residual(&fit, targets[i], i);
        let variance = fit.left[i] / lagged.factored as f64;
        let weight = covariance.partial_piv_lu().solve(g.row(i).transpose().as_mat());
        let f = (g.row(i) * &weight)[0] / (2.0 * variance.max(f64::MIN_POSITIVE));
        let freedom = (BLOCKS - 3) as f64;
        let deviations = paulson(f / slowness(&e, variance), 2.0, freedom);
        let at = |x: f64| line[(i, 0)] * x + line[(i, 1)] * (1.5 * x * x - 0.5);
        let curve: Vec<f64> = (0..=100).map(|k| at(f64::from(k) / 50.0 - 1.0)).collect();
        let relative = curve.iter().copied().fold(f64::MIN, f64::max) - curve.iter().copied().fold(f64::MAX, f64::min);
        all.push(Drift { size: relative * lagged.deviations[m + i], relative, deviations });
    }
    Ok(Some(all))
}

/// How much more the means of blocks vary than those of white residuals, at least 1.
fn slowness(e: &[f64], variance: f64) -> f64 {
    let length = e.len() / BLOCKS;
    let means = e.chunks_exact(length.max(1)).take(BLOCKS).map(|b| b.iter().sum::<f64>() / length.max(1) as f64);
    let energy: f64 = means.map(|m| m * m).sum::<f64>() / (BLOCKS - 3) as f64;
    if variance > 0.0 { (energy * length as f64 / variance).max(1.0) } else { 1.0 }
}

/// Trend of a signal that should not have any, from the means of 20 blocks.
///
/// ```
/// use youla_loop::check::drift;
/// let values: Vec<f64> = (0..2000).map(|k| (2.1 * f64::from(k)).sin() + 0.002 * f64::from(k)).collect();
/// let found = drift(&values).unwrap();
/// assert!((found.size - 4.0).abs() < 0.1 && found.deviations > 6.0);
/// ```
pub fn drift(values: &[f64]) -> Option<Drift> {
    let length = values.len() / BLOCKS;
    if length < 2 {
        return None;
    }
    let means: Vec<f64> =
        values.chunks_exact(length).take(BLOCKS).map(|b| b.iter().sum::<f64>() / length as f64).collect();
    let mean = means.iter().sum::<f64>() / BLOCKS as f64;
    let x = |k: usize| (k as f64 - 0.5 * (BLOCKS as f64 - 1.0)) / BLOCKS as f64;
    let moment: f64 = (0..BLOCKS).map(|k| x(k) * x(k)).sum();
    let slope = (0..BLOCKS).map(|k| x(k) * (means[k] - mean)).sum::<f64>() / moment;
    let left: f64 = (0..BLOCKS).map(|k| (means[k] - mean - slope * x(k)).powi(2)).sum();
    let freedom = (BLOCKS - 2) as f64;
    let f = slope * slope * moment / (left / freedom).max(f64::MIN_POSITIVE);
    let n = values.len() as f64;
    let average = values.iter().sum::<f64>() / n;
    // Without the line, whose own deviation would hide it.
    let spread = values.iter().map(|v| (v - average).powi(2)).sum::<f64>() / n - slope * slope / 12.0;
    let deviation = spread.max(0.0).sqrt();
    let relative = if deviation > 0.0 { slope.abs() / deviation } else { 0.0 };
    Some(Drift { size: slope.abs(), relative, deviations: paulson(f, 1.0, freedom) })
}

impl Drift {
    pub(super) fn finding(&self, record: &str, channel: &Channel, options: &CheckOptions) -> Option<Finding> {
        // Blocks leave few degrees of freedom, so that the scale of deviations ends early.
        if self.deviations < DEVIATIONS || self.relative < options.drift {
            return None;
        }
        let severity = if self.relative < 4.0 * options.drift { Severity::Caution } else { Severity::Defect };
        let what = format!(
            "it drifts by {} over the record, {} times its standard deviation, which the input does not explain",
            with_unit(self.size, &channel.unit),
            few(self.relative)
        );
        let advice = "Remove the trend by detrend = \"linear\", use shorter records, or remove the cause (temperature, a leak, \
                      warm-up of an amplifier)";
        let numbers = Finding::new(Test::Drift, severity, record, what).number("size", self.size);
        Some(numbers.channel(&channel.name).number("relative", self.relative).advice(advice))
    }
}

/// `deviations` is the normal deviate with the tail of F (`paulson`), not Student's t: from 4 on the probability of F is 2.5e-5 with 2
/// and 17 degrees of freedom (`by_regression`) and 2.3e-5 with 1 and 18 (`drift`).
/// Chosen; no false alarm in 200 simulated clean records (`docs/check.md`).
const DEVIATIONS: f64 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// `y+ = 0.9 y + u + e`: no drift in 200 records, a line of twice the deviation in each.
    #[test]
    fn drift_is_found_at_the_output() {
        let channel = Channel::new("y", "");
        let options = CheckOptions::default();
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut draw = || rng.sample::<f64, _>(StandardNormal);
            let (mut x, mut u, mut y) = (0.0, Vec::new(), Vec::new());
            for _ in 0..1500 {
                u.push(draw());
                y.push(x + 0.1 * draw());
                x = 0.9 * x + u[u.len() - 1];
            }
            let found = |slope: f64| {
                let u = Mat::from_fn(1500, 1, |k, _| u[k]);
                let y = Mat::from_fn(1500, 1, |k, _| y[k] + slope * k as f64 / 1500.0);
                let lagged = Lagged::new(&[u.as_ref(), y.as_ref()], 10).unwrap();
                by_regression(&lagged, 1, 1).unwrap().unwrap()[0]
            };
            assert_eq!(found(0.0).finding("log", &channel, &options), None, "seed {seed}");
            let drifting = found(6.0);
            assert!((drifting.size - 6.0).abs() < 0.3, "seed {seed}: {drifting:?}");
            assert!(drifting.finding("log", &channel, &options).is_some(), "seed {seed}: {drifting:?}");
        }
    }
}
