//! Where over frequency a system stays below a level, as intervals that rest on eigenvalues.

use super::curve::Curve;
use super::hamiltonian::Crossings;
use crate::Result;
use crate::lti::{StateSpace, TimeDomain};

/// The intervals `[low, high]` of frequency, rad/s, within which every singular value of a system in balanced states is below
/// `level`, rising. The largest singular value crosses a level at no other frequency than those of the eigenvalues, so one
/// value between two neighbours tells for all.
pub(crate) fn below_level<T: TimeDomain>(system: &StateSpace<T>, level: f64) -> Result<Vec<[f64; 2]>> {
    let curve = Curve::new(system)?;
    let end = curve.end();
    let mut marks = vec![0.0, end];
    if system.order() > 0 {
        marks.extend(Crossings::at_level(system, &curve, level)?.all().iter().map(|w| w.clamp(0.0, end)));
    }
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    let mut intervals: Vec<[f64; 2]> = Vec::new();
    for pair in marks.windows(2) {
        if curve.gain(between(pair[0], pair[1]))? >= level {
            continue;
        }
        match intervals.last_mut() {
            // The mark between two intervals is a crossing only where the level is reached there.
            Some(last) if last[1] == pair[0] && curve.gain(pair[0])? < level => last[1] = pair[1],
            _ => intervals.push([pair[0], pair[1]]),
        }
    }
    Ok(intervals)
}

/// A frequency between two, of which the upper one may be infinite.
pub(crate) fn between(low: f64, high: f64) -> f64 {
    if high.is_finite() { 0.5 * (low + high) } else { 2.0 * low + 1.0 }
}
