//! Settling periods, left out by evidence.
//!
//! A period is compared with the mean of those after it: in every channel and group of neighbouring lines, the ratio of its
//! squared distance to the variance of the others has an F distribution when the record is settled. Paulson's cube root
//! makes it a standard normal number, which above 4.5 (probability 3e-6 per group) counts as evidence of a transient.

use crate::statistics::f_deviations;
use faer::c64;

/// Lines of a group.
pub(super) const GROUP: usize = 8;
/// Standard normal number that counts as evidence.
const EVIDENCE: f64 = 4.5;
/// Variance of rounding, relative to the power of the line.
const ROUNDING: f64 = 1e-22;

/// Number of periods at the beginning that are not settled; at least two periods remain.
///
/// `periods[t]` holds the values of period t, channel after channel with `lines` values each.
pub(super) fn settling_periods(periods: &[Vec<c64>], lines: usize) -> usize {
    let last = periods.len().saturating_sub(2);
    (0..last).find(|&t| !differs(&periods[t], &periods[t + 1..], lines)).unwrap_or(last)
}

fn differs(period: &[c64], others: &[Vec<c64>], lines: usize) -> bool {
    let count = others.len() as f64;
    let mut distance = Vec::with_capacity(period.len());
    let mut scatter = Vec::with_capacity(period.len());
    for (k, value) in period.iter().enumerate() {
        let mean = others.iter().map(|o| o[k]).sum::<c64>() / count;
        let sum: f64 = others.iter().map(|o| (o[k] - mean).norm_sqr()).sum();
        distance.push((value - mean).norm_sqr() / (1.0 + 1.0 / count));
        scatter.push(sum / (count - 1.0) + ROUNDING * mean.norm_sqr());
    }
    let channels = distance.chunks(lines).zip(scatter.chunks(lines));
    channels.flat_map(|(d, s)| d.chunks(GROUP).zip(s.chunks(GROUP))).any(|(d, s)| evident(d, s, count))
}

/// Each line is scaled by the mean scatter of its group, so that one quiet line decides nothing.
fn evident(distance: &[f64], scatter: &[f64], count: f64) -> bool {
    let degrees = 2.0 * distance.len() as f64;
    let (distance, scatter): (f64, f64) = (distance.iter().sum(), scatter.iter().sum());
    if scatter <= 0.0 {
        return distance > 0.0;
    }
    f_deviations(distance / scatter, degrees, degrees * (count - 1.0)) > EVIDENCE
}
