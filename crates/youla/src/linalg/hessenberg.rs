//! Hessenberg form `A = Q H Q'`: Q orthogonal, H zero below the first subdiagonal (Golub and Van Loan, Matrix
//! Computations, 4th ed., algorithm 7.4.2). It is the first step to the Schur form, and it makes the solution of
//! `(s I - A) x = b` for many values of s an O(n^2) matter.

use super::reflector::{householder, reflect_columns, reflect_rows};
use super::{check_finite, check_shape, eye};
use crate::Result;
use faer::{Mat, MatRef};

/// The Hessenberg form `A = Q H Q'` of an n x n matrix.
#[derive(Debug, Clone)]
pub struct Hessenberg {
    /// Orthogonal matrix Q, n x n.
    pub q: Mat<f64>,
    /// Upper Hessenberg matrix H, n x n; exactly zero below the first subdiagonal.
    pub h: Mat<f64>,
}

/// Reduces a square matrix to Hessenberg form by Householder reflections.
///
/// # Errors
/// [`crate::Error::Shape`] unless square, [`crate::Error::NotFinite`] for a bad entry, both naming `what`.
///
/// ```
/// use youla::{Mat, linalg::hessenberg};
/// let a = Mat::from_fn(4, 4, |i, j| ((3 * i + 5 * j) % 7) as f64);
/// let form = hessenberg("A", a.as_ref())?;
/// assert!((&form.q * &form.h * form.q.transpose() - &a).norm_l2() < 1e-13);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn hessenberg(what: &str, a: MatRef<'_, f64>) -> Result<Hessenberg> {
    let n = a.nrows();
    check_shape(what, a, (n, n))?;
    check_finite(what, a)?;
    let (mut q, mut h) = (eye(n), a.to_owned());
    for k in 0..n.saturating_sub(2) {
        let mut v: Vec<f64> = (k + 1..n).map(|i| h[(i, k)]).collect();
        let (tau, beta) = householder(&mut v);
        reflect_rows(&mut h, &v, tau, k + 1, k + 1..n);
        reflect_columns(&mut h, &v, tau, k + 1, 0..n);
        reflect_columns(&mut q, &v, tau, k + 1, 0..n);
        h[(k + 1, k)] = beta;
        for i in k + 2..n {
            h[(i, k)] = 0.0;
        }
    }
    Ok(Hessenberg { q, h })
}
