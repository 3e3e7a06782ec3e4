//! Wrong samples: bit errors, bouncing contacts, converter glitches, bursts of disturbance, jumps of an offset.
//!
//! A wrong sample w at time k enters the innovation of a regression of y on its past as `w a(j)` at k + j, where
//! `a = (1, -A_1, -A_2, ...)` are the coefficients of y itself; an offset that jumps by w at k as `w (a(0) + ... + a(j))`. Estimate and
//! test of a pattern s are
//! ```text
//! w = sum_j s(j) e(k+j) / |s|^2,    lambda = w |s| / sigma,   sigma from the median of |lambda| (robust)
//! ```
//! A disturbance that the plant feels has another pattern (`e(k)` alone); one to three samples in a row, or an offset, count as wrong only
//! where their patterns make 80 % of the energy of the innovation around them beyond that of noise, and where lambda is twice as large as
//! the 99.5 % quantile of all. Where no pattern does, many great innovations near to each other are a burst. The regression leaves out
//! the rows of great innovations, which would change its coefficients.
//!
//! Source: I. Chang, G. C. Tiao, C. Chen, Estimation of time series parameters in the presence of outliers, Technometrics 30
//! (1988), 193; R. S. Tsay, Outliers, level shifts, and variance changes in time series, Journal of Forecasting 7 (1988), 1.

use super::finding::{Finding, Severity, Test, few, with_unit};
use super::options::CheckOptions;
use super::patterns::Search;
use super::regression::Lagged;
use super::sequence::jump;
use crate::error::Result;
use youla::MatRef;
use youla::signal::Channel;

/// The wrong samples of one output.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outliers {
    /// Samples, counted from 0, in order.
    pub samples: Vec<usize>,
    /// By how much each is wrong, in the unit of the channel.
    pub sizes: Vec<f64>,
    /// Share of the energy of the innovation that they make.
    pub share: f64,
    /// Sample, counted from 0, from which an offset is added, and the offset in the unit of the channel.
    pub jump: Option<(usize, f64)>,
    /// First and last sample, counted from 0, of a burst.
    pub burst: Option<[usize; 2]>,
}

/// Wrong samples of a channel by its own past alone; the check of a record uses the inputs too.
///
/// # Errors
/// [`youla::Error::NoConvergence`] of the regression.
///
/// ```
/// use youla_loop::check::{CheckOptions, outliers};
/// let mut wave: Vec<f64> = (0..1000).map(|k| (0.1 * f64::from(k)).sin() + 0.01 * f64::from(k * k % 17)).collect();
/// wave[400] += 3.0;
/// let found = outliers(&wave, &CheckOptions::default())?;
/// assert_eq!(found.samples, [400]);
/// assert!((found.sizes[0] - 3.0).abs() < 0.3);
/// # Ok::<(), youla_loop::Error>(())
/// ```
pub fn outliers(values: &[f64], options: &CheckOptions) -> Result<Outliers> {
    let signal = youla::MatRef::from_column_major_slice(values, values.len(), 1);
    match Lagged::new(&[signal], options.lags) {
        Some(lagged) => Ok(of_outputs(&lagged, 0, 1, options)?.remove(0).0),
        None => Ok(Outliers::default()),
    }
}

/// Wrong samples of each output of a record by the past of its inputs and outputs, as [`super::check_record`] finds them.
///
/// # Errors
/// [`youla::Error::NoConvergence`] of the regression.
pub fn output_outliers(u: MatRef<'_, f64>, y: MatRef<'_, f64>, options: &CheckOptions) -> Result<Vec<Outliers>> {
    match Lagged::new(&[u, y], options.lags) {
        Some(lagged) => {
            Ok(of_outputs(&lagged, u.ncols(), y.ncols(), options)?.into_iter().map(|(found, _)| found).collect())
        }
        None => Ok(vec![Outliers::default(); y.ncols()]),
    }
}

/// Wrong samples of all outputs, which are after the m inputs, with the standard deviation of each innovation in the
/// unit of its channel. The latter is taken robustly.
pub(super) fn of_outputs(lagged: &Lagged, m: usize, p: usize, options: &CheckOptions) -> Result<Vec<(Outliers, f64)>> {
    let targets: Vec<usize> = (m..m + p).map(|s| lagged.column(s, 0)).collect();
    let columns = [lagged.past(0..m + p, 1), vec![lagged.trend(0)]].concat();
    let plain = lagged.fit(&targets, columns.clone())?;
    let (fit, residuals) = lagged.robust_fit(&targets, columns)?;
    let mut all = Vec::new();
    for (i, e) in residuals.into_iter().enumerate() {
        let own = |lag: isize| {
            let column = lagged.column(m + i, lag);
            fit.columns.iter().position(|c| *c == column).map_or(0.0, |k| -fit.coefficients[(k, i)])
        };
        let a: Vec<f64> = std::iter::once(1.0).chain((1..=lagged.lags as isize).map(own)).collect();
        let unit = lagged.deviations[m + i];
        let mut found = Search::new(e, &a).wrong(options);
        found.samples.iter_mut().for_each(|k| *k += lagged.lags);
        found.sizes.iter_mut().for_each(|w| *w *= unit);
        found.jump = found.jump.map(|(k, w)| (k + lagged.lags, w * unit));
        found.burst = found.burst.map(|span| span.map(|k| k + lagged.lags));
        all.push((found, unit * (plain.left[i] / lagged.factored as f64).sqrt()));
    }
    Ok(all)
}

/// Sizes that are listed.
/// Chosen, not measured.
const LISTED: usize = 5;

impl Outliers {
    /// The findings on the samples, the offset and the burst.
    pub(super) fn findings(
        &self,
        record: &str,
        first: usize,
        channel: &Channel,
        options: &CheckOptions,
    ) -> Vec<Finding> {
        let jump = self.jump.map(|(at, by)| jump(record, first + at, by, channel));
        let burst = self.burst.map(|[from, to]| {
            let what = format!("a burst of disturbance over {} samples", to - from + 1);
            let finding = Finding::new(Test::Outliers, Severity::Caution, record, what).channel(&channel.name);
            let advice = "Exclude the rows by `segments`; look for a knock, a contact or interference at that time";
            finding.rows(first + from, first + to).number("samples", (to - from + 1) as f64).advice(advice)
        });
        self.finding(record, first, channel, options).into_iter().chain(jump).chain(burst).collect()
    }

    fn finding(&self, record: &str, first: usize, channel: &Channel, options: &CheckOptions) -> Option<Finding> {
        let last = *self.samples.last()?;
        let severity = match self.share / options.outlier_share {
            s if s >= 2.5 => Severity::Defect,
            s if s >= 1.0 => Severity::Caution,
            _ => Severity::Note,
        };
        let listed: Vec<String> = self
            .samples
            .iter()
            .zip(&self.sizes)
            .take(LISTED)
            .map(|(k, w)| format!("row {} by {}", first + k, with_unit(*w, &channel.unit)))
            .collect();
        let more = if self.samples.len() > LISTED { ", ..." } else { "" };
        let plural = if self.samples.len() == 1 { "" } else { "s" };
        let what = format!(
            "{} outlier{plural} ({}{more}) with {} % of the energy of the innovation",
            self.samples.len(),
            listed.join(", "),
            few(100.0 * self.share)
        );
        let advice = "Exclude the rows by `segments`";
        Some(
            Finding::new(Test::Outliers, severity, record, what)
                .channel(&channel.name)
                .rows(first + self.samples[0], first + last)
                .number("count", self.samples.len() as f64)
                .number("share", self.share)
                .number("largest", self.sizes.iter().fold(0.0, |l: f64, w| l.max(w.abs())))
                .advice(advice),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Coloured noise has no wrong samples in 200 records; two planted ones of 6 deviations are found in each, a shock
    /// that the plant feels is not taken for one.
    #[test]
    fn wrong_samples_are_no_shocks() {
        let options = CheckOptions::default();
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut y = vec![0.0, 0.0];
            for k in 2..2000 {
                let shock = if k == 1500 { 12.0 } else { 0.0 };
                let noise: f64 = rng.sample(StandardNormal);
                y.push(1.5 * y[k - 1] - 0.7 * y[k - 2] + noise + shock);
            }
            assert!(outliers(&y, &options).unwrap().samples.is_empty(), "seed {seed}");
            y[300] += 15.0;
            y[900] -= 15.0;
            let found = outliers(&y, &options).unwrap();
            assert_eq!(found.samples, [300, 900], "seed {seed}: {found:?}");
            assert!((found.sizes[0] - 15.0).abs() < 3.0 && (found.sizes[1] + 15.0).abs() < 3.0);
        }
    }
}
