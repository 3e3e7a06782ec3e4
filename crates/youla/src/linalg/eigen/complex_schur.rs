//! Complex Schur form `A = Q T Q^H`, Q unitary, T upper triangular, from the real one: in triangular form the recursions for
//! Lyapunov equations, roots and logarithms need no block sizes.

use crate::Result;
use crate::linalg::eigen::schur::{block_eigenvalues, blocks};
use crate::linalg::{RealSchur, real_schur};
use faer::{Mat, MatRef, c64};

/// The complex Schur form `A = Q T Q^H` of an n x n matrix.
pub(crate) struct ComplexSchur {
    pub(crate) q: Mat<c64>,
    pub(crate) t: Mat<c64>,
}

impl ComplexSchur {
    /// Eigenvalues in the order of the diagonal.
    pub(crate) fn eigenvalues(&self) -> impl Iterator<Item = c64> {
        (0..self.t.nrows()).map(|k| self.t[(k, k)])
    }
}

/// Computes the complex Schur form of a real matrix. Real eigenvalues have an imaginary part of exactly zero.
pub(crate) fn complex_schur(what: &str, a: MatRef<'_, f64>) -> Result<ComplexSchur> {
    let real = real_schur(what, a)?;
    let mut form = ComplexSchur { q: complex(real.q.as_ref()), t: complex(real.t.as_ref()) };
    split_pairs(&real, &mut form);
    Ok(form)
}

/// The matrix with imaginary part zero.
pub(crate) fn complex(a: MatRef<'_, f64>) -> Mat<c64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| c64::new(a[(i, j)], 0.0))
}

/// The real part of a matrix.
pub(crate) fn real_part(a: MatRef<'_, c64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)].re)
}

/// Triangularises every 2 x 2 block by the unitary matrix whose first column is its eigenvector.
fn split_pairs(real: &RealSchur, form: &mut ComplexSchur) {
    for block in blocks(real.t.as_ref()).into_iter().filter(|b| b.size == 2) {
        let k = block.start;
        let pair = block_eigenvalues(real.t.as_ref(), block);
        // Eigenvector [b; i im] of [a b; c a] for a + i im.
        let (x, y) = (real.t[(k, k + 1)], pair[0].im);
        let length = x.hypot(y);
        let (x, y) = (c64::new(x / length, 0.0), c64::new(0.0, y / length));
        for j in k..form.t.ncols() {
            let (upper, lower) = (form.t[(k, j)], form.t[(k + 1, j)]);
            form.t[(k, j)] = x.conj() * upper + y.conj() * lower;
            form.t[(k + 1, j)] = x * lower - y * upper;
        }
        let rows = form.q.nrows();
        for (m, rows) in [(&mut form.t, k + 2), (&mut form.q, rows)] {
            for i in 0..rows {
                let (left, right) = (m[(i, k)], m[(i, k + 1)]);
                m[(i, k)] = left * x + right * y;
                m[(i, k + 1)] = right * x.conj() - left * y.conj();
            }
        }
        form.t[(k + 1, k)] = c64::new(0.0, 0.0);
        form.t[(k, k)] = pair[0];
        form.t[(k + 1, k + 1)] = pair[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn form_is_unitary_triangular_and_similar() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for n in 0..=25 {
            let a = Mat::from_fn(n, n, |_, _| StandardNormal.sample(&mut rng));
            let ComplexSchur { q, t } = complex_schur("A", a.as_ref()).unwrap();
            let a = complex(a.as_ref());
            assert!((&q * &t * q.adjoint() - &a).norm_l2() <= 1e-13 * a.norm_l2());
            assert!((q.adjoint() * &q - Mat::<c64>::identity(n, n)).norm_l2() < 1e-13 * (1.0 + n as f64));
            for j in 0..n {
                assert!((j + 1..n).all(|i| t[(i, j)].norm() == 0.0));
            }
        }
    }
}
