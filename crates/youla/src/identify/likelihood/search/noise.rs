//! The spectrum of the noise at the outputs, as the search weights it: an autoregression per output, where the evidence asks for
//! it with one zero, and the covariance of what these leave.
//!
//! ```text
//! v_i(t) + a_i1 v_i(t-1) + ... = e_i(t) - b_i e_i(t-1),     E e e' = Lambda
//! ```
//! Orders by the Bayesian criterion from the autocorrelations of the residuals (`autoregression`). White noise is order 0. The
//! zero serves slow drift below white noise, which would take an autoregression of some hundred coefficients. Noise that enters at the inputs of
//! the plant comes before both (`driven`).

use super::autoregression::{Binned, Correlations, Regression};
use super::driven::{Driven, Gains};
use super::model::Model;
use super::separable::separable;
use crate::identify::likelihood::data::lanes::{LANES, Lanes, add_real_product};
use crate::identify::likelihood::data::spectra::{Lines, Spectra, parts};
use faer::{Mat, c64};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Coefficients and covariance.
#[derive(Debug, Clone)]
pub(crate) struct Noise {
    /// a_1 ... and b of each output.
    pub(crate) regression: Vec<Regression>,
    /// Inverse of the Cholesky factor of Lambda, lower triangular, p x p; of many outputs that of its diagonal.
    pub(crate) root: Mat<f64>,
    /// Lambda, p x p, in units of the scaled outputs.
    pub(crate) covariance: Mat<f64>,
    /// Logarithm of the determinant of Lambda, or of its diagonal.
    pub(crate) log_det: f64,
}

/// Sizes of noise at the inputs that are tried one after the other.
const SIZES: usize = 2;
/// Residuals below this share of the (unit) outputs are rounding.
const ROUNDING: f64 = 1e-7;

impl Noise {
    /// White noise of unit size.
    pub(crate) fn white(outputs: usize) -> Self {
        let one = Mat::identity(outputs, outputs);
        Noise { regression: vec![Regression::default(); outputs], root: one.clone(), covariance: one, log_det: 0.0 }
    }

    /// From the residuals of a model, lines x p per record.
    pub(crate) fn fit(
        spectra: &Spectra,
        residuals: &[Vec<c64>],
        (largest_order, coloured): (usize, bool),
        model: &Model,
    ) -> Self {
        let p = spectra.outputs;
        let (samples, log) = (spectra.samples(), (spectra.samples().max(2) as f64).ln());
        let behind =
            |rest: &[Vec<c64>]| Correlations::new(&Binned::new(spectra, rest), largest_order).regression(samples);
        let gains = Gains::new(model, spectra);
        let of = |i: usize| {
            let own = |v: &Vec<c64>| v.iter().skip(i).step_by(p).copied().collect();
            let own: Vec<Vec<c64>> = residuals.iter().map(own).collect();
            let (plain, least) = behind(&own);
            // The size of noise at the inputs first as if white noise were left, then with the autoregression that is.
            let (mut best, mut least, mut known) = (None, least - log, Regression::default());
            for _ in 0..SIZES {
                let Some(driven) = Driven::new(model, (spectra, &gains), &own, (i, &known), coloured) else { break };
                let rest = driven.rest(spectra, &own);
                let (noise, criterion) = behind(&rest);
                if criterion >= least {
                    break;
                }
                (least, known) = (criterion, noise.clone());
                best = Some((Regression { driven: Some(Arc::new(driven)), ..noise }, rest));
                if known.coefficients.is_empty() {
                    break;
                }
            }
            best.unwrap_or((plain, own))
        };
        let (regression, rest): (Vec<Regression>, Vec<Vec<Vec<c64>>>) = (0..p).into_par_iter().map(of).unzip();
        let mut noise = Noise { regression, ..Noise::white(p) };
        let mut sum = Mat::<f64>::zeros(p, p);
        for (k, lines) in spectra.records.iter().enumerate() {
            let rest: Vec<&[c64]> = rest.iter().map(|rest| rest[k].as_slice()).collect();
            let of = |range| Arch::new().dispatch(Products { noise: &noise, lines, rest: &rest, range });
            parts(lines.z.len()).map(of).collect::<Vec<_>>().iter().for_each(|part| sum += part);
        }
        let samples = samples.max(1) as f64;
        for i in 0..p {
            for j in 0..=i {
                let value = sum[(i, j)] / samples + if i == j { ROUNDING * ROUNDING } else { 0.0 };
                (sum[(i, j)], sum[(j, i)]) = (value, value);
            }
        }
        noise.set_covariance(sum);
        if separable(p) {
            noise.set_independent();
        }
        noise
    }

    /// Counts the innovations of the outputs as independent.
    fn set_independent(&mut self) {
        let variance = |i: usize| self.covariance[(i, i)];
        let p = self.covariance.nrows();
        self.log_det = (0..p).map(|i| variance(i).ln()).sum();
        self.root = Mat::from_fn(p, p, |i, j| if i == j { 1.0 / variance(i).sqrt() } else { 0.0 });
    }

    fn set_covariance(&mut self, covariance: Mat<f64>) {
        let p = covariance.nrows();
        let factor = |m: &Mat<f64>| m.llt(faer::Side::Lower).ok().map(|c| c.L().to_owned());
        let lower = factor(&covariance).unwrap_or_else(|| {
            Mat::from_fn(p, p, |i, j| if i == j { covariance[(i, i)].max(ROUNDING * ROUNDING).sqrt() } else { 0.0 })
        });
        let mut root = Mat::<f64>::zeros(p, p);
        for j in 0..p {
            for i in j..p {
                let mut value = if i == j { 1.0 } else { 0.0 };
                for l in j..i {
                    value -= lower[(i, l)] * root[(l, j)];
                }
                root[(i, j)] = value / lower[(i, i)];
            }
        }
        self.log_det = (0..p).map(|i| 2.0 * lower[(i, i)].ln()).sum();
        (self.root, self.covariance) = (root, covariance);
    }

    /// `(1 + a_1 / z + ...) / (1 - b / z) / H` of each output.
    pub(crate) fn filters(&self, z: c64, out: &mut [c64]) {
        let back = z.conj();
        for (value, regression) in out.iter_mut().zip(&self.regression) {
            *value = regression.at(back);
            if let Some(driven) = &regression.driven {
                *value *= driven.at(back);
            }
        }
    }

    /// Whether the plant shapes it at an output.
    pub(crate) fn enters_at_inputs(&self) -> bool {
        self.regression.iter().any(|regression| regression.driven.is_some())
    }

    /// Whether noise at the inputs has a colour.
    pub(crate) fn has_a_colour(&self) -> bool {
        self.regression.iter().any(|r| r.driven.as_ref().is_some_and(|driven| driven.entry.colour.is_some()))
    }

    /// Number of its coefficients.
    pub(crate) fn parameters(&self) -> usize {
        self.regression.iter().map(Regression::parameters).sum()
    }
}

/// Sums of the products of the whitened residuals over a part of the lines of a record, lower triangle, with the widest
/// instructions that the processor has.
struct Products<'a> {
    noise: &'a Noise,
    lines: &'a Lines,
    /// Of each output, behind what the plant makes of noise at its inputs.
    rest: &'a [&'a [c64]],
    range: Range<usize>,
}

impl NullaryFnOnce for Products<'_> {
    type Output = Mat<f64>;

    #[inline(always)]
    fn call(self) -> Mat<f64> {
        let Products { noise, lines, rest, range } = self;
        let p = noise.regression.len();
        let mut sums = vec![[0.0; LANES]; p * p];
        let mut white = vec![Lanes::ZERO; p];
        for first in range.clone().step_by(LANES) {
            let count = LANES.min(range.end - first);
            let line = |l: usize| first + l.min(count - 1);
            let back = Lanes::gather(|l| lines.z[line(l)]).conj();
            let weight = |l: usize| if l < count { lines.weight[line(l)] } else { 0.0 };
            for (i, white) in white.iter_mut().enumerate() {
                *white = Lanes::gather(|l| rest[i][line(l)] * weight(l));
                white.multiply(&noise.regression[i].behind(&back));
            }
            for i in 0..p {
                for j in 0..=i {
                    add_real_product(&mut sums[i * p + j], &white[i], &white[j]);
                }
            }
        }
        Mat::from_fn(p, p, |i, j| sums[i * p + j].iter().sum())
    }
}
