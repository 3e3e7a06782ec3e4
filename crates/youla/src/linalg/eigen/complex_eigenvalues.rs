//! Eigenvalues of a complex matrix: Householder reduction to Hessenberg form, then the QR iteration with Wilkinson's shift (Golub and
//! Van Loan, Matrix Computations, 4th ed., section 7.5; J. H. Wilkinson, The Algebraic Eigenvalue Problem, 1965, chapter 8). The number
//! of steps is bounded.

use crate::{Error, Result};
use faer::{Mat, c64};

/// Steps for each eigenvalue; two or three are usual.
const STEPS: usize = 30;

/// The eigenvalues of a square complex matrix, in no order.
///
/// # Errors
/// [`Error::NoConvergence`] naming `what`, after 30 steps per eigenvalue.
pub(crate) fn complex_eigenvalues(what: &str, a: Mat<c64>) -> Result<Vec<c64>> {
    let mut h = a;
    reduce(&mut h);
    let n = h.nrows();
    let limit = STEPS * n.max(10);
    let (mut end, mut total, mut since) = (n, 0, 0);
    while end > 0 {
        let start = deflate(&mut h, end);
        if start + 1 == end {
            (end, since) = (end - 1, 0);
            continue;
        }
        if total == limit {
            let what = format!("the eigenvalues of {what}");
            return Err(Error::NoConvergence { what, iterations: total });
        }
        (total, since) = (total + 1, since + 1);
        let shift = if since % 10 == 0 { exceptional(&h, end) } else { wilkinson(&h, end) };
        step(&mut h, start, end, shift);
    }
    Ok((0..n).map(|k| h[(k, k)]).collect())
}

/// Hessenberg form by reflections `I - 2 v v* / (v* v)`.
fn reduce(h: &mut Mat<c64>) {
    let n = h.nrows();
    for k in 0..n.saturating_sub(2) {
        let mut v: Vec<c64> = (k + 1..n).map(|i| h[(i, k)]).collect();
        let length = v.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
        if length == 0.0 {
            continue;
        }
        let first = v[0].norm();
        let pivot = if first == 0.0 { c64::new(length, 0.0) } else { v[0] * (length / first) };
        v[0] += pivot;
        let factor = 2.0 / v.iter().map(|x| x.norm_sqr()).sum::<f64>();
        for j in k..n {
            let along = v.iter().enumerate().fold(c64::ZERO, |sum, (i, v)| sum + v.conj() * h[(k + 1 + i, j)]);
            v.iter().enumerate().for_each(|(i, v)| h[(k + 1 + i, j)] -= v * along * factor);
        }
        for i in 0..n {
            let along = v.iter().enumerate().fold(c64::ZERO, |sum, (j, v)| sum + h[(i, k + 1 + j)] * v);
            v.iter().enumerate().for_each(|(j, v)| h[(i, k + 1 + j)] -= along * v.conj() * factor);
        }
        (k + 2..n).for_each(|i| h[(i, k)] = c64::ZERO);
    }
}

/// Sets the lowest negligible entry below the diagonal to zero; returns the first row of the block that ends before row `end`.
fn deflate(h: &mut Mat<c64>, end: usize) -> usize {
    for k in (1..end).rev() {
        let neighbours = match h[(k - 1, k - 1)].norm() + h[(k, k)].norm() {
            0.0 => h.norm_max(),
            sum => sum,
        };
        if h[(k, k - 1)].norm() <= f64::EPSILON * neighbours {
            h[(k, k - 1)] = c64::ZERO;
            return k;
        }
    }
    0
}

/// The eigenvalue of the last 2 x 2 block that is nearer to its last entry.
fn wilkinson(h: &Mat<c64>, end: usize) -> c64 {
    let (a, b) = (h[(end - 2, end - 2)], h[(end - 2, end - 1)]);
    let (c, d) = (h[(end - 1, end - 2)], h[(end - 1, end - 1)]);
    let half = (a - d) * 0.5;
    let root = (half * half + b * c).sqrt();
    let far = if (half + root).norm() >= (half - root).norm() { half + root } else { half - root };
    if far == c64::ZERO { d } else { d - b * c / far }
}

/// A shift that breaks a cycle.
fn exceptional(h: &Mat<c64>, end: usize) -> c64 {
    h[(end - 1, end - 1)] + c64::new(1.5 * h[(end - 1, end - 2)].norm(), 0.0)
}

/// `H - s I = Q R`, `H := R Q + s I` on the rows and columns from `start` to `end`.
fn step(h: &mut Mat<c64>, start: usize, end: usize, shift: c64) {
    (start..end).for_each(|k| h[(k, k)] -= shift);
    let mut rotations = Vec::with_capacity(end - start);
    for k in start..end - 1 {
        let (a, b) = (h[(k, k)], h[(k + 1, k)]);
        let r = a.norm().hypot(b.norm());
        let (a, b) = if r == 0.0 { (c64::ONE, c64::ZERO) } else { (a / r, b / r) };
        for j in k..end {
            let (x, y) = (h[(k, j)], h[(k + 1, j)]);
            (h[(k, j)], h[(k + 1, j)]) = (a.conj() * x + b.conj() * y, a * y - b * x);
        }
        rotations.push((a, b));
    }
    for (k, (a, b)) in (start..).zip(rotations) {
        for i in start..(k + 2).min(end) {
            let (x, y) = (h[(i, k)], h[(i, k + 1)]);
            (h[(i, k)], h[(i, k + 1)]) = (x * a + y * b, y * a.conj() - x * b.conj());
        }
    }
    (start..end).for_each(|k| h[(k, k)] += shift);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn random(n: usize, rng: &mut ChaCha8Rng) -> Mat<c64> {
        let mut draw = || -> f64 { StandardNormal.sample(rng) };
        Mat::from_fn(n, n, |_, _| c64::new(draw(), draw()))
    }

    fn worst(found: &[c64], expected: &[c64]) -> f64 {
        let nearest = |e: &c64| found.iter().map(|f| (f - e).norm()).fold(f64::INFINITY, f64::min);
        expected.iter().map(nearest).fold(0.0, f64::max)
    }

    /// Triangular matrices in random unitary coordinates.
    #[test]
    fn eigenvalues_are_those_of_the_diagonal() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for n in [0, 1, 2, 3, 7, 30, 92] {
            let q = random(n, &mut rng).qr().compute_thin_Q();
            let mut t = random(n, &mut rng);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                t[(i, j)] = match i.cmp(&j) {
                    std::cmp::Ordering::Greater => c64::ZERO,
                    std::cmp::Ordering::Equal => t[(i, i)],
                    std::cmp::Ordering::Less => t[(i, j)] * 0.01,
                };
            }
            let exact: Vec<c64> = (0..n).map(|k| t[(k, k)]).collect();
            let found = complex_eigenvalues("A", &q * &t * q.adjoint()).unwrap();
            assert_eq!(found.len(), n);
            assert!(worst(&found, &exact) < 1e-11, "n = {n}: {}", worst(&found, &exact));
        }
    }

    #[test]
    fn cycles_and_equal_eigenvalues_end() {
        let cyclic = Mat::from_fn(6, 6, |i, j| if i == (j + 1) % 6 { c64::ONE } else { c64::ZERO });
        let found = complex_eigenvalues("A", cyclic).unwrap();
        assert!(found.iter().all(|z| (z.norm() - 1.0).abs() < 1e-13));
        let zero = Mat::<c64>::zeros(5, 5);
        assert!(complex_eigenvalues("A", zero).unwrap().iter().all(|z| z.norm() == 0.0));
    }
}
