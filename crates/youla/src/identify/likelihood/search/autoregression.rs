//! The autoregression of the noise at one output, with a zero where slow drift lies below white noise.

use super::driven::Driven;
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::{Lines, Spectra, parts};
use faer::c64;
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Coefficients of `(1 - b/z) / (1 + a_1/z + ...)`, behind noise at the inputs of the plant where there is any.
#[derive(Debug, Clone, Default)]
pub(crate) struct Regression {
    /// a_1 ...
    pub(crate) coefficients: Vec<f64>,
    /// b, 0 for none.
    pub(crate) zero: f64,
    /// What the plant makes of noise at its inputs.
    pub(crate) driven: Option<Arc<Driven>>,
}

impl Regression {
    /// Number of its coefficients.
    pub(crate) fn parameters(&self) -> usize {
        self.coefficients.len() + usize::from(self.zero != 0.0) + usize::from(self.driven.is_some())
    }

    /// `(1 + a_1 / z + ...) / (1 - b / z) / H`, given `1 / z`.
    #[inline(always)]
    pub(crate) fn filter(&self, back: &Lanes) -> Lanes {
        let mut sum = Lanes::ZERO;
        self.coefficients.iter().rev().for_each(|a| sum = sum.shifted(*a).times(back));
        let mut filter = sum.shifted(1.0);
        if self.zero != 0.0 {
            filter = filter.times(&back.scaled(-self.zero).shifted(1.0).inverse());
        }
        self.driven.as_ref().map_or(filter, |driven| filter.times(&driven.filter(back)))
    }
}

/// Zeros b that are tried, with corners 1 - b from 0.4 down to 0.002 rad per sample, a factor of 2 to 2.5 apart: the
/// autoregression describes what lies between them.
const ZEROS: [f64; 8] = [0.6, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998];
/// Slow poles that are tried with each zero below them: a random walk, and drift that is bounded.
const POLES: [f64; 3] = [1.0, 0.999, 0.99];

/// Largest order of an autoregression with a zero.
const WITH_ZERO: usize = 12;

/// Autocorrelations of the residual at one output.
pub(crate) struct Correlations {
    plain: Vec<f64>,
    /// Filtered by `1 / (1 - b/z)` for each b of [`ZEROS`].
    filtered: Vec<[f64; ZEROS.len()]>,
}

impl Correlations {
    /// For autoregressions up to `largest` coefficients, behind noise at the inputs of the plant.
    pub(crate) fn new(
        spectra: &Spectra,
        residuals: &[Vec<c64>],
        output: usize,
        largest: usize,
        driven: Option<&Driven>,
    ) -> Self {
        let channel = (output, spectra.outputs);
        let mut sum = Correlations::zero(largest);
        for (lines, v) in spectra.records.iter().zip(residuals) {
            let of = |range| Arch::new().dispatch(PartSum { lines, v, channel, largest, driven, range });
            parts(lines.z.len()).map(of).collect::<Vec<_>>().iter().for_each(|part| sum.add(part));
        }
        sum
    }

    fn zero(largest: usize) -> Self {
        let filtered = vec![[0.0; ZEROS.len()]; largest.min(WITH_ZERO) + 2];
        Correlations { plain: vec![0.0; largest + 1], filtered }
    }

    fn add(&mut self, part: &Correlations) {
        self.plain.iter_mut().zip(&part.plain).for_each(|(s, p)| *s += p);
        for (sums, part) in self.filtered.iter_mut().zip(&part.filtered) {
            sums.iter_mut().zip(part).for_each(|(s, p)| *s += p);
        }
    }

    /// The regression with the least `N log variance + log(N) parameters`, which comes with it.
    pub(crate) fn regression(&self, samples: usize) -> (Regression, f64) {
        let (mut coefficients, mut least) = autoregression(&self.plain, samples);
        let mut zero = 0.0;
        for (f, b) in ZEROS.iter().enumerate() {
            for pole in POLES.iter().filter(|pole| *pole > b) {
                let (rest, criterion) = autoregression(&self.through(f, *pole), samples);
                let criterion = criterion + 2.0 * log(samples);
                if criterion < least {
                    (coefficients, zero, least) = (with_pole(&rest, *pole), *b, criterion);
                }
            }
        }
        (Regression { coefficients, zero, driven: None }, least)
    }

    /// Autocorrelations behind `(1 - c/z) / (1 - b/z)`.
    fn through(&self, zero: usize, pole: f64) -> Vec<f64> {
        let r = |l: usize| self.filtered[l][zero];
        (0..self.filtered.len() - 1)
            .map(|l| (1.0 + pole * pole) * r(l) - pole * (r(l + 1) + r(if l == 0 { 1 } else { l - 1 })))
            .collect()
    }
}

/// The sums over a part of the lines of a record, with the widest instructions that the processor has.
struct PartSum<'a> {
    lines: &'a Lines,
    v: &'a [c64],
    /// Output, and number of outputs.
    channel: (usize, usize),
    largest: usize,
    driven: Option<&'a Driven>,
    range: Range<usize>,
}

impl NullaryFnOnce for PartSum<'_> {
    type Output = Correlations;

    #[inline(always)]
    fn call(self) -> Correlations {
        let PartSum { lines, v, channel: (output, p), largest, driven, range } = self;
        let mut sum = Correlations::zero(largest);
        let mut plain = vec![[0.0; LANES]; sum.plain.len()];
        let mut filtered = vec![[[0.0; LANES]; ZEROS.len()]; sum.filtered.len()];
        for first in range.clone().step_by(LANES) {
            let (mut power, mut cosine) = ([0.0; LANES], [0.0; LANES]);
            for (l, k) in (first..range.end.min(first + LANES)).enumerate() {
                power[l] = v[k * p + output].norm_sqr() * lines.weight[k] * lines.weight[k];
                cosine[l] = lines.z[k].re;
            }
            if let Some(driven) = driven {
                let back = Lanes::gather(|l| lines.z[(first + l).min(range.end - 1)].conj());
                let filter = driven.filter(&back);
                for l in 0..LANES {
                    power[l] *= filter.re[l] * filter.re[l] + filter.im[l] * filter.im[l];
                }
            }
            let powers = ZEROS.map(|b| {
                let mut out = power;
                for l in 0..LANES {
                    out[l] /= 1.0 + b * b - 2.0 * b * cosine[l];
                }
                out
            });
            // cos(lag w) by the recursion of Chebyshev
            let (mut before, mut now) = (cosine, [1.0; LANES]);
            for lag in 0..plain.len().max(filtered.len()) {
                if let Some(sums) = plain.get_mut(lag) {
                    add_product(sums, &power, &now);
                }
                if let Some(sums) = filtered.get_mut(lag) {
                    sums.iter_mut().zip(&powers).for_each(|(sums, powers)| add_product(sums, powers, &now));
                }
                let mut next = [0.0; LANES];
                for l in 0..LANES {
                    next[l] = 2.0 * cosine[l] * now[l] - before[l];
                }
                (before, now) = (now, next);
            }
        }
        let total = |lanes: &[f64; LANES]| lanes.iter().sum::<f64>();
        sum.plain.iter_mut().zip(&plain).for_each(|(s, lanes)| *s = total(lanes));
        sum.filtered.iter_mut().zip(&filtered).for_each(|(s, lanes)| *s = lanes.each_ref().map(total));
        sum
    }
}

#[inline(always)]
fn add_product(sums: &mut [f64; LANES], a: &[f64; LANES], b: &[f64; LANES]) {
    for l in 0..LANES {
        sums[l] += a[l] * b[l];
    }
}

fn log(samples: usize) -> f64 {
    (samples.max(2) as f64).ln()
}

/// The coefficients times `1 - c/z`.
fn with_pole(coefficients: &[f64], pole: f64) -> Vec<f64> {
    let a = |i: usize| if i == 0 { 1.0 } else { coefficients.get(i - 1).copied().unwrap_or(0.0) };
    (1..coefficients.len() + 2).map(|i| a(i) - pole * a(i - 1)).collect()
}

/// Levinson's recursion, the order by `N log variance + log(N) order`, which it returns as well.
fn autoregression(r: &[f64], samples: usize) -> (Vec<f64>, f64) {
    let count = samples as f64;
    let mut a: Vec<f64> = Vec::new();
    let mut variance = r[0];
    if variance.is_nan() || variance <= 0.0 {
        return (a, f64::INFINITY);
    }
    let (mut best, mut chosen) = (count * variance.ln(), Vec::new());
    for order in 1..r.len() {
        let sum: f64 = r[order] + a.iter().enumerate().map(|(i, a)| a * r[order - 1 - i]).sum::<f64>();
        let reflection = -sum / variance;
        if reflection.abs() >= 0.99999 || !reflection.is_finite() {
            break;
        }
        let before = a.clone();
        for i in 0..a.len() {
            a[i] += reflection * before[before.len() - 1 - i];
        }
        a.push(reflection);
        variance *= 1.0 - reflection * reflection;
        let criterion = count * variance.ln() + log(samples) * order as f64;
        if criterion < best {
            (best, chosen) = (criterion, a.clone());
        }
    }
    (chosen, best)
}
