//! Whether the residuals are what the covariance of the parameters takes them for: white, and independent of the past inputs.
//!
//! ```text
//! R_e(k) = mean e(t) e(t-k)',   Q = N^2 sum_{k=1}^{M} tr(R_e(k)' R_e(0)^-1 R_e(k) R_e(0)^-1) / (N - k)  ~ chi^2(M p^2)
//! r(j, k) = mean e_i(t) u_j(t-k),   N cov(r(j, k), r(l, h)) = sum_s R_ei(s) R_ujl(s + h - k) = P,   N r' P^-1 r ~ chi^2
//! ```
//! The first is the portmanteau test (G. M. Ljung and G. E. P. Box, Biometrika 65 (1978), 297; for several outputs J. R. M.
//! Hosking, J. Am. Stat. Assoc. 75 (1980), 602), the second the test of L. Ljung, System Identification: Theory for the User,
//! 2nd ed., 1999, section 16.6, for each output, which holds for coloured residuals too. Residuals that are coloured leave the estimate consistent in open loop and make the covariance wrong;
//! those that depend on past inputs say that the structure lacks something.

use super::lags::LagSums;
use crate::{Error, Result};
use serde::Serialize;
use youla::Mat;
use youla::linalg::solve;
use youla::statistics::{chi_square_tail, normal_quantile};

/// Lags of both tests, at most.
pub(super) const LAGS: usize = 25;
/// Probability with which each test accepts residuals that are what they should be.
const LEVEL: f64 = 0.99;
/// Directions of the inputs with less than this share of the largest power say nothing.
const NO_POWER: f64 = 1e-6;

/// What the residuals say of the noise and of the structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualTest {
    /// Number of samples.
    pub samples: usize,
    /// Auto-correlation of the residual of each output, at the lags from 1 on.
    pub autocorrelation: Vec<Vec<f64>>,
    /// What a single auto-correlation of white residuals exceeds with a probability of 1 %.
    pub autocorrelation_bound: f64,
    /// Q.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of a larger Q where the residuals are white.
    pub p_value: f64,
    /// The largest correlation of a residual with an input before it.
    pub cross: CrossCorrelation,
    /// Probability of correlations with past inputs as large as these where the residuals do not depend on them: the smallest
    /// of all outputs, times their number.
    pub cross_p_value: f64,
}

/// The correlation of the residual of one output with one past input.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CrossCorrelation {
    /// Output, counted from 0.
    pub output: usize,
    /// Input, counted from 0.
    pub input: usize,
    /// Samples by which the input is earlier.
    pub lag: usize,
    /// In standard deviations.
    pub deviations: f64,
}

impl ResidualTest {
    /// Whether the residuals pass as white.
    pub fn white(&self) -> bool {
        self.p_value >= 1.0 - LEVEL
    }

    /// Whether they pass as independent of the past inputs.
    pub fn independent(&self) -> bool {
        self.cross_p_value >= 1.0 - LEVEL
    }

    /// The auto-correlation that is largest in magnitude, with its lag.
    pub(crate) fn largest_autocorrelation(&self) -> (usize, f64) {
        let all = self.autocorrelation.iter().flat_map(|of| of.iter().copied().enumerate());
        all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or((0, 0.0), |(k, r)| (k + 1, r))
    }
}

/// Lagged products of residuals e (p) and inputs u (m) over all experiments, `z = [e; u]`.
pub(super) struct ResidualSums {
    pub(super) sums: LagSums,
    pub(super) outputs: usize,
    pub(super) inputs: usize,
    pub(super) samples: usize,
}

impl ResidualSums {
    pub(super) fn new(outputs: usize, inputs: usize, lags: usize) -> Self {
        let width = outputs + inputs;
        let pairs = (0..width).flat_map(|i| (0..width).map(move |j| (i, j)));
        // The past of the residuals does not matter to the inputs.
        let wanted = pairs.filter(|(i, j)| *i < outputs || *j >= outputs).collect();
        ResidualSums { sums: LagSums::new(width, wanted, lags), outputs, inputs, samples: 0 }
    }

    /// `mean e_i(t) z_j(t - lag)`.
    pub(super) fn residual(&self, i: usize, j: usize, lag: usize) -> f64 {
        self.sums.sums[i * (self.outputs + self.inputs) + j][lag] / self.samples as f64
    }

    /// `mean u_j(t) u_l(t - lag)`, lags of either sign.
    fn input(&self, j: usize, l: usize, lag: isize) -> f64 {
        let (j, l) = if lag < 0 { (l, j) } else { (j, l) };
        let first = self.outputs * (self.outputs + self.inputs);
        self.sums.sums[first + j * self.inputs + l][lag.unsigned_abs()] / self.samples as f64
    }

    /// The tests over `lags` lags; those of the inputs start at `first`.
    pub(super) fn test(&self, lags: usize, first: usize) -> Result<ResidualTest> {
        let (p, n) = (self.outputs, self.samples as f64);
        let power = |i: usize| self.residual(i, i, 0);
        let normalised = |i: usize, lag: usize| if power(i) > 0.0 { self.residual(i, i, lag) / power(i) } else { 0.0 };
        let degrees_of_freedom = lags * p * p;
        let statistic = if (0..p).all(|i| power(i) > 0.0) { self.portmanteau(lags)? } else { 0.0 };
        let (cross, cross_p_value) = self.cross(lags, first)?;
        Ok(ResidualTest {
            samples: self.samples,
            autocorrelation: (0..p).map(|i| (1..=lags).map(|lag| normalised(i, lag)).collect()).collect(),
            autocorrelation_bound: normal_quantile(0.5 * (1.0 + LEVEL)) / n.sqrt(),
            statistic,
            degrees_of_freedom,
            p_value: chi_square_tail(statistic, degrees_of_freedom),
            cross,
            cross_p_value,
        })
    }

    fn portmanteau(&self, lags: usize) -> Result<f64> {
        let (p, n) = (self.outputs, self.samples as f64);
        let at = |lag: usize| Mat::from_fn(p, p, |i, j| self.residual(i, j, lag));
        let mut sum = 0.0;
        for lag in 1..=lags {
            let what = "the covariance of the residuals";
            let (forward, backward) =
                (solve(what, at(0).as_ref(), at(lag).as_ref())?, solve(what, at(0).as_ref(), at(lag).transpose())?);
            let product = backward * forward;
            sum += (0..p).map(|i| product[(i, i)]).sum::<f64>() * n * n / (n - lag as f64);
        }
        Ok(sum)
    }

    /// The largest correlation with a past input, and the smallest probability over the outputs times their number.
    fn cross(&self, lags: usize, first: usize) -> Result<(CrossCorrelation, f64)> {
        let mut largest = CrossCorrelation { output: 0, input: 0, lag: first, deviations: 0.0 };
        let mut smallest = 1.0f64;
        let places: Vec<(usize, usize)> =
            (0..self.inputs).flat_map(|j| (first..=lags).map(move |lag| (j, lag))).collect();
        for output in 0..self.outputs {
            let p = self.covariance(output, lags, &places);
            let r: Vec<f64> = places.iter().map(|(j, lag)| self.residual(output, self.outputs + j, *lag)).collect();
            for (k, (input, lag)) in places.iter().copied().enumerate().filter(|(k, _)| p[(*k, *k)] > 0.0) {
                let deviations = r[k] * (self.samples as f64 / p[(k, k)]).sqrt();
                if deviations.abs() > largest.deviations.abs() {
                    largest = CrossCorrelation { output, input, lag, deviations };
                }
            }
            smallest = smallest.min(probability(&p, &r, self.samples)?);
        }
        Ok((largest, (smallest * self.outputs as f64).min(1.0)))
    }

    /// P of one output; the correlation of the residual is tapered by the window of Bartlett, which keeps P positive.
    fn covariance(&self, output: usize, lags: usize, places: &[(usize, usize)]) -> Mat<f64> {
        let reach = (self.sums.sums[0].len() - 1).saturating_sub(lags) as isize;
        let taper = |s: isize| 1.0 - s as f64 / (reach + 1) as f64;
        let weight = |s: isize| taper(s.abs()) * self.residual(output, output, s.unsigned_abs());
        let weights: Vec<f64> = (-reach..=reach).map(weight).collect();
        // It depends on the difference of the lags alone.
        let lags = lags as isize;
        let at = |j: usize, l: usize, shift: isize| -> f64 {
            (-reach..=reach).zip(&weights).map(|(s, weight)| weight * self.input(j, l, s + shift)).sum()
        };
        let m = self.inputs;
        let tables: Vec<Vec<f64>> =
            (0..m * m).map(|jl| (-lags..=lags).map(|shift| at(jl / m, jl % m, shift)).collect()).collect();
        Mat::from_fn(places.len(), places.len(), |a, b| {
            let ((j, k), (l, h)) = (places[a], places[b]);
            tables[j * m + l][(h as isize - k as isize + lags) as usize]
        })
    }
}

/// Probability of a larger `N r' P^-1 r`, over the directions in which the inputs move.
fn probability(p: &Mat<f64>, r: &[f64], samples: usize) -> Result<f64> {
    let failed = |_| {
        Error::Method(youla::Error::NoConvergence {
            what: "the covariance of the correlations with inputs".into(),
            iterations: 0,
        })
    };
    let eigen = p.self_adjoint_eigen(faer::Side::Lower).map_err(failed)?;
    let values = eigen.S().column_vector();
    let largest = values.iter().copied().fold(0.0, f64::max);
    let (mut statistic, mut degrees_of_freedom) = (0.0, 0);
    for (k, value) in values.iter().enumerate().filter(|(_, value)| **value > NO_POWER * largest) {
        let along: f64 = r.iter().enumerate().map(|(i, r)| r * eigen.U()[(i, k)]).sum();
        statistic += samples as f64 * along * along / value;
        degrees_of_freedom += 1;
    }
    Ok(chi_square_tail(statistic, degrees_of_freedom))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Two outputs and two inputs over 600 samples: white residuals, coloured ones, and one that follows the second input by
    /// three samples.
    #[test]
    fn colour_and_dependence_are_told_apart() {
        let test = |colour: f64, share: f64| {
            let mut rng = ChaCha8Rng::seed_from_u64(5);
            let mut draw = || rng.sample::<f64, _>(StandardNormal);
            let (mut e, mut u) = ([0.0; 2], vec![[0.0; 2]; 3]);
            let mut sums = ResidualSums::new(2, 2, 2 * LAGS);
            for _ in 0..600 {
                u.push([draw(), draw()]);
                e = [colour * e[0] + draw(), colour * e[1] + draw()];
                let late = share * u[u.len() - 4][1];
                let now = [e[0], e[1] + late, u[u.len() - 1][0], u[u.len() - 1][1]];
                sums.sums.take(1, |signal, _| now[signal]);
                sums.samples += 1;
            }
            sums.test(LAGS, 1).unwrap()
        };
        let white = test(0.0, 0.0);
        assert!(white.white() && white.independent(), "{white:?}");
        let coloured = test(0.8, 0.0);
        assert!(!coloured.white() && coloured.independent(), "{coloured:?}");
        assert!((coloured.largest_autocorrelation().1 - 0.8).abs() < 0.1);
        let dependent = test(0.0, 0.4);
        let CrossCorrelation { output, input, lag, deviations } = dependent.cross;
        assert!(!dependent.independent() && (output, input, lag) == (1, 1, 3), "{dependent:?}");
        assert!((deviations - 0.4 * (600.0f64 / 1.16).sqrt()).abs() < 4.0, "{deviations}");
    }
}
