//! Where searches start: grids and low-discrepancy points over ranges of parameters.
//!
//! A parameter that is a rate, that is moves the diagonal of A alone, runs over the band of the response; any other over
//! two decades around its value. All ranges are logarithmic. Up to 64 points make a full grid; more parameters take the
//! points of J. H. Halton (Numerische Mathematik 2 (1960), 84).

use crate::structure::{Matrix, Structure};

/// Points of a grid along one parameter.
const LEVELS: usize = 5;
/// Largest full grid, and number of points where it would be larger.
const POINTS: usize = 64;
/// A rate is looked for from the lower end of the band over this to the upper end times it.
const BEYOND: f64 = 3.0;
/// Half of the range of a parameter that is not a rate.
const SPREAD: f64 = 10.0;
/// Bases of the Halton points.
const PRIMES: [usize; 16] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53];

/// From `low` to `high`, of one sign.
#[derive(Debug, Clone, Copy)]
pub(super) struct Range {
    low: f64,
    high: f64,
}

impl Range {
    /// The range around the value of a parameter that is not a rate.
    fn around(value: f64) -> Self {
        Range { low: value / SPREAD, high: value * SPREAD }
    }

    /// The range of an outer parameter for a response in `band`, rad/s.
    pub(super) fn of(structure: &dyn Structure, theta: &[f64], j: usize, band: [f64; 2]) -> Self {
        let slopes = structure.slopes(theta, j);
        let mut diagonal = slopes.iter().filter(|s| s.matrix == Matrix::A && s.row == s.column).map(|s| s.value);
        let elsewhere = slopes.iter().any(|s| s.matrix == Matrix::A && s.row != s.column);
        match diagonal.next() {
            Some(first) if first != 0.0 && !elsewhere && diagonal.all(|other| other == first) => {
                // The sign of a decaying rate: slope times parameter is negative.
                Range { low: -band[0] / BEYOND / first, high: -band[1] * BEYOND / first }
            }
            _ => Range::around(theta[j]),
        }
    }

    /// At a share from 0 to 1 of the logarithmic range; a range around zero is zero.
    fn at(self, share: f64) -> f64 {
        if self.low == 0.0 { 0.0 } else { self.low * (self.high / self.low).powf(share) }
    }
}

/// Points over the ranges.
pub(super) fn design(ranges: &[Range]) -> Vec<Vec<f64>> {
    let full = LEVELS.checked_pow(ranges.len() as u32).filter(|count| *count <= POINTS);
    let share = |k: usize, j: usize| match full {
        Some(_) => (k / LEVELS.pow(j as u32) % LEVELS) as f64 / (LEVELS - 1) as f64,
        None => halton(k + 1, PRIMES[j % PRIMES.len()]),
    };
    let point = |k: usize| ranges.iter().enumerate().map(|(j, range)| range.at(share(k, j))).collect();
    (0..full.unwrap_or(POINTS)).map(point).collect()
}

/// The points among which a projection looks for its start where the structure gives none: `theta` first, then points around it,
/// logarithmic in each parameter, which keeps its sign; zero stays zero.
pub(super) fn decades(theta: &[f64]) -> Vec<Vec<f64>> {
    let point = |k: usize| {
        let share = |j: usize| halton(k, PRIMES[j % PRIMES.len()]);
        theta.iter().enumerate().map(|(j, value)| Range::around(*value).at(share(j))).collect()
    };
    [theta.to_vec()].into_iter().chain((1..POINTS).map(point)).collect()
}

/// The digits of `k` in a base, mirrored at the point.
fn halton(mut k: usize, base: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / base as f64);
    while k > 0 {
        value += (k % base) as f64 * digit;
        digit /= base as f64;
        k /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halton_points_are_the_published_ones() {
        let first: Vec<f64> = (1..=4).map(|k| halton(k, 2)).collect();
        assert_eq!(first, [0.5, 0.25, 0.75, 0.125]);
        assert!((halton(5, 3) - 7.0 / 9.0).abs() < 1e-15);
    }

    #[test]
    fn points_around_a_vector_keep_signs() {
        let points = decades(&[1.0, -3.0, 0.0]);
        assert_eq!((points.len(), &points[0]), (64, &vec![1.0, -3.0, 0.0]));
        assert!(points.iter().all(|p| (0.1..=10.0).contains(&p[0]) && (-30.0..=-0.3).contains(&p[1]) && p[2] == 0.0));
        let low = points[1..].iter().filter(|p| p[1] > -3.0).count();
        assert!((26..=37).contains(&low), "{low}");
    }

    #[test]
    fn grids_reach_both_ends() {
        let ranges = [Range { low: 1.0, high: 100.0 }, Range { low: -1.0, high: -16.0 }];
        let points = design(&ranges);
        assert_eq!((points.len(), &points[0], &points[24]), (25, &vec![1.0, -1.0], &vec![100.0, -16.0]));
        assert_eq!(points[2][0], 10.0);
        assert_eq!(design(&[]), [Vec::<f64>::new()]);
        assert_eq!(design(&[ranges[0]; 7]).len(), 64);
    }
}
