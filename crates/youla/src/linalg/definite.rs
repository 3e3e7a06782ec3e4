//! Definiteness of symmetric matrices, judged after scaling to unit diagonal: weights and covariances in mixed units differ
//! by many decades without being any nearer to singular.

use crate::{Error, Result};
use faer::{Mat, MatRef, Side};

/// A symmetric matrix as `diag(d) M diag(d)` with ones (or minus ones, or zeros) on the diagonal of M.
pub(crate) struct UnitDiagonal {
    /// M, n x n, symmetrised.
    pub(crate) matrix: Mat<f64>,
    /// d, n entries; 1 where the diagonal is zero.
    pub(crate) scale: Vec<f64>,
}

impl UnitDiagonal {
    pub(crate) fn of(a: MatRef<'_, f64>) -> Self {
        let n = a.nrows();
        let scale: Vec<f64> = (0..n).map(|i| if a[(i, i)] == 0.0 { 1.0 } else { a[(i, i)].abs().sqrt() }).collect();
        let matrix = Mat::from_fn(n, n, |i, j| 0.5 * (a[(i, j)] + a[(j, i)]) / scale[i] / scale[j]);
        UnitDiagonal { matrix, scale }
    }

    /// Smallest eigenvalue of M; infinite for an empty matrix.
    pub(crate) fn smallest_eigenvalue(&self, what: &str) -> Result<f64> {
        if self.scale.is_empty() {
            return Ok(f64::INFINITY);
        }
        let eigenvalues = self
            .matrix
            .self_adjoint_eigenvalues(Side::Lower)
            .map_err(|_| Error::NoConvergence { what: format!("the eigenvalues of {what}"), iterations: 0 })?;
        Ok(eigenvalues[0])
    }
}

/// Fails unless the matrix is positive semidefinite up to rounding.
///
/// # Errors
/// [`Error::NotPositive`] naming `what`.
pub(crate) fn check_semidefinite(what: &str, a: MatRef<'_, f64>) -> Result<()> {
    let eigenvalue = UnitDiagonal::of(a).smallest_eigenvalue(what)?;
    if eigenvalue < -1e-10 {
        return Err(Error::NotPositive { what: what.to_owned(), must: "positive semidefinite", eigenvalue });
    }
    Ok(())
}
