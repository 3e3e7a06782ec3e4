//! Known disturbances of the outputs: unbalance and its harmonics, drift, anything whose shape is known but not its size.
//!
//! ```text
//! y(k) = (model) + a' w(k) + noise,    w: signals known in advance, a: signals x outputs, own for each experiment
//! ```
//! Left alone, each line of frequency f takes two states at `exp(+-2 pi i f ts)`. In the block-Hankel stage the rows of w
//! stand first and everything else is projected onto their complement; the fit of B, D and x0 has them as regressors and
//! finds a. The amplitudes are those of each experiment alone, because without an angle mark each record starts at a phase of
//! its own, and because speed and temperature change between records.
//!
//! All block rows of w count. Those of lines of constant frequency span two directions each; those of a speed that changes
//! span more, which the eigenvalues of their Gram matrix show.

use crate::lti::Discrete;
use crate::{Error, Mat, MatRef, Result};
use faer::Side;
use std::f64::consts::TAU;

/// Eigenvalues of the Gram matrix of the disturbances' Hankel data below this share of the largest are left in the data: 1e-5
/// of the amplitude.
const SPANNED: f64 = 1e-10;

/// Cosine and sine, samples x 2 per frequency, of lines of constant frequency; the phase is zero at the first sample.
///
/// # Errors
/// [`Error::OutOfRange`] for a frequency that is not between 0 and that of Nyquist.
///
/// ```
/// use youla::{identify::subspace::lines, lti::Discrete};
/// let w = lines(&[50.0], 100, Discrete::new(5e-3)?)?;
/// assert!((w[(1, 1)] - 1.0).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn lines(frequencies_hz: &[f64], samples: usize, time: Discrete) -> Result<Mat<f64>> {
    for hz in frequencies_hz {
        check_frequency("the frequency of a disturbance", *hz, time)?;
    }
    let angle = |k: usize, j: usize| TAU * (frequencies_hz[j] * time.ts() * k as f64).fract();
    Ok(cosines_and_sines(samples, frequencies_hz.len(), angle))
}

/// Cosine and sine, samples x 2 per harmonic, of multiples of a measured speed in Hz; the phase is its integral by the
/// trapezoidal rule, zero at the first sample.
///
/// # Errors
/// [`Error::OutOfRange`] for a speed or multiple of it that is not between 0 and the Nyquist frequency.
pub fn harmonics(speed_hz: &[f64], multiples: &[usize], time: Discrete) -> Result<Mat<f64>> {
    for (hz, n) in speed_hz.iter().flat_map(|hz| multiples.iter().map(move |n| (hz, n))) {
        check_frequency("a harmonic of the measured speed", hz * *n as f64, time)?;
    }
    let mut turns = vec![0.0; speed_hz.len()];
    for k in 1..speed_hz.len() {
        turns[k] = turns[k - 1] + 0.5 * time.ts() * (speed_hz[k - 1] + speed_hz[k]);
    }
    let angle = |k: usize, j: usize| TAU * (multiples[j] as f64 * turns[k]).fract();
    Ok(cosines_and_sines(speed_hz.len(), multiples.len(), angle))
}

fn cosines_and_sines(samples: usize, count: usize, angle: impl Fn(usize, usize) -> f64) -> Mat<f64> {
    Mat::from_fn(samples, 2 * count, |k, j| if j % 2 == 0 { angle(k, j / 2).cos() } else { angle(k, j / 2).sin() })
}

fn check_frequency(what: &str, hz: f64, time: Discrete) -> Result<()> {
    if hz > 0.0 && hz < 0.5 / time.ts() {
        return Ok(());
    }
    Err(Error::OutOfRange { what: what.into(), value: hz, must: "between 0 and the Nyquist frequency, in Hz" })
}

/// A line of one output: `amplitude cos(theta - phase)`, theta the angle of its cosine and sine.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineAmplitude {
    /// In the unit of the output.
    pub amplitude: f64,
    /// Radians, from -pi to pi.
    pub phase: f64,
}

/// Amplitude and phase per output (inner) and frequency (outer), from the coefficients of cosines and sines (signals x
/// outputs) that [`crate::identify::subspace::SubspaceModel::disturbances`] holds for each experiment.
pub fn amplitudes(coefficients: MatRef<'_, f64>) -> Vec<Vec<LineAmplitude>> {
    let line = |j: usize, i: usize| {
        let (a, b) = (coefficients[(2 * j, i)], coefficients[(2 * j + 1, i)]);
        LineAmplitude { amplitude: a.hypot(b), phase: b.atan2(a) }
    };
    (0..coefficients.nrows() / 2).map(|j| (0..coefficients.ncols()).map(|i| line(j, i)).collect()).collect()
}

/// What the block rows of the disturbances span.
pub(crate) struct Span {
    /// Orthogonal combinations of them, (block row, signal) x directions.
    pub(crate) basis: Mat<f64>,
    /// Their squared lengths.
    energy: Vec<f64>,
}

/// The span, from the Gram matrix of which the upper triangle by blocks is given.
pub(crate) fn span(gram: MatRef<'_, f64>) -> Span {
    let count = gram.nrows();
    let full = Mat::from_fn(count, count, |i, j| gram[(i.min(j), i.max(j))]);
    let Ok(eigen) = full.self_adjoint_eigen(Side::Lower) else {
        return Span { basis: Mat::identity(count, count), energy: vec![f64::INFINITY; count] };
    };
    let values = eigen.S().column_vector();
    let largest = values.iter().fold(0.0, |a: f64, b| a.max(*b));
    let kept: Vec<usize> = (0..count).filter(|k| values[*k] > SPANNED * largest).collect();
    Span {
        basis: Mat::from_fn(count, kept.len(), |i, k| eigen.U()[(i, kept[k])]),
        energy: kept.iter().map(|k| values[*k]).collect(),
    }
}

/// A Gram matrix beyond the disturbances.
pub(crate) struct Beyond {
    pub(crate) gram: Mat<f64>,
    /// Diagonal before.
    pub(crate) before: Vec<f64>,
    /// Directions taken.
    pub(crate) taken: usize,
}

/// `G_zz - G_zw G_ww^+ G_wz` from the Gram matrix of `[z; w]` with q and h channels per block.
pub(crate) fn beyond(all: MatRef<'_, f64>, q: usize, h: usize, blocks: usize) -> Beyond {
    let (z, w) = (|i: usize| i / q * (q + h) + i % q, |j: usize| j / h * (q + h) + q + j % h);
    let at = |a: usize, b: usize| all[(a.min(b), a.max(b))];
    let Span { basis, energy } = span(Mat::from_fn(h * blocks, h * blocks, |i, j| at(w(i), w(j))).as_ref());
    let mut along = basis.transpose() * Mat::from_fn(h * blocks, q * blocks, |i, j| at(w(i), z(j)));
    for (k, energy) in energy.iter().enumerate() {
        along.row_mut(k).iter_mut().for_each(|v| *v /= energy.sqrt());
    }
    let before = Mat::from_fn(q * blocks, q * blocks, |i, j| at(z(i), z(j)));
    let gram = &before - along.transpose() * &along;
    // Without eigenvalues nothing was taken out, and the data are left to QR.
    let size = |i: usize| if energy.contains(&f64::INFINITY) { f64::INFINITY } else { before[(i, i)] };
    Beyond { before: (0..q * blocks).map(size).collect(), gram, taken: energy.len() }
}
