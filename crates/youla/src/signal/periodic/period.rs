//! The period of an excitation and its excited lines, from the excitation itself.
//!
//! `D(q) = sum_k |d(k + q) - d(k)|^2`, per sample and relative to the variance of d, is zero at a period. All shifts come from one
//! autocorrelation; the search begins behind the first shift with `D > 1`, so that a slow signal is not taken for a constant.
//!
//! Source: A. de Cheveigne, H. Kawahara, YIN, a fundamental frequency estimator, J. Acoust. Soc. Am. 111 (2002), 1917, eq. (6).

use crate::linalg::check_finite;
use crate::{Error, Result};
use faer::{MatRef, c64};
use rustfft::FftPlanner;
use std::ops::Range;

/// Largest mean square of `d(k + q) - d(k)` at a period, relative to the variance of d: 15 bits of resolution pass.
const REPEATED: f64 = 1e-9;

/// Rows in which a shift is compared first, and the golden section, whose multiples spread them evenly over the record.
const COMPARED: usize = 256;
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Smallest power of an excited line, relative to the strongest: 60 dB.
const EXCITED: f64 = 1e-6;

/// The period of an excitation.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationPeriod {
    /// Length of a period in samples.
    pub samples: usize,
    /// The rows in which the excitation repeats itself; a fade at either end lies outside of them.
    pub rows: Range<usize>,
    /// Excited lines: multiples of `1 / (samples ts)` Hz above zero and below the Nyquist frequency, ascending.
    pub lines: Vec<usize>,
}

/// Detects the period of `d` (samples x m) that all channels share; constant parts and fades at the ends are allowed.
///
/// Costs one transform of twice the record for every two channels, up to three where the ends rest or do not repeat; none where no shift repeats
/// a few hundred rows.
///
/// # Errors
/// [`Error::NotPeriodic`] unless at least two whole periods repeat within 1e-9 of the variance, [`Error::NotFinite`].
///
/// ```
/// use youla::{Mat, signal::detect_period};
/// let d = Mat::from_fn(250, 1, |k, _| [1.0, -2.0, 0.5, 0.5, 3.0][k % 5]);
/// let found = detect_period(d.as_ref())?;
/// assert_eq!((found.samples, found.lines), (5, vec![1, 2]));
/// # Ok::<(), youla::Error>(())
/// ```
pub fn detect_period(d: MatRef<f64>) -> Result<ExcitationPeriod> {
    check_finite("the excitation", d)?;
    let active = active_rows(d);
    let quarter = active.len() / 4;
    let inner = active.start + quarter..active.end - quarter;
    let mut tried = vec![0..d.nrows(), active, inner];
    tried.dedup();
    for rows in tried {
        if let Some(samples) = shortest_shift(d.subrows(rows.start, rows.len())) {
            let rows = extend(d, rows, samples);
            let lines = excited_lines(d.subrows(rows.start, samples));
            return Ok(ExcitationPeriod { samples, rows, lines });
        }
    }
    Err(Error::NotPeriodic { what: "the excitation".into(), longest: d.nrows() / 2 })
}

/// Without the constant rows at both ends.
fn active_rows(d: MatRef<f64>) -> Range<usize> {
    let differs = |k: usize, from: usize| (0..d.ncols()).any(|j| d[(k, j)] != d[(from, j)]);
    let n = d.nrows();
    let start = (1..n).find(|&k| differs(k, 0)).unwrap_or(n);
    let end = (start..n).rev().find(|&k| differs(k, n - 1)).map_or(start, |k| k + 1);
    start..end
}

fn shortest_shift(d: MatRef<f64>) -> Option<usize> {
    let n = d.nrows();
    if n < 4 {
        return None;
    }
    let means: Vec<f64> = d.col_iter().map(|c| c.iter().sum::<f64>() / n as f64).collect();
    let energy: Vec<f64> = (0..n).map(|k| (0..d.ncols()).map(|j| (d[(k, j)] - means[j]).powi(2)).sum()).collect();
    let variance = energy.iter().sum::<f64>() / n as f64;
    // Of fewer rows some would be compared twice.
    if n > 8 * COMPARED && !(1..=n / 2).any(|q| may_repeat(d, q, 10.0 * REPEATED * n as f64 * variance)) {
        return None;
    }
    let correlation = autocorrelation(d, &means);
    let mut pair = 2.0 * energy.iter().sum::<f64>();
    let mut behind = false;
    for q in 1..=n / 2 {
        pair -= energy[q - 1] + energy[n - q];
        let difference = (pair - 2.0 * correlation[q]) / ((n - q) as f64 * variance);
        behind |= difference > 1.0;
        if behind && difference < 10.0 * REPEATED {
            // A slow signal also repeats almost at the shifts around its period: the best of them is the period.
            let near = (q..=n / 2).map(|s| (s, mismatch(d, s, variance))).take_while(|x| x.1 < 10.0 * REPEATED);
            let best = near.min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((shift, value)) = best
                && value < REPEATED
            {
                return Some(shift);
            }
        }
    }
    None
}

/// Whether the sum of squares of `d(k + q) - d(k)` over some rows, a part of that over all, stays within a limit.
fn may_repeat(d: MatRef<f64>, q: usize, limit: f64) -> bool {
    let rows = d.nrows() - q;
    let mut sum = 0.0;
    (0..COMPARED).all(|i| {
        let k = ((i as f64 * GOLDEN).fract() * rows as f64) as usize;
        sum += (0..d.ncols()).map(|j| (d[(k + q, j)] - d[(k, j)]).powi(2)).sum::<f64>();
        sum <= limit
    })
}

/// Mean square of `d(k + q) - d(k)`, relative to the variance.
fn mismatch(d: MatRef<f64>, q: usize, variance: f64) -> f64 {
    let rows = d.nrows() - q;
    let one = |j: usize| -> f64 { (0..rows).map(|k| (d[(k + q, j)] - d[(k, j)]).powi(2)).sum() };
    (0..d.ncols()).map(one).sum::<f64>() / (rows as f64 * variance)
}

/// Sum over the channels of the linear autocorrelation; two real channels share one complex transform.
fn autocorrelation(d: MatRef<f64>, means: &[f64]) -> Vec<f64> {
    let n = d.nrows();
    let length = (2 * n).next_power_of_two();
    let mut planner = FftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let mut power = vec![c64::new(0.0, 0.0); length];
    for j in (0..d.ncols()).step_by(2) {
        let value = |k: usize, j: usize| if j < d.ncols() { d[(k, j)] - means[j] } else { 0.0 };
        let mut buffer: Vec<c64> = (0..n).map(|k| c64::new(value(k, j), value(k, j + 1))).collect();
        buffer.resize(length, c64::new(0.0, 0.0));
        forward.process(&mut buffer);
        power.iter_mut().zip(&buffer).for_each(|(p, x)| p.re += x.norm_sqr());
    }
    inverse.process(&mut power);
    power.truncate(n / 2 + 1);
    power.iter().map(|x| x.re / length as f64).collect()
}

/// The rows around `rows` in which the shift still repeats the excitation, sample by sample.
fn extend(d: MatRef<f64>, rows: Range<usize>, period: usize) -> Range<usize> {
    let peak = (0..d.ncols()).map(|j| d.col(j).subrows(rows.start, rows.len()).norm_max()).fold(0.0, f64::max);
    let limit = 10.0 * REPEATED.sqrt() * peak;
    let repeats = |k: usize, other: usize| (0..d.ncols()).all(|j| (d[(k, j)] - d[(other, j)]).abs() <= limit);
    let start = (0..rows.start).rev().take_while(|&k| repeats(k, k + period)).last().unwrap_or(rows.start);
    let end = (rows.end..d.nrows()).take_while(|&k| repeats(k, k - period)).last().map_or(rows.end, |k| k + 1);
    start..end
}

fn excited_lines(d: MatRef<f64>) -> Vec<usize> {
    let n = d.nrows();
    let fft = FftPlanner::new().plan_fft_forward(n);
    let mut power = vec![0.0; n.div_ceil(2)];
    for column in d.col_iter() {
        let mut buffer: Vec<c64> = column.iter().map(|&x| c64::new(x, 0.0)).collect();
        fft.process(&mut buffer);
        power.iter_mut().zip(&buffer).skip(1).for_each(|(p, x)| *p += x.norm_sqr());
    }
    let strongest = power.iter().copied().fold(0.0, f64::max);
    (1..power.len()).filter(|&l| power[l] > EXCITED * strongest).collect()
}
