//! Peak over frequency of the structured singular value for complex diagonal uncertainty, by its upper bound
//!
//! ```text
//! mu(M) <= min over D = diag(d) > 0 of sigma_max(D M D^-1)
//! ```
//!
//! with equality up to three channels (A. Packard and J. Doyle, Automatica 29 (1993), 71). No grid: a scaling that is best at
//! one frequency keeps `sigma_max(D M D^-1)` below a level over intervals that eigenvalues give exactly. Scalings are added
//! until their intervals cover all frequencies, which proves the level; where the bound itself exceeds it, the level rises.

use super::peak_of;
use crate::lti::{Curve, PeakGain, StateSpace, TimeDomain, below_level, largest_singular_value};
use crate::{Mat, MatRef, Result, c64};

/// Relative distance of the two bounds.
const TOLERANCE: f64 = 1e-4;

/// Scalings that are tried; beyond, the best constant scaling gives the upper bound.
const LIMIT: usize = 60;

/// Largest logarithm of a scaling.
const REACH: f64 = 12.0;

/// Bounds of the peak of a stable square system.
pub(super) fn structured_peak<T: TimeDomain>(system: &StateSpace<T>) -> Result<PeakGain> {
    let system = system.balanced()?;
    let curve = Curve::new(&system)?;
    let end = curve.end();
    let mut best = Best { value: 0.0, frequency: 0.0, scaling: vec![0.0; system.inputs()] };
    let mut cover = Cover { level: 0.0, scalings: Vec::new(), intervals: Vec::new() };
    for start in [0.0, end, peak_of(&system)?.frequency] {
        cover.scalings.push(best.visit(&curve, start)?);
    }
    for iterations in 1..=LIMIT {
        cover.extend(&system, best.value * (1.0 + TOLERANCE))?;
        let Some([low, high]) = cover.widest_gap(end) else {
            return Ok(PeakGain { value: best.value, upper: cover.level, frequency: best.frequency, iterations });
        };
        let between = match (low, high.is_finite()) {
            (0.0, true) => 0.5 * high,
            (_, true) => (low * high).sqrt(),
            _ => 2.0 * low + 1.0,
        };
        cover.scalings.push(best.visit(&curve, between)?);
    }
    let constant = peak_of(&scaled(&system, &best.scaling)?)?;
    Ok(PeakGain { value: best.value, upper: constant.upper, frequency: best.frequency, iterations: LIMIT })
}

/// The highest bound so far.
struct Best {
    value: f64,
    frequency: f64,
    scaling: Vec<f64>,
}

impl Best {
    /// The best scaling at a frequency.
    fn visit<T: TimeDomain>(&mut self, curve: &Curve<T>, frequency: f64) -> Result<Vec<f64>> {
        let response = curve.at(frequency)?;
        let (value, scaling) = best_scaling(response.as_ref())?;
        if value > self.value {
            (self.value, self.frequency, self.scaling) = (value, frequency, scaling.clone());
        }
        Ok(scaling)
    }
}

/// Scalings and the intervals of frequency in which each keeps below a level.
struct Cover {
    level: f64,
    scalings: Vec<Vec<f64>>,
    intervals: Vec<Vec<[f64; 2]>>,
}

impl Cover {
    /// Brings the intervals to a level and to all scalings.
    fn extend<T: TimeDomain>(&mut self, system: &StateSpace<T>, level: f64) -> Result<()> {
        if level != self.level {
            self.level = level;
            self.intervals.clear();
        }
        for scaling in &self.scalings[self.intervals.len()..] {
            self.intervals.push(below_level(&scaled(system, scaling)?, level)?);
        }
        Ok(())
    }

    /// The widest interval from zero to the end in which no scaling keeps below the level, relative to its place; `None` where
    /// there is none.
    fn widest_gap(&self, end: f64) -> Option<[f64; 2]> {
        let mut covered: Vec<[f64; 2]> = self.intervals.concat();
        covered.sort_by(|x, y| x[0].total_cmp(&y[0]));
        let (mut reached, mut size, mut widest) = (0.0, 0.0, None);
        for [low, high] in covered.into_iter().chain([[end, end]]) {
            let gap = if low.is_finite() { (low - reached) / (low + reached).max(f64::MIN_POSITIVE) } else { 1.0 };
            if low > reached && gap > size {
                (size, widest) = (gap, Some([reached, low]));
            }
            reached = high.max(reached);
        }
        widest
    }
}

/// `D M D^-1`, D from its logarithms.
fn scaled<T: TimeDomain>(system: &StateSpace<T>, scaling: &[f64]) -> Result<StateSpace<T>> {
    let diagonal = |sign: f64| {
        Mat::from_fn(scaling.len(), scaling.len(), |i, j| if i == j { (sign * scaling[i]).exp() } else { 0.0 })
    };
    Ok(system.map_output(&diagonal(1.0)).map_input(&diagonal(-1.0)))
}

/// The least largest singular value of `D M D^-1` and the logarithms of D: the function is convex in them, and each in turn is
/// searched by golden section.
fn best_scaling(m: MatRef<'_, c64>) -> Result<(f64, Vec<f64>)> {
    let size = m.nrows();
    let value = |x: &[f64]| {
        let scaled = Mat::from_fn(size, size, |i, j| m[(i, j)] * (x[i] - x[j]).exp());
        largest_singular_value(scaled.as_ref())
    };
    let mut x = vec![0.0; size];
    let mut least = value(&x)?;
    for _ in 0..if size == 2 { 1 } else { 12 } {
        let before = least;
        for k in 1..size {
            let start = x[k];
            let (found, at) = golden_section(|step| {
                x[k] = step;
                value(&x)
            })?;
            (x[k], least) = if found < least { (at, found) } else { (start, least) };
        }
        if least >= before * (1.0 - 1e-9) {
            break;
        }
    }
    Ok((least, x))
}

/// The least value of a convex function within the reach, and where.
fn golden_section(mut f: impl FnMut(f64) -> Result<f64>) -> Result<(f64, f64)> {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (-REACH, REACH);
    let (mut x, mut y) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_x, mut at_y) = (f(x)?, f(y)?);
    while high - low > 1e-6 {
        if at_x < at_y {
            (high, y, at_y) = (y, x, at_x);
            x = high - ratio * (high - low);
            at_x = f(x)?;
        } else {
            (low, x, at_x) = (x, y, at_y);
            y = low + ratio * (high - low);
            at_y = f(y)?;
        }
    }
    Ok(if at_x < at_y { (at_x, x) } else { (at_y, y) })
}
