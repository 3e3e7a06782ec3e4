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
use super::driven::joint::Filters;
use super::driven::{Bins, Driven, Entry, Gains, Joint, hidden, longest};
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
    /// Before them, what up to seven outputs see together of noise at the inputs of the plant.
    pub(crate) joint: Option<Arc<Joint>>,
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
        let regression = vec![Regression::default(); outputs];
        Noise { regression, joint: None, root: one.clone(), covariance: one, log_det: 0.0 }
    }

    /// From the residuals of a model, lines x p per record.
    pub(crate) fn fit(
        spectra: &Spectra,
        residuals: &[Vec<c64>],
        (largest_order, coloured): (usize, bool),
        model: &Model,
    ) -> Self {
        let (p, samples) = (spectra.outputs, spectra.samples());
        let behind = |rest: &[Vec<c64>]| autoregression(spectra, rest, largest_order);
        if !separable(p) {
            return Noise::fit_together(spectra, residuals, (largest_order, coloured), model);
        }
        let log = (samples.max(2) as f64).ln();
        let gains = Gains::new(model, spectra);
        let of = |i: usize| {
            let own = of_output(residuals, (i, p));
            let (plain, least) = behind(&own);
            // The size of noise at the inputs first as if white noise were left, then with the autoregression that is.
            let (mut best, mut least, mut known) = (None, least - log, Regression::default());
            for _ in 0..SIZES {
                let Some(driven) = Driven::new(model, (spectra, &gains), &own, (i, &known)) else { break };
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
        let mut noise = Noise::of(spectra, (regression, None), &rest);
        noise.set_independent();
        noise
    }

    /// The same of up to seven outputs, which see noise at the inputs together.
    fn fit_together(
        spectra: &Spectra,
        residuals: &[Vec<c64>],
        (largest_order, coloured): (usize, bool),
        model: &Model,
    ) -> Self {
        let p = spectra.outputs;
        let of = |residuals: &[Vec<c64>], joint| Noise::behind(spectra, residuals, largest_order, joint);
        let mut best = of(residuals, None);
        if model.blocks.is_empty() {
            return best;
        }
        let bins = Bins::new(model, spectra, residuals);
        let mut known = vec![Regression::default(); p];
        for _ in 0..SIZES {
            let Some(joint) = Joint::new(model, (spectra, &bins), &known, coloured).map(Arc::new) else { break };
            let noise = of(&joint.rest(spectra, residuals), Some(joint));
            if noise.criterion(spectra.samples()) >= best.criterion(spectra.samples()) {
                break;
            }
            known = noise.regression.clone();
            best = noise;
            if known.iter().all(|known| known.coefficients.is_empty()) {
                break;
            }
        }
        best
    }

    /// The same with variances and a colour that are known of noise at the inputs; `None` where it has no filter.
    pub(crate) fn of_entry(
        spectra: &Spectra,
        residuals: &[Vec<c64>],
        largest_order: usize,
        model: &Model,
        entry: Entry,
    ) -> Option<Self> {
        if model.blocks.is_empty() || !entry.free.is_empty() {
            return None;
        }
        let hidden = hidden(model, longest(spectra), 0..spectra.outputs);
        let joint = Arc::new(Joint::of_entry(model, &hidden, entry)?);
        Some(Noise::behind(spectra, &joint.rest(spectra, residuals), largest_order, Some(joint)))
    }

    /// Noise at the inputs that up to seven outputs see together, also where autoregressions alone describe the residuals better.
    pub(crate) fn at_inputs(spectra: &Spectra, residuals: &[Vec<c64>], order: usize, model: &Model) -> Option<Self> {
        let p = spectra.outputs;
        if separable(p) || model.blocks.is_empty() {
            return None;
        }
        let bins = Bins::new(model, spectra, residuals);
        let white = vec![Regression::default(); p];
        let joint = Arc::new(Joint::new(model, (spectra, &bins), &white, true)?);
        Some(Noise::behind(spectra, &joint.rest(spectra, residuals), order, Some(joint)))
    }

    /// With the autoregression of each output behind what it makes of noise at its inputs, lines x p.
    pub(crate) fn behind(spectra: &Spectra, rest: &[Vec<c64>], order: usize, joint: Option<Arc<Joint>>) -> Self {
        let of = |i: usize| {
            let own = of_output(rest, (i, spectra.outputs));
            (autoregression(spectra, &own, order).0, own)
        };
        let (regression, rest): (Vec<Regression>, Vec<Vec<Vec<c64>>>) =
            (0..spectra.outputs).into_par_iter().map(of).unzip();
        Noise::of(spectra, (regression, joint), &rest)
    }

    /// With the covariance of what filters leave; `rest` is behind what the plant makes of noise at its inputs, by outputs and records.
    fn of(
        spectra: &Spectra,
        (regression, joint): (Vec<Regression>, Option<Arc<Joint>>),
        rest: &[Vec<Vec<c64>>],
    ) -> Self {
        let p = spectra.outputs;
        let mut noise = Noise { regression, joint, ..Noise::white(p) };
        let mut sum = Mat::<f64>::zeros(p, p);
        let of_record = |(k, lines): (usize, &Lines)| {
            let rest: Vec<&[c64]> = rest.iter().map(|rest| rest[k].as_slice()).collect();
            let of = |range| Arch::new().dispatch(Products { noise: &noise, lines, rest: &rest, range });
            parts(lines.z.len()).map(of).collect::<Vec<_>>()
        };
        let products: Vec<Vec<Mat<f64>>> = spectra.records.par_iter().enumerate().map(of_record).collect();
        products.iter().flatten().for_each(|part| sum += part);
        let samples = spectra.samples().max(1) as f64;
        for i in 0..p {
            for j in 0..=i {
                let value = sum[(i, j)] / samples + if i == j { ROUNDING * ROUNDING } else { 0.0 };
                (sum[(i, j)], sum[(j, i)]) = (value, value);
            }
        }
        noise.set_covariance(sum);
        noise
    }

    /// -2 log likelihood of residuals, but for poles outside of the unit circle, plus log N for each coefficient (Schwarz).
    fn criterion(&self, samples: usize) -> f64 {
        samples as f64 * self.log_det + (samples.max(2) as f64).ln() * self.parameters() as f64
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
        // Innovations of an unstable plant are larger than what a filter leaves that mirrors its poles, as those of single outputs do.
        let mirrored = self.joint.as_ref().map_or(1.0, |joint| joint.kalman.unstable);
        self.log_det = (0..p).map(|i| 2.0 * lower[(i, i)].ln()).sum::<f64>() - 2.0 * mirrored.ln();
        (self.root, self.covariance) = (root, covariance);
    }

    /// `(1 + a_1 / z + ...) / (1 - b / z) / H` of each output, H where it sees noise at the inputs by itself.
    pub(crate) fn filters(&self, z: c64, out: &mut [c64]) {
        let back = z.conj();
        for (value, regression) in out.iter_mut().zip(&self.regression) {
            *value = regression.at(back);
            if let Some(driven) = &regression.driven {
                *value *= driven.at(back);
            }
        }
    }

    /// Weight of the lines of a record over the root of the power spectrum at each output, up to a phase, lines x p.
    pub(crate) fn of_each_output(&self, lines: &Lines) -> Vec<c64> {
        let p = self.regression.len();
        let mut out = vec![c64::ZERO; lines.z.len() * p];
        let mut filters = self.joint.as_ref().map(|joint| joint.filters());
        let weights = lines.weight.chunks(LANES);
        for ((z, weights), out) in lines.z.chunks(LANES).zip(weights).zip(out.chunks_mut(LANES * p)) {
            if let (Some(joint), Some(filters)) = (&self.joint, &mut filters) {
                joint.filter(&Lanes::gather(|l| z[l.min(z.len() - 1)]), filters);
            }
            for (l, ((z, weight), out)) in z.iter().zip(weights).zip(out.chunks_mut(p)).enumerate() {
                self.filters(*z, out);
                let size = |i: usize| self.covariance[(i, i)].sqrt();
                let Some(Filters { h, .. }) = &filters else {
                    out.iter_mut().enumerate().for_each(|(i, v)| *v *= weight / size(i));
                    continue;
                };
                // H behind the autoregressions, its columns.
                let behind = |x: usize| c64::new(h[x].re[l], h[x].im[l]) / out[x % p];
                let h: Vec<c64> = (0..p * p).map(behind).collect();
                let power = |i: usize| {
                    let of = |j: usize, k: usize| (h[i * p + j] * h[i * p + k].conj()).re * self.covariance[(j, k)];
                    (0..p * p).map(|x| of(x / p, x % p)).sum::<f64>()
                };
                out.iter_mut().enumerate().for_each(|(i, v)| *v = c64::new(weight / power(i).sqrt(), 0.0));
            }
        }
        out
    }

    /// What enters at the inputs, where all outputs see it together.
    pub(crate) fn entry(&self) -> Option<&Entry> {
        self.joint.as_ref().map(|joint| &joint.kalman.entry)
    }

    /// Whether the plant shapes it at an output.
    pub(crate) fn enters_at_inputs(&self) -> bool {
        self.joint.is_some() || self.regression.iter().any(|regression| regression.driven.is_some())
    }

    /// Whether noise at the inputs has a colour; of many outputs, whose filters are held, it has none.
    pub(crate) fn has_a_colour(&self) -> bool {
        self.entry().is_some_and(|entry| entry.colour.is_some())
    }

    /// Number of its coefficients.
    pub(crate) fn parameters(&self) -> usize {
        let joint = self.joint.as_ref().map_or(0, |joint| joint.kalman.entry.parameters());
        self.regression.iter().map(Regression::parameters).sum::<usize>() + joint
    }
}

/// The autoregression of the residual of an output, per record, and its criterion.
fn autoregression(spectra: &Spectra, own: &[Vec<c64>], order: usize) -> (Regression, f64) {
    Correlations::new(&Binned::new(spectra, own), order).regression(spectra.samples())
}

/// The residual of one of p outputs, per record.
fn of_output(residuals: &[Vec<c64>], (output, p): (usize, usize)) -> Vec<Vec<c64>> {
    residuals.iter().map(|v| v.iter().skip(output).step_by(p).copied().collect()).collect()
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
