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
use crate::linalg::golden_section;
use crate::lti::{Curve, PeakGain, StateSpace, TimeDomain, below_level, largest_singular_value};
use crate::{Error, Mat, MatRef, Result, c64};
use faer::Side;

/// Relative distance of the two bounds.
const TOLERANCE: f64 = 1e-4;

/// Scalings that are tried; beyond, the best constant scaling gives the upper bound.
const LIMIT: usize = 60;

/// Channels from which a low rank is looked for, and singular values over the largest that are rounding.
const MANY: usize = 8;
const ROUNDING: f64 = 1e-13;

/// Largest logarithm of a scaling.
const REACH: f64 = 12.0;
/// Width within which a logarithm is found.
const WITHIN: f64 = 1e-6;

/// Bounds of the peak of a stable square system, whose difference from a multiple of the identity may have a low rank.
pub(super) fn structured_peak<T: TimeDomain>(system: &StateSpace<T>, identity: f64) -> Result<PeakGain> {
    let system = system.balanced()?;
    let curve = Curve::new(&system)?;
    let end = curve.end();
    let mut best = Best { value: 0.0, frequency: 0.0, scaling: vec![0.0; system.inputs()], identity };
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
    /// The multiple of the identity.
    identity: f64,
}

impl Best {
    /// The best scaling at a frequency.
    fn visit<T: TimeDomain>(&mut self, curve: &Curve<T>, frequency: f64) -> Result<Vec<f64>> {
        let response = curve.at(frequency)?;
        let (value, scaling) = best_scaling(&Gain::new(response.as_ref(), self.identity)?)?;
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

/// `sigma_max(D M D^-1)` as a function of the logarithms of D.
///
/// The loop of p outputs and m inputs has `M = c I + A B*` with as many columns as inputs. With `[D A, D^-1 B] = Q R`,
/// ```text
/// sigma_max^2 = c^2 + max(0, lambda_max(R [B* D^-2 B, c I; c I, 0] R*))
/// ```
enum Gain {
    Whole(Mat<c64>),
    LowRank { identity: f64, left: Mat<c64>, right: Mat<c64> },
}

impl Gain {
    fn new(m: MatRef<'_, c64>, identity: f64) -> Result<Self> {
        let size = m.nrows();
        if size < MANY {
            return Ok(Gain::Whole(m.to_owned()));
        }
        let rest = Mat::from_fn(size, size, |i, j| m[(i, j)] - if i == j { identity } else { 0.0 });
        let svd = rest.svd().map_err(|_| Error::NoConvergence { what: "a low rank".into(), iterations: 0 })?;
        let values: Vec<f64> = svd.S().column_vector().iter().map(|s| s.re).collect();
        let rank = values.iter().filter(|s| **s > ROUNDING * (values[0] + identity)).count();
        if 2 * rank >= size {
            return Ok(Gain::Whole(m.to_owned()));
        }
        let left = Mat::from_fn(size, rank, |i, k| svd.U()[(i, k)] * values[k]);
        Ok(Gain::LowRank { identity, left, right: svd.V().subcols(0, rank).to_owned() })
    }

    fn size(&self) -> usize {
        match self {
            Gain::Whole(m) => m.nrows(),
            Gain::LowRank { left, .. } => left.nrows(),
        }
    }

    fn at(&self, x: &[f64]) -> Result<f64> {
        let (identity, left, right) = match self {
            Gain::Whole(m) => {
                let scaled = Mat::from_fn(x.len(), x.len(), |i, j| m[(i, j)] * (x[i] - x[j]).exp());
                return largest_singular_value(scaled.as_ref());
            }
            Gain::LowRank { identity, left, right } => (*identity, left, right),
        };
        let rank = left.ncols();
        let both = Mat::from_fn(x.len(), 2 * rank, |i, k| match k.checked_sub(rank) {
            None => left[(i, k)] * x[i].exp(),
            Some(k) => right[(i, k)] * (-x[i]).exp(),
        });
        let right = both.subcols(rank, rank);
        let mut inner = Mat::<c64>::zeros(2 * rank, 2 * rank);
        inner.submatrix_mut(0, 0, rank, rank).copy_from(right.adjoint() * right);
        for k in 0..rank {
            (inner[(k, rank + k)], inner[(rank + k, k)]) = (c64::new(identity, 0.0), c64::new(identity, 0.0));
        }
        let root = both.qr().thin_R().to_owned();
        let values = (&root * inner * root.adjoint()).self_adjoint_eigenvalues(Side::Lower);
        let values = values.map_err(|_| Error::NoConvergence { what: "a largest gain".into(), iterations: 0 })?;
        Ok((identity * identity + values.last().copied().unwrap_or(0.0).max(0.0)).sqrt())
    }
}

/// The least largest singular value of `D M D^-1` and the logarithms of D: the function is convex in them, and each in turn is
/// searched by golden section.
fn best_scaling(gain: &Gain) -> Result<(f64, Vec<f64>)> {
    let size = gain.size();
    let value = |x: &[f64]| gain.at(x);
    let mut x = vec![0.0; size];
    let mut least = value(&x)?;
    for _ in 0..if size == 2 { 1 } else { 12 } {
        let before = least;
        for k in 1..size {
            let start = x[k];
            let (found, at) = golden_section([-REACH, REACH], WITHIN, |step| {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Of nine channels and a difference of rank two from the identity: the gain by the low rank is that by all singular values.
    #[test]
    fn a_gain_of_low_rank_is_the_largest_singular_value() {
        let entry = |i: usize, k: usize, phase: f64| c64::cis((3 * i + 7 * k) as f64 + phase) * (1.0 + i as f64);
        let (a, b) = (Mat::from_fn(9, 2, |i, k| entry(i, k, 0.3)), Mat::from_fn(9, 2, |i, k| entry(i * i, k, 1.1)));
        let m = Mat::<c64>::identity(9, 9) + &a * b.adjoint() * faer::Scale(c64::new(0.01, 0.0));
        let gain = Gain::new(m.as_ref(), 1.0).unwrap();
        assert!(matches!(gain, Gain::LowRank { .. }));
        for step in [0.0, 0.4, -1.5] {
            let x: Vec<f64> = (0..9).map(|i| step * (i as f64).cos()).collect();
            let (low, whole) = (gain.at(&x).unwrap(), Gain::Whole(m.clone()).at(&x).unwrap());
            assert!((low / whole - 1.0).abs() < 1e-12, "{low} and {whole}");
        }
    }
}
