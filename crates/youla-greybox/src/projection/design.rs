//! Where searches start: grids and low-discrepancy points over ranges of parameters.
//!
//! A parameter that is a rate, that is moves the diagonal of A alone, runs over the band of the response; any other over
//! two decades around its value. All ranges are logarithmic. Up to 64 points make a full grid; more parameters take the
//! points of J. H. Halton (Numerische Mathematik 2 (1960), 84).

use super::super::structure::{Matrix, Structure};

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
    /// The range of parameter `j` around `value`.
    fn around(value: f64, spread: f64) -> Self {
        Range { low: value / spread, high: value * spread }
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
            _ => Range::around(theta[j], SPREAD),
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

/// Where points around a parameter vector lie.
pub(in super::super) struct Neighbourhood<'a> {
    /// Each parameter over its value from one over this to this.
    pub(in super::super) factor: f64,
    /// Points, the vector itself among them.
    pub(in super::super) points: usize,
    /// Every how many-th of Halton's points is taken. The first points of a large base lie close together at the lower end; with
    /// 409 they do not (L. Kocis and W. J. Whiten, ACM Trans. Math. Softw. 23 (1997), 266).
    pub(in super::super) leap: usize,
    /// Smallest and largest value of each parameter.
    pub(in super::super) limits: &'a [(f64, f64)],
}

/// Points around a parameter vector, itself first; logarithmic in each parameter, which keeps its sign, and zero stays zero.
pub(in super::super) fn spread(theta: &[f64], around: &Neighbourhood<'_>) -> Vec<Vec<f64>> {
    let range = |(value, (min, max)): (&f64, &(f64, f64))| {
        let Range { low, high } = Range::around(*value, around.factor);
        Range { low: low.max(*min).min(*max), high: high.max(*min).min(*max) }
    };
    let ranges: Vec<Range> = theta.iter().zip(around.limits).map(range).collect();
    let point = |k: usize| {
        let share = |j: usize| halton(k * around.leap, PRIMES[j % PRIMES.len()]);
        ranges.iter().enumerate().map(|(j, range)| range.at(share(j))).collect()
    };
    [theta.to_vec()].into_iter().chain((1..around.points).map(point)).collect()
}

/// The points among which a projection looks for its start where the structure gives none.
pub(super) fn decades(theta: &[f64]) -> Vec<Vec<f64>> {
    let limits = vec![(f64::NEG_INFINITY, f64::INFINITY); theta.len()];
    spread(theta, &Neighbourhood { factor: SPREAD, points: POINTS, leap: 1, limits: &limits })
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
    fn points_around_a_vector_keep_signs_and_limits() {
        let limits = [(0.5, 2.0), (f64::NEG_INFINITY, 0.0), (f64::NEG_INFINITY, f64::INFINITY)];
        let around = Neighbourhood { factor: 4.0, points: 50, leap: 409, limits: &limits };
        let points = spread(&[1.0, -3.0, 0.0], &around);
        assert_eq!((points.len(), &points[0]), (50, &vec![1.0, -3.0, 0.0]));
        assert!(points.iter().all(|p| (0.5..=2.0).contains(&p[0]) && (-12.0..=-0.75).contains(&p[1]) && p[2] == 0.0));
        let low = points[1..].iter().filter(|p| p[1] > -3.0).count();
        assert!((20..=29).contains(&low), "{low}");
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
