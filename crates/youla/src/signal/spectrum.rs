//! Spectra by Welch's method, and the frequency response of a plant inside a loop from a known excitation.
//!
//! `S_yx(omega) = mean over segments of Y X^H / (fs sum w^2)`, Hann window w, one-sided, in units of y times x per Hz.
//! With d injected into the loop and uncorrelated with the noise, `G = S_yd S_ud^-1` is consistent where the direct
//! quotient `S_yu S_uu^-1` is not.
//!
//! Source: P. D. Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Trans. Audio
//! Electroacoust. 15 (1967), 70. L. Ljung, System Identification, 2nd ed. (1999), section 13.5 for the loop.

use crate::linalg::{block, check_finite, check_shape};
use crate::lti::{Discrete, FrequencyResponse};
use crate::{Error, Result};
use faer::prelude::*;
use faer::{Mat, MatRef, c64};
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

/// Segments that one task sums; fixed, so that the sum does not depend on the number of threads.
const CHUNK: usize = 8;

/// How a record is cut into segments.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Welch {
    /// Length of a segment in samples; the frequencies are `1 / (window ts)` Hz apart.
    pub window: usize,
    /// Part of a segment that the next one repeats, from 0 to below 1.
    pub overlap: f64,
    /// Take the mean out of every segment; the frequency zero is then left out of responses.
    pub remove_mean: bool,
}

impl Default for Welch {
    fn default() -> Self {
        Welch { window: 2048, overlap: 0.5, remove_mean: true }
    }
}

/// The cross spectrum of p with m signals.
#[derive(Debug, Clone)]
pub struct CrossSpectrum {
    /// One p x m matrix for each frequency, one-sided density per Hz.
    pub density: FrequencyResponse,
    /// Number of segments in the mean.
    pub segments: usize,
}

/// One record of an excited loop; row k is time k.
#[derive(Debug, Clone, Copy)]
pub struct ExcitedRecord<'a> {
    /// Excitation that is injected into the loop, samples x m.
    pub d: MatRef<'a, f64>,
    /// Plant input, samples x m.
    pub u: MatRef<'a, f64>,
    /// Plant output, samples x p.
    pub y: MatRef<'a, f64>,
}

/// The frequency response of a plant inside a loop.
#[derive(Debug, Clone)]
pub struct IndirectResponse {
    /// `S_yd S_ud^-1`, p x m.
    pub response: FrequencyResponse,
    /// Part of the power of each output that the excitation explains, frequencies x p, from 0 to 1.
    pub coherence_y: Mat<f64>,
    /// Part of the power of each input that the excitation explains, frequencies x m, from 0 to 1.
    pub coherence_u: Mat<f64>,
    /// Number of segments in the mean; coherences need several times the number of excitations to mean anything.
    pub segments: usize,
}

/// Estimates `S_yx` from `y` (samples x p) and `x` (samples x m); with `x = y` the spectrum itself.
///
/// A sine of amplitude A integrates to A^2 / 2 (held by `a_sine_has_its_power`).
///
/// # Errors
/// [`Error::Shape`] for records of different length, [`Error::NotFinite`], [`Error::OutOfRange`] for a window longer
/// than the record or a bad overlap.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::{Welch, cross_spectrum}};
/// let y = Mat::from_fn(512, 1, |k, _| (k as f64 * 0.3).sin());
/// let welch = Welch { window: 128, ..Welch::default() };
/// let spectrum = cross_spectrum(y.as_ref(), y.as_ref(), Discrete::new(1.0)?, &welch)?;
/// assert_eq!((spectrum.segments, spectrum.density.omega.len()), (7, 65));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn cross_spectrum(y: MatRef<f64>, x: MatRef<f64>, time: Discrete, welch: &Welch) -> Result<CrossSpectrum> {
    let (p, m) = (y.ncols(), x.ncols());
    check_shape("the second signal of a cross spectrum", x, (y.nrows(), m))?;
    let joint = Joint::estimate(&[block(&[&[y, x]])], time, welch)?;
    let values = joint.matrices().flat_map(|s| entries(s.submatrix(0, p, p, m))).collect();
    Ok(CrossSpectrum { density: FrequencyResponse::new(joint.omega.clone(), values, p, m), segments: joint.segments })
}

/// Estimates the response from `u` to `y` with the excitation `d` that is injected into the loop, averaged over the
/// segments of all records; no segment crosses from one record to the next.
///
/// # Errors
/// Those of [`cross_spectrum`], [`Error::Ports`] without any record; [`Error::Singular`] with the first frequency at
/// which `d` does not reach all inputs.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::{ExcitedRecord, Welch, indirect_response}};
/// let d = Mat::from_fn(4096, 1, |k, _| ((k * k) as f64 * 0.7).sin());
/// let y = Mat::from_fn(4096, 1, |k, _| 3.0 * d[(k, 0)]);
/// let welch = Welch { window: 64, ..Welch::default() };
/// let record = ExcitedRecord { d: d.as_ref(), u: d.as_ref(), y: y.as_ref() };
/// let found = indirect_response(&[record], Discrete::new(1.0)?, &welch)?;
/// assert!((found.response.at(5)[(0, 0)].re - 3.0).abs() < 1e-12);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn indirect_response(records: &[ExcitedRecord], time: Discrete, welch: &Welch) -> Result<IndirectResponse> {
    let Some(first) = records.first() else {
        return Err(Error::Ports { what: "the number of records".into(), expected: 1, found: 0 });
    };
    let (m, p) = (first.u.ncols(), first.y.ncols());
    for r in records {
        check_shape("the plant output", r.y, (r.y.nrows(), p))?;
        check_shape("the excitation", r.d, (r.y.nrows(), m))?;
        check_shape("the plant input", r.u, (r.y.nrows(), m))?;
    }
    let signals: Vec<Mat<f64>> = records.iter().map(|r| block(&[&[r.d, r.u, r.y]])).collect();
    let joint = Joint::estimate(&signals, time, welch)?;
    let (in_d, in_u, in_y) = (0..m, m..2 * m, 2 * m..2 * m + p);
    let first = usize::from(welch.remove_mean);
    let omega = joint.omega[first..].to_vec();
    let mut values = Vec::new();
    for (omega, s) in omega.iter().zip(joint.matrices().skip(first)) {
        let what = || format!("the cross spectrum of input and excitation at {omega:.6} rad/s");
        values.extend(entries(divide(part(s, &in_y, &in_d), part(s, &in_u, &in_d), what)?.as_ref()));
    }
    let (coherence_y, coherence_u) = (joint.explained(first, &in_d, &in_y)?, joint.explained(first, &in_d, &in_u)?);
    let response = FrequencyResponse::new(omega, values, p, m);
    Ok(IndirectResponse { response, coherence_y, coherence_u, segments: joint.segments })
}

/// What an excitation explains of some signals.
#[derive(Debug, Clone)]
pub struct ExplainedPower {
    /// Frequencies, rad/s.
    pub omega: Vec<f64>,
    /// Part of the power of each signal that the excitation explains, frequencies x p, from 0 to 1.
    pub coherence: Mat<f64>,
    /// One-sided power density of each signal per Hz, frequencies x p.
    pub power: Mat<f64>,
    /// Number of segments in the mean.
    pub segments: usize,
}

/// The part of the power of `y` (samples x p) that `d` (samples x m) explains, `S_yd S_dd^-1 S_dy` over `S_yy`.
///
/// # Errors
/// Those of [`cross_spectrum`]; [`Error::Singular`] with the first frequency at which channels of `d` depend on each other.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::{Welch, explained_power}};
/// let d = Mat::from_fn(4096, 1, |k, _| ((k * k) as f64 * 0.7).sin());
/// let y = Mat::from_fn(4096, 1, |k, _| 3.0 * d[(k, 0)]);
/// let welch = Welch { window: 64, ..Welch::default() };
/// let found = explained_power(d.as_ref(), y.as_ref(), Discrete::new(1.0)?, &welch)?;
/// assert!((found.coherence[(5, 0)] - 1.0).abs() < 1e-12);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn explained_power(d: MatRef<f64>, y: MatRef<f64>, time: Discrete, welch: &Welch) -> Result<ExplainedPower> {
    let (m, p) = (d.ncols(), y.ncols());
    check_shape("the excitation", d, (y.nrows(), m))?;
    let joint = Joint::estimate(&[block(&[&[d, y]])], time, welch)?;
    let first = usize::from(welch.remove_mean);
    let omega = joint.omega[first..].to_vec();
    let coherence = joint.explained(first, &(0..m), &(m..m + p))?;
    let mut power = Mat::zeros(omega.len(), p);
    for (k, s) in joint.matrices().skip(first).enumerate() {
        (0..p).for_each(|i| power[(k, i)] = s[(m + i, m + i)].re);
    }
    Ok(ExplainedPower { omega, coherence, power, segments: joint.segments })
}

fn part<'a>(s: MatRef<'a, c64>, rows: &Range<usize>, columns: &Range<usize>) -> MatRef<'a, c64> {
    s.submatrix(rows.start, columns.start, rows.len(), columns.len())
}

/// The spectrum of all signals with each other.
struct Joint {
    omega: Vec<f64>,
    /// One matrix after the other, column-major.
    values: Vec<c64>,
    signals: usize,
    segments: usize,
}

impl Joint {
    /// The mean over the segments of all records, which have the same signals.
    fn estimate(records: &[Mat<f64>], time: Discrete, welch: &Welch) -> Result<Joint> {
        let signals = records[0].ncols();
        let shortest = records.iter().map(Mat::nrows).min().unwrap_or(0);
        let cut = Cut::new(welch, shortest)?;
        let size = cut.frequencies() * signals * signals;
        let mut chunks = Vec::new();
        let mut segments = 0;
        for z in records {
            check_finite("the signal", z.as_ref())?;
            let all = cut.segments(z.nrows());
            chunks.extend((0..all).step_by(CHUNK).map(|first| (z, first..(first + CHUNK).min(all))));
            segments += all;
        }
        let sums: Vec<Vec<c64>> = chunks.into_par_iter().map(|(z, chunk)| cut.sum(z.as_ref(), chunk, size)).collect();
        let mut values = vec![c64::new(0.0, 0.0); size];
        sums.iter().for_each(|sum| values.iter_mut().zip(sum).for_each(|(total, part)| *total += part));
        cut.normalise(&mut values, signals, segments, time);
        let step = TAU / (welch.window as f64 * time.ts());
        let omega = (0..cut.frequencies()).map(|k| k as f64 * step).collect();
        Ok(Joint { omega, values, signals, segments })
    }

    fn matrices(&self) -> impl Iterator<Item = MatRef<'_, c64>> {
        let n = self.signals;
        (0..self.omega.len())
            .map(move |k| MatRef::from_column_major_slice(&self.values[k * n * n..(k + 1) * n * n], n, n))
    }

    /// Part of the power of `signals` that `d` explains, from the frequency `first` on.
    fn explained(&self, first: usize, d: &Range<usize>, signals: &Range<usize>) -> Result<Mat<f64>> {
        let omega = &self.omega[first..];
        let mut out = Mat::zeros(omega.len(), signals.len());
        for (k, s) in self.matrices().skip(first).enumerate() {
            let what = || format!("the spectrum of the excitation at {:.6} rad/s", omega[k]);
            let explained = divide(part(s, signals, d), part(s, d, d), what)? * part(s, d, signals);
            for (i, signal) in signals.clone().enumerate() {
                let power = s[(signal, signal)].re;
                out[(k, i)] = if power > 0.0 { explained[(i, i)].re / power } else { 0.0 };
            }
        }
        Ok(out)
    }
}

/// The segments and the window.
struct Cut {
    window: Vec<f64>,
    step: usize,
    remove_mean: bool,
    fft: Arc<dyn Fft<f64>>,
}

impl Cut {
    /// `shortest` is the number of samples of the shortest record.
    fn new(welch: &Welch, shortest: usize) -> Result<Cut> {
        let range = |what: &str, value, must| Err(Error::OutOfRange { what: what.to_owned(), value, must });
        if welch.window < 4 {
            return range("the window of a spectrum", welch.window as f64, "at least 4 samples");
        }
        if welch.window > shortest {
            let what = format!("the window of a spectrum of records of {shortest} samples");
            return range(&what, welch.window as f64, "not longer than any record");
        }
        if !(0.0..1.0).contains(&welch.overlap) {
            return range("the overlap of a spectrum", welch.overlap, "at least 0 and below 1");
        }
        let length = welch.window;
        let step = ((length as f64 * (1.0 - welch.overlap)).round() as usize).max(1);
        Ok(Cut {
            window: (0..length).map(|k| 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos()).collect(),
            step,
            remove_mean: welch.remove_mean,
            fft: FftPlanner::new().plan_fft_forward(length),
        })
    }

    /// Number of segments of a record.
    fn segments(&self, samples: usize) -> usize {
        (samples - self.window.len()) / self.step + 1
    }

    fn frequencies(&self) -> usize {
        self.window.len() / 2 + 1
    }

    /// Sum of `Z Z^H` over some segments.
    fn sum(&self, z: MatRef<f64>, segments: Range<usize>, size: usize) -> Vec<c64> {
        let n = z.ncols();
        let mut sum = vec![c64::new(0.0, 0.0); size];
        for segment in segments {
            let transforms: Vec<Vec<c64>> = (0..n).map(|j| self.transform(z, segment * self.step, j)).collect();
            for (k, s) in sum.chunks_exact_mut((n * n).max(1)).enumerate() {
                for j in 0..n {
                    let conjugate = transforms[j][k].conj();
                    (0..n).for_each(|i| s[i + j * n] += transforms[i][k] * conjugate);
                }
            }
        }
        sum
    }

    fn transform(&self, z: MatRef<f64>, first: usize, j: usize) -> Vec<c64> {
        let values = z.col(j).subrows(first, self.window.len());
        let mean = if self.remove_mean { values.iter().sum::<f64>() / values.nrows() as f64 } else { 0.0 };
        let windowed = values.iter().zip(&self.window).map(|(x, w)| c64::new((x - mean) * w, 0.0));
        let mut buffer: Vec<c64> = windowed.collect();
        self.fft.process(&mut buffer);
        buffer.truncate(self.frequencies());
        buffer
    }

    /// From sums to one-sided densities per Hz: all frequencies but zero and the Nyquist frequency count twice.
    fn normalise(&self, values: &mut [c64], signals: usize, segments: usize, time: Discrete) {
        let length = self.window.len();
        let energy: f64 = self.window.iter().map(|w| w * w).sum();
        let scale = time.ts() / (energy * segments as f64);
        for (k, s) in values.chunks_exact_mut((signals * signals).max(1)).enumerate() {
            let sides = if k == 0 || 2 * k == length { 1.0 } else { 2.0 };
            s.iter_mut().for_each(|x| *x *= sides * scale);
        }
    }
}

/// `a b^-1`, refused where `b` is singular.
fn divide(a: MatRef<c64>, b: MatRef<c64>, what: impl Fn() -> String) -> Result<Mat<c64>> {
    if b.nrows() == 1 && b[(0, 0)] != c64::ZERO {
        return Ok(Mat::from_fn(a.nrows(), 1, |i, _| a[(i, 0)] / b[(0, 0)]));
    }
    let rcond = match b.singular_values() {
        Ok(s) if s.first().is_some_and(|largest| *largest > 0.0) => s[s.len() - 1] / s[0],
        _ => 0.0,
    };
    if rcond > f64::EPSILON {
        Ok(b.transpose().partial_piv_lu().solve(a.transpose()).transpose().to_owned())
    } else {
        Err(Error::Singular { what: what(), rcond })
    }
}

fn entries<'a>(matrix: MatRef<'a, c64>) -> impl Iterator<Item = c64> + 'a {
    (0..matrix.ncols()).flat_map(move |j| (0..matrix.nrows()).map(move |i| matrix[(i, j)]))
}

#[cfg(test)]
mod tests;
