//! The autoregression of the noise at one output, with a zero where slow drift lies below white noise.

use super::driven::Driven;
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use crate::identify::likelihood::data::spectra::Spectra;
use faer::c64;
use pulp::{Arch, NullaryFnOnce};
use std::f64::consts::PI;
use std::sync::{Arc, LazyLock};

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
        self.coefficients.len()
            + usize::from(self.zero != 0.0)
            + self.driven.as_ref().map_or(0, |driven| driven.parameters())
    }

    /// `(1 + a_1 / z + ...) / (1 - b / z) / H`, given `1 / z`.
    #[inline(always)]
    pub(crate) fn filter(&self, back: &Lanes) -> Lanes {
        let mut filter = self.behind(back);
        if let Some(driven) = &self.driven {
            driven.apply(back, &mut filter);
        }
        filter
    }

    /// `(1 + a_1 / z + ...) / (1 - b / z)` at one line, given `1 / z`.
    pub(crate) fn at(&self, back: c64) -> c64 {
        let sum = self.coefficients.iter().rev().fold(c64::ZERO, |sum, a| (sum + *a) * back);
        (sum + c64::ONE) / (c64::ONE - back * self.zero)
    }

    /// The same of several, as lanes.
    #[inline(always)]
    pub(crate) fn behind(&self, back: &Lanes) -> Lanes {
        let mut filter = Lanes::ZERO;
        for a in self.coefficients.iter().rev() {
            filter.re.iter_mut().for_each(|v| *v += a);
            filter.multiply(back);
        }
        filter.re.iter_mut().for_each(|v| *v += 1.0);
        if self.zero != 0.0 {
            filter.multiply(&back.scaled(-self.zero).shifted(1.0).inverse());
        }
        filter
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
    /// For autoregressions up to `largest` coefficients.
    pub(crate) fn new(power: &Binned, largest: usize) -> Self {
        Arch::new().dispatch(Sums { power, largest })
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

/// Largest width of a bin, rad per sample: autoregressions have up to 40 coefficients, so that a line counts by a phase within
/// 40 * 0.002 / 2 rad of its own, and a correlation by its value within 3e-4.
const BIN: f64 = 0.002;
/// Width of a bin over its distance to zero frequency, where drift has its corner.
const RELATIVE_BIN: f64 = 0.125;
/// Frequency of the end of the first bin, rad per sample: the first line of a record of 6e7 samples.
const FIRST_BIN: f64 = 1e-7;

static ENDS: LazyLock<Vec<f64>> = LazyLock::new(|| ends_of_bins(BIN));

/// Cosines of the ends of bins up to a width, falling.
pub(crate) fn ends_of_bins(width: f64) -> Vec<f64> {
    let next = |w: &f64| Some(w + (RELATIVE_BIN * w).min(width));
    let ends = std::iter::successors(Some(FIRST_BIN), next).take_while(|w| *w < PI);
    ends.map(f64::cos).chain([f64::NEG_INFINITY]).collect()
}

/// Power in bins, whose lines an autoregression does not resolve.
pub(crate) struct Binned {
    power: Vec<f64>,
    /// Cosine of the frequency of each bin, the mean over its power.
    cosine: Vec<f64>,
}

impl Binned {
    /// Of a residual of one output, on the lines of each record.
    pub(crate) fn new(spectra: &Spectra, residual: &[Vec<c64>]) -> Self {
        let mut sums = vec![[0.0; 2]; ENDS.len()];
        for (lines, v) in spectra.records.iter().zip(residual) {
            let mut bin = 0;
            for ((z, v), weight) in lines.z.iter().zip(v).zip(&lines.weight) {
                while z.re < ENDS[bin] {
                    bin += 1;
                }
                let power = v.norm_sqr() * weight * weight;
                sums[bin][0] += power;
                sums[bin][1] += power * z.re;
            }
        }
        sums.retain(|[power, _]| *power > 0.0);
        let (power, cosine) = sums.into_iter().map(|[power, along]| (power, along / power)).unzip();
        Binned { power, cosine }
    }
}

/// The autocorrelations of binned power, with the widest instructions that the processor has.
struct Sums<'a> {
    power: &'a Binned,
    largest: usize,
}

impl NullaryFnOnce for Sums<'_> {
    type Output = Correlations;

    #[inline(always)]
    fn call(self) -> Correlations {
        let mut plain = vec![[0.0; LANES]; self.largest + 1];
        let mut filtered = vec![[[0.0; LANES]; ZEROS.len()]; self.largest.min(WITH_ZERO) + 2];
        for (of, at) in self.power.power.chunks(LANES).zip(self.power.cosine.chunks(LANES)) {
            let (mut power, mut cosine) = ([0.0; LANES], [0.0; LANES]);
            power[..of.len()].copy_from_slice(of);
            cosine[..at.len()].copy_from_slice(at);
            let mut powers = [power; ZEROS.len()];
            for (b, powers) in ZEROS.iter().zip(&mut powers) {
                for l in 0..LANES {
                    powers[l] /= 1.0 + b * b - 2.0 * b * cosine[l];
                }
            }
            // cos(lag w) by the recursion of Chebyshev
            let (mut before, mut now) = (cosine, [1.0; LANES]);
            for lag in 0..plain.len().max(filtered.len()) {
                if let Some(sums) = plain.get_mut(lag) {
                    add_product(sums, &power, &now);
                }
                if let Some(sums) = filtered.get_mut(lag) {
                    for (sums, powers) in sums.iter_mut().zip(&powers) {
                        add_product(sums, powers, &now);
                    }
                }
                let mut next = [0.0; LANES];
                for l in 0..LANES {
                    next[l] = 2.0 * cosine[l] * now[l] - before[l];
                }
                (before, now) = (now, next);
            }
        }
        let total = |lanes: &[f64; LANES]| lanes.iter().sum::<f64>();
        let filtered = filtered.iter().map(|lanes| lanes.each_ref().map(total)).collect();
        Correlations { plain: plain.iter().map(total).collect(), filtered }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::likelihood::data::spectra::Sizes;
    use crate::identify::subspace::Experiment;
    use faer::Mat;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// White noise with a line: a bin of 0.002 rad changes the correlation at lag 40 by at most 40^2 0.002^2 / 8 of the power, and what a
    /// zero at 0.998 leaves by a bin of an eighth of its distance to zero frequency, 1e-3.
    #[test]
    fn bins_have_the_correlations_of_their_lines() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let y = Mat::from_fn(20_000, 1, |t, _| rng.random::<f64>() - 0.5 + (0.7001 * t as f64).sin());
        let records = [Experiment::new(y.as_ref(), y.as_ref())];
        let spectra = Spectra::new(&records, &Sizes::of(&records), &[0], 0);
        let lines = &spectra.records[0];
        let binned = Binned::new(&spectra, std::slice::from_ref(&lines.y));
        assert!(5 * binned.power.len() < lines.z.len(), "{}", binned.power.len());
        let found = Correlations::new(&binned, 40);
        let exact = |lag: i32, gain: &dyn Fn(f64) -> f64| -> f64 {
            let power = |k: usize| lines.weight[k].powi(2) * lines.y[k].norm_sqr();
            let of = |k: usize| power(k) * gain(lines.z[k].re) * lines.z[k].powi(lag).re;
            (0..lines.z.len()).map(of).sum()
        };
        let total = exact(0, &|_| 1.0);
        for (lag, found) in found.plain.iter().enumerate() {
            assert!((found - exact(lag as i32, &|_| 1.0)).abs() < 8e-4 * total, "{lag}");
        }
        for (f, b) in ZEROS.iter().enumerate() {
            let exact = exact(0, &|cosine| 1.0 / (1.0 + b * b - 2.0 * b * cosine));
            assert!((found.filtered[0][f] / exact - 1.0).abs() < 1e-3, "{b}: {} {exact}", found.filtered[0][f]);
        }
    }
}
