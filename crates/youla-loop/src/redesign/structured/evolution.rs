//! The (1+1) evolution strategy with covariance matrix adaptation by rank-one updates of its root (C. Igel, T. Suttorp, N. Hansen,
//! A computational efficient covariance matrix update and a (1+1)-CMA for evolution strategies, GECCO 2006, algorithm 2):
//! no derivatives, invariant to linear changes of the parameters, and at home on the edge of a limit that enters as a penalty.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Rate of success that the step size aims at.
const TARGET: f64 = 2.0 / 11.0;
/// Rate at which the mean rate of success follows.
const FOLLOWS: f64 = 1.0 / 12.0;
/// Mean rate of success from which on the path of the steps is not lengthened.
const HIGH: f64 = 0.44;

/// A point with its cost.
#[derive(Debug, Clone)]
pub(super) struct Point {
    pub(super) x: Vec<f64>,
    pub(super) cost: f64,
}

/// Searches from a point with a step size; `steps` evaluations of the cost, which is given the least cost so far and may return anything larger
/// for a larger one. The same seed gives the same result.
pub(super) fn evolve(
    start: Point,
    mut size: f64,
    (steps, seed): (usize, u64),
    mut cost: impl FnMut(&[f64], f64) -> f64,
) -> Point {
    let n = start.x.len();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut best, mut rate, mut shape) = (start, TARGET, Shape::new(n));
    for _ in 0..steps {
        let z: Vec<f64> = (0..n).map(|_| rng.sample(StandardNormal)).collect();
        let step = times(&shape.root, &z);
        let x: Vec<f64> = best.x.iter().zip(&step).map(|(x, s)| x + size * s).collect();
        let trial = Point { cost: cost(&x, best.cost), x };
        let better = trial.cost <= best.cost;
        rate = (1.0 - FOLLOWS) * rate + if better { FOLLOWS } else { 0.0 };
        size *= ((rate - TARGET) / ((1.0 - TARGET) * (1.0 + 0.5 * n as f64))).exp();
        if better {
            best = trial;
            shape.learn(&step, rate < HIGH);
        }
    }
    best
}

/// Root A of the covariance `A A^T`, its inverse, and the path of the steps.
struct Shape {
    root: Vec<Vec<f64>>,
    inverse: Vec<Vec<f64>>,
    path: Vec<f64>,
}

impl Shape {
    fn new(n: usize) -> Self {
        let unit: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(i == j)).collect()).collect();
        Shape { root: unit.clone(), inverse: unit, path: vec![0.0; n] }
    }

    /// `A A^T <- keep A A^T + learn path path^T`.
    fn learn(&mut self, step: &[f64], lengthen: bool) {
        let n = step.len() as f64;
        let (along, learn) = (2.0 / (n + 2.0), 2.0 / (n * n + 6.0));
        let added = if lengthen { (along * (2.0 - along)).sqrt() } else { 0.0 };
        let keep = 1.0 - learn + if lengthen { 0.0 } else { learn * along * (2.0 - along) };
        self.path.iter_mut().zip(step).for_each(|(p, s)| *p = (1.0 - along) * *p + added * s);
        let w = times(&self.inverse, &self.path);
        let square: f64 = w.iter().map(|w| w * w).sum();
        if square < 1e-20 {
            return;
        }
        let (root, grown) = (keep.sqrt(), (1.0 + learn * square / keep).sqrt());
        for (row, p) in self.root.iter_mut().zip(&self.path) {
            row.iter_mut().zip(&w).for_each(|(a, w)| *a = root * (*a + (grown - 1.0) / square * p * w));
        }
        let back: Vec<f64> =
            (0..w.len()).map(|j| w.iter().zip(&self.inverse).map(|(w, row)| w * row[j]).sum()).collect();
        for (row, w) in self.inverse.iter_mut().zip(&w) {
            row.iter_mut().zip(&back).for_each(|(a, b)| *a = (*a - (1.0 - 1.0 / grown) / square * w * b) / root);
        }
    }
}

fn times(matrix: &[Vec<f64>], x: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A long valley at an angle that a limit cuts: the best point on the limit is known.
    #[test]
    fn the_best_point_on_a_limit_is_found() {
        let cost = |x: &[f64]| {
            let (a, b) = (x[0] + x[1], 100.0 * (x[0] - x[1]));
            let beyond = (x[0].powi(2) + x[1].powi(2) - 2.0).max(0.0);
            -a + b * b + 20.0 * beyond
        };
        let start = Point { x: vec![-0.3, 0.2], cost: cost(&[-0.3, 0.2]) };
        let found = evolve(start.clone(), 0.3, (1500, 1), |x, _| cost(x));
        assert!((found.x[0] - 1.0).abs() < 1e-3 && (found.x[1] - 1.0).abs() < 1e-3, "{found:?}");
        assert_eq!(evolve(start, 0.3, (1500, 1), |x, _| cost(x)).x, found.x);
    }

    /// The inverse stays that of the root.
    #[test]
    fn the_update_is_of_rank_one() {
        let mut shape = Shape::new(3);
        for k in 0..40 {
            shape.learn(&[1.0, f64::from(k) * 0.1, -0.5], k % 3 == 0);
            for j in 0..3 {
                let column: Vec<f64> = shape.inverse.iter().map(|row| row[j]).collect();
                let unit = times(&shape.root, &column);
                assert!(unit.iter().enumerate().all(|(i, u)| (u - f64::from(i == j)).abs() < 1e-9), "{unit:?}");
            }
        }
    }
}
