//! Balancing: the diagonal similarity `D^-1 A D` by powers of two that brings the norms of rows and columns together, so
//! that eigenvalues of badly scaled matrices keep their digits (B. N. Parlett and C. Reinsch, Numer. Math. 13 (1969), 293;
//! stopping rule and 2-norm of James, Langou and Lowery, 2014, with which a nearly triangular matrix is left alone).

use crate::Result;
use crate::linalg::{check_finite, check_shape};
use faer::{Mat, MatRef};

/// A balanced matrix and its scaling.
#[derive(Debug, Clone)]
pub struct Balanced {
    /// `D^-1 A D`, n x n, without any rounding.
    pub a: Mat<f64>,
    /// Diagonal of D: powers of two.
    pub scale: Vec<f64>,
}

/// Balances a square matrix.
///
/// # Errors
/// [`crate::Error::Shape`] unless square, [`crate::Error::NotFinite`] for a bad entry, both naming `what`.
///
/// ```
/// use youla::{Mat, linalg::balance};
/// let a = Mat::from_fn(2, 2, |i, j| [[1.0, 1e6], [1e-6, 1.0]][i][j]);
/// let balanced = balance("A", a.as_ref())?;
/// assert!(balanced.a.norm_max() < 2.0);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn balance(what: &str, a: MatRef<'_, f64>) -> Result<Balanced> {
    let n = a.nrows();
    check_shape(what, a, (n, n))?;
    check_finite(what, a)?;
    let (mut a, mut scale) = (a.to_owned(), vec![1.0; n]);
    loop {
        let mut changed = false;
        for k in 0..n {
            let factor = balancing_factor(a.as_ref(), k);
            let total = scale[k] * factor;
            if factor != 1.0 && (1e-100..1e100).contains(&total) {
                changed = true;
                scale[k] = total;
                for i in 0..n {
                    a[(i, k)] *= factor;
                    a[(k, i)] /= factor;
                }
            }
        }
        if !changed {
            return Ok(Balanced { a, scale });
        }
    }
}

/// The power of two that brings column and row k nearest to each other, 1 where it would gain less than 5 %.
fn balancing_factor(a: MatRef<'_, f64>, k: usize) -> f64 {
    let column = a.col(k).norm_l2();
    let row = a.row(k).norm_l2();
    if column == 0.0 || row == 0.0 {
        return 1.0;
    }
    let factor = (0.5 * (row / column).log2()).round().exp2();
    let gained = (column * factor).hypot(row / factor);
    if gained < 0.95 * column.hypot(row) { factor } else { 1.0 }
}
