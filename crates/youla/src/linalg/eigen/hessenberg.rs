//! Hessenberg form `A = Q H Q'`: Q orthogonal, H zero below the first subdiagonal (Golub and Van Loan, Matrix
//! Computations, 4th ed., algorithm 7.4.2). It is the first step to the Schur form, and it makes the solution of
//! `(s I - A) x = b` for many values of s an O(n^2) matter.

use crate::Result;
use crate::linalg::eigen::reflector::{householder, reflect_columns, reflect_rows};
use crate::linalg::{check_finite, check_shape, eye};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::hessenberg::{hessenberg_in_place, hessenberg_in_place_scratch};
use faer::linalg::householder::{
    apply_block_householder_sequence_on_the_right_in_place_scratch,
    apply_block_householder_sequence_on_the_right_in_place_with_conj,
};
use faer::linalg::qr::no_pivoting::factor::recommended_block_size;
use faer::{Conj, Mat, MatRef, Par};

/// The Hessenberg form `A = Q H Q'` of an n x n matrix.
#[derive(Debug, Clone)]
pub(crate) struct Hessenberg {
    /// Orthogonal matrix Q, n x n.
    pub q: Mat<f64>,
    /// Upper Hessenberg matrix H, n x n; exactly zero below the first subdiagonal.
    pub h: Mat<f64>,
}

/// Order from which on faer's reduction is the faster one.
const BLOCKED: usize = 16;

/// Reduces a square matrix to Hessenberg form by Householder reflections.
///
/// # Errors
/// [`crate::Error::Shape`] unless square, [`crate::Error::NotFinite`] for a bad entry, both naming `what`.
pub(crate) fn hessenberg(what: &str, a: MatRef<'_, f64>) -> Result<Hessenberg> {
    let n = a.nrows();
    check_shape(what, a, (n, n))?;
    check_finite(what, a)?;
    if n >= BLOCKED {
        return Ok(blocked(a));
    }
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

/// faer's reduction: the matrix is passed once per reflection, and the reflections are gathered for Q.
fn blocked(a: MatRef<'_, f64>) -> Hessenberg {
    let n = a.nrows();
    let block = recommended_block_size::<f64>(n - 1, n - 1);
    let (mut h, mut reflections, mut q) = (a.to_owned(), Mat::zeros(block, n - 1), eye(n));
    let scratch = hessenberg_in_place_scratch::<f64>(n, block, Par::Seq, Default::default())
        .or(apply_block_householder_sequence_on_the_right_in_place_scratch::<f64>(n - 1, block, n - 1));
    let mut memory = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut memory);
    hessenberg_in_place(h.as_mut(), reflections.as_mut(), Par::Seq, stack, Default::default());
    apply_block_householder_sequence_on_the_right_in_place_with_conj(
        h.submatrix(1, 0, n - 1, n - 1),
        reflections.as_ref(),
        Conj::No,
        q.as_mut().submatrix_mut(1, 1, n - 1, n - 1),
        Par::Seq,
        stack,
    );
    for j in 0..n {
        h.col_as_slice_mut(j)[(j + 2).min(n)..].fill(0.0);
    }
    Hessenberg { q, h }
}
