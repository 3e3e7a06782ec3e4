//! Real Schur form `A = Q T Q'`: Q orthogonal, T quasi-triangular with 1 x 1 blocks for real eigenvalues and 2 x 2 blocks
//! `[a b; c a]`, b c < 0, for the pairs `a +- i sqrt(-b c)`.
//!
//! Hessenberg reduction, then the double-shift QR iteration (Golub and Van Loan, Matrix Computations, 4th ed., section 7.5).
//!
//! The iteration is this crate's own for two reasons, seen with faer 0.24: its Schur modules are `pub(crate)`, eigenvalues alone are public;
//! and from order 75 on its aggressive early deflation exchanges blocks until they are sorted, which never ends where an exchange is
//! refused (close pairs): the level test of norms and margins hung on 2 of 260 random loops. Here a step count bounds every eigenvalue.

use crate::Result;
use crate::linalg::eigen::francis::quasi_triangular;
use crate::linalg::eigen::hessenberg::{Hessenberg, hessenberg};
use crate::linalg::eigen::reflector::Rotation;
use crate::linalg::square::Square;
use faer::{Mat, MatRef, c64};

/// The real Schur form `A = Q T Q'` of an n x n matrix.
#[derive(Debug, Clone)]
pub struct RealSchur {
    /// Orthogonal matrix Q, n x n.
    pub q: Mat<f64>,
    /// Quasi-triangular matrix T, n x n, with standardised 2 x 2 blocks.
    pub t: Mat<f64>,
    /// Relative residual `||A - Q T Q'|| / ||A||` in the Frobenius norm.
    pub residual: f64,
}

impl RealSchur {
    /// Eigenvalues in the order in which they are on the diagonal of T; of a pair, the one with positive imaginary
    /// part comes first.
    pub fn eigenvalues(&self) -> Vec<c64> {
        blocks(self.t.as_ref()).into_iter().flat_map(|b| block_eigenvalues(self.t.as_ref(), b)).collect()
    }
}

/// One diagonal block of a quasi-triangular matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DiagonalBlock {
    /// First row.
    pub(crate) start: usize,
    /// 1 or 2.
    pub(crate) size: usize,
}

/// The diagonal blocks from top to bottom.
pub(crate) fn blocks(t: MatRef<'_, f64>) -> Vec<DiagonalBlock> {
    let (n, mut start, mut found) = (t.nrows(), 0, Vec::with_capacity(t.nrows()));
    while start < n {
        let size = if start + 1 < n && t[(start + 1, start)] != 0.0 { 2 } else { 1 };
        found.push(DiagonalBlock { start, size });
        start += size;
    }
    found
}

/// The one or two eigenvalues of a diagonal block.
pub(crate) fn block_eigenvalues(t: MatRef<'_, f64>, block: DiagonalBlock) -> Vec<c64> {
    let k = block.start;
    if block.size == 1 {
        return vec![c64::new(t[(k, k)], 0.0)];
    }
    let im = t[(k, k + 1)].abs().sqrt() * t[(k + 1, k)].abs().sqrt();
    vec![c64::new(t[(k, k)], im), c64::new(t[(k, k)], -im)]
}

/// Computes the real Schur form of a square matrix.
///
/// Backward stable: `residual` is a small multiple of the machine precision (held to 1e-13 for n up to 60 by
/// `random_matrices_keep_their_schur_form`).
///
/// # Errors
/// [`crate::Error::Shape`] and [`crate::Error::NotFinite`] naming `what`; [`crate::Error::NoConvergence`] after 30 sweeps per eigenvalue.
///
/// ```
/// use youla::{Mat, linalg::real_schur};
/// let a = Mat::from_fn(2, 2, |i, j| [[0.0, 4.0], [-1.0, 0.0]][i][j]);
/// let schur = real_schur("A", a.as_ref())?;
/// assert!((schur.eigenvalues()[0].im - 2.0).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn real_schur(what: &str, a: MatRef<'_, f64>) -> Result<RealSchur> {
    let Hessenberg { mut q, h: mut t } = hessenberg(what, a)?;
    quasi_triangular(what, &mut t, &mut q)?;
    let residual = relative_residual(a, &q, &t);
    Ok(RealSchur { q, t, residual })
}

/// The eigenvalues alone.
pub(crate) fn eigenvalues(what: &str, a: MatRef<'_, f64>) -> Result<Vec<c64>> {
    let Hessenberg { mut q, h: mut t } = hessenberg(what, a)?;
    quasi_triangular(what, &mut t, &mut q)?;
    Ok(blocks(t.as_ref()).into_iter().flat_map(|b| block_eigenvalues(t.as_ref(), b)).collect())
}

/// `||A - Q T Q'|| / ||A||`, zero for a zero matrix.
pub(crate) fn relative_residual(a: MatRef<'_, f64>, q: &Mat<f64>, t: &Mat<f64>) -> f64 {
    let norm = a.norm_l2();
    if norm == 0.0 { 0.0 } else { (q * t * q.transpose() - a).norm_l2() / norm }
}

/// Brings the 2 x 2 block in rows k, k+1 to standard form: triangular where its eigenvalues are real, equal diagonal
/// entries where they are not.
pub(crate) fn standardise(t: &mut Square, q: &mut Square, k: usize) {
    if split_real_pair(t, q, k) {
        return;
    }
    let (half, sum) = (0.5 * (t[(k, k)] - t[(k + 1, k + 1)]), t[(k, k + 1)] + t[(k + 1, k)]);
    // The difference of the diagonal, a - d, turns by twice the angle: tan(2 angle) = -(a - d) / (b + c).
    let angle = if sum == 0.0 && half == 0.0 { 0.0 } else { 0.5 * angle_of(-2.0 * half, sum) };
    Rotation { c: angle.cos(), s: angle.sin() }.similarity(t, q, k);
    let mean = 0.5 * (t[(k, k)] + t[(k + 1, k + 1)]);
    t[(k, k)] = mean;
    t[(k + 1, k + 1)] = mean;
    // Rounding may have made the pair real.
    split_real_pair(t, q, k);
}

/// Angle of the line through (x, y) and the origin, in (-pi/2, pi/2].
fn angle_of(y: f64, x: f64) -> f64 {
    if x < 0.0 { (-y).atan2(-x) } else { y.atan2(x) }
}

/// Makes the block triangular where its eigenvalues are real, the one of larger distance from the last entry first.
fn split_real_pair(t: &mut Square, q: &mut Square, k: usize) -> bool {
    let (a, b, c, d) = (t[(k, k)], t[(k, k + 1)], t[(k + 1, k)], t[(k + 1, k + 1)]);
    if c == 0.0 {
        return true;
    }
    let half = 0.5 * (a - d);
    let scale = half.abs().max(b.abs()).max(c.abs());
    let discriminant = half / scale * (half / scale) + b / scale * (c / scale);
    if discriminant < 0.0 {
        return false;
    }
    // Eigenvalue d + z with the eigenvector [z; c].
    let z = half + scale * discriminant.sqrt().copysign(half);
    Rotation::onto_first(z, c).similarity(t, q, k);
    t[(k + 1, k)] = 0.0;
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eye;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn random(n: usize, seed: u64) -> Mat<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Mat::from_fn(n, n, |_, _| StandardNormal.sample(&mut rng))
    }

    fn check(a: &Mat<f64>, q: &Mat<f64>, t: &Mat<f64>) {
        let n = a.nrows();
        assert!((q.transpose() * q - eye(n)).norm_l2() <= 1e-13 * (n as f64));
        assert!(relative_residual(a.as_ref(), q, t) < 1e-13, "n = {n}: {}", relative_residual(a.as_ref(), q, t));
        for i in 0..n {
            for j in 0..i.saturating_sub(1) {
                assert_eq!(t[(i, j)], 0.0);
            }
        }
        for b in blocks(t.as_ref()) {
            let k = b.start;
            if b.size == 2 {
                assert_eq!(t[(k, k)], t[(k + 1, k + 1)]);
                assert!(t[(k, k + 1)] * t[(k + 1, k)] < 0.0);
                assert!(k + 2 >= n || t[(k + 2, k + 1)] == 0.0);
            }
        }
    }

    fn distance(mut left: Vec<c64>, right: &[c64]) -> f64 {
        let mut worst = 0.0_f64;
        for r in right {
            let (k, gap) = left
                .iter()
                .enumerate()
                .map(|(k, l)| (k, (l - r).norm()))
                .min_by(|x, y| x.1.total_cmp(&y.1))
                .expect("as many eigenvalues on both sides");
            left.swap_remove(k);
            worst = worst.max(gap);
        }
        worst
    }

    #[test]
    fn random_matrices_keep_their_schur_form() {
        for n in 0..=60 {
            let a = random(n, n as u64);
            let schur = real_schur("A", a.as_ref()).unwrap();
            check(&a, &schur.q, &schur.t);
            let reference = crate::linalg::eigenvalues("A", a.as_ref()).unwrap();
            assert!(distance(schur.eigenvalues(), &reference) < 1e-9, "n = {n}");
        }
    }

    #[test]
    fn special_matrices_converge() {
        let cyclic = Mat::from_fn(6, 6, |i, j| f64::from(u8::from(i == (j + 1) % 6)));
        let jordan = Mat::from_fn(8, 8, |i, j| if i == j || j == i + 1 { 1.0 } else { 0.0 });
        let graded = Mat::from_fn(8, 8, |i, j| random(8, 3)[(i, j)] * 10f64.powi(-2 * (i + j) as i32));
        let rotation = Mat::from_fn(2, 2, |i, j| [[0.3, 5.0], [-5.0, -0.1]][i][j]);
        let exchange = Mat::from_fn(2, 2, |i, j| [[0.0, 0.0], [1.0, 0.0]][i][j]);
        for a in [cyclic, jordan.transpose().to_owned(), jordan, graded, rotation, exchange, Mat::zeros(5, 5), eye(5)] {
            let schur = real_schur("A", a.as_ref()).unwrap();
            check(&a, &schur.q, &schur.t);
        }
    }

    #[test]
    fn badly_scaled_companion_keeps_its_roots_after_balancing() {
        // (s + 1)(s + 1e3)(s + 1e6), whose companion matrix spans nine decades.
        let a =
            Mat::from_fn(3, 3, |i, j| [[-1_001_001.0, -1_001_001_000.0, -1e9], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]][i][j]);
        let balanced = crate::linalg::balance("A", a.as_ref()).unwrap();
        let mut roots: Vec<f64> =
            real_schur("A", balanced.a.as_ref()).unwrap().eigenvalues().iter().map(|p| p.re).collect();
        roots.sort_by(f64::total_cmp);
        for (root, exact) in roots.iter().zip([-1e6, -1e3, -1.0]) {
            assert!((root / exact - 1.0).abs() < 1e-9, "{root}");
        }
    }

    #[test]
    fn reordering_moves_exactly_the_selected_eigenvalues() {
        for n in 1..=40 {
            let a = random(n, 100 + n as u64);
            let before = real_schur("A", a.as_ref()).unwrap();
            let eigenvalues = before.eigenvalues();
            let ordered = before.reorder(|p| p.re < 0.0).unwrap();
            check(&a, &ordered.q, &ordered.t);
            assert_eq!(ordered.dimension, eigenvalues.iter().filter(|p| p.re < 0.0).count());
            assert!(ordered.eigenvalues().iter().enumerate().all(|(k, p)| (p.re < 0.0) == (k < ordered.dimension)));
            assert!(distance(ordered.eigenvalues(), &eigenvalues) < 1e-9, "n = {n}");
        }
    }

    #[test]
    fn a_matrix_that_is_not_square_is_refused() {
        assert!(matches!(real_schur("A", Mat::zeros(2, 3).as_ref()), Err(crate::Error::Shape { .. })));
    }
}
