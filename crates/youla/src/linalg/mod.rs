//! What dense linear algebra lacks for control: ordered real Schur form, Sylvester, Lyapunov and Riccati equations,
//! matrix exponential and logarithm. Each solver returns its relative residual.
//!
//! Everything here runs on one thread: the matrices are small, and results must not depend on the number of threads.

mod definite;
mod eigen;
mod expm;
mod golden_section;
mod gramian;
mod gramian_balancing;
mod kronecker;
mod least_squares;
mod levenberg;
mod logm;
mod lyapunov;
mod orthonormal;
mod riccati;
mod sequential_qr;
mod square;
mod substitution;
mod sylvester;

pub(crate) use definite::check_semidefinite;
pub use eigen::balance::{Balanced, balance};
pub(crate) use eigen::complex_eigenvalues::complex_eigenvalues;
pub(crate) use eigen::eigenvectors::{Eigenvectors, Group};
pub(crate) use eigen::hessenberg::hessenberg;
pub use eigen::reorder::OrderedSchur;
pub use eigen::schur::{RealSchur, real_schur};
pub use expm::expm;
pub(crate) use golden_section::golden_section;
pub(crate) use gramian::{discrete_gramian_factor, gramian_factor};
pub(crate) use gramian_balancing::gramian_balancing;
pub use least_squares::regress;
pub use least_squares::{LeastSquares, least_squares};
pub(crate) use levenberg::LEAST_DAMPING;
pub use levenberg::{Damping, Trial, damped_step, decrease};
pub(crate) use logm::logm;
pub(crate) use lyapunov::discrete_lyapunov_on;
pub use lyapunov::{Lyapunov, discrete_lyapunov, lyapunov};
pub(crate) use orthonormal::Orthonormal;
pub use riccati::{RiccatiProblem, RiccatiSolution, care, dare};
pub use sequential_qr::SequentialQr;
pub use sequential_qr::leading_rank;
pub(crate) use sequential_qr::triangular_condition;
pub use sylvester::{SylvesterSolution, discrete_sylvester, sylvester};

#[cfg(test)]
mod level_tests;

use crate::{Error, Result};
use faer::prelude::*;
use faer::{Mat, MatRef, c64};

/// Keeps a divisor above zero: far below every power of a channel in units of its own size, with an inverse that is finite.
pub(crate) const TINY: f64 = 1e-300;

/// Identity matrix of size n.
pub fn eye(n: usize) -> Mat<f64> {
    Mat::identity(n, n)
}

/// Stacks blocks into one matrix; all blocks of a block row have the same number of rows, and the block rows agree in
/// their columns (checked by assertion: the callers are in this crate).
///
/// ```
/// # use youla::{Mat, linalg::{block, eye}};
/// let a = eye(2);
/// let z = Mat::zeros(2, 1);
/// let m = block(&[&[a.as_ref(), z.as_ref()]]);
/// assert_eq!((m.nrows(), m.ncols()), (2, 3));
/// ```
pub fn block(rows: &[&[MatRef<'_, f64>]]) -> Mat<f64> {
    let nrows = rows.iter().map(|r| r.first().map_or(0, |b| b.nrows())).sum();
    let ncols = rows.first().map_or(0, |r| r.iter().map(|b| b.ncols()).sum());
    let mut out = Mat::zeros(nrows, ncols);
    let mut i = 0;
    for row in rows {
        let height = row.first().map_or(0, |b| b.nrows());
        let mut j = 0;
        for part in *row {
            assert_eq!(part.nrows(), height, "blocks of one row differ in height");
            out.as_mut().submatrix_mut(i, j, height, part.ncols()).copy_from(part);
            j += part.ncols();
        }
        assert_eq!(j, ncols, "block rows differ in width");
        i += height;
    }
    out
}

/// Block-diagonal matrix of two blocks.
pub fn block_diagonal(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let upper = Mat::zeros(a.nrows(), b.ncols());
    let lower = Mat::zeros(b.nrows(), a.ncols());
    block(&[&[a, upper.as_ref()], &[lower.as_ref(), b]])
}

/// Solves `a x = b` by LU with partial pivoting; refuses with the reciprocal condition number (1-norm) where `a` is
/// singular to working precision.
///
/// # Errors
/// [`Error::Singular`] naming `what`.
pub fn solve(what: &str, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let rcond = reciprocal_condition(a);
    if rcond > f64::EPSILON {
        Ok(a.partial_piv_lu().solve(b))
    } else {
        Err(Error::Singular { what: what.to_owned(), rcond })
    }
}

/// [`solve`] for equations whose rows and columns carry units of their own (direct feedthroughs of loops): where `a` looks
/// singular, it is judged and solved again with rows and columns scaled to like size by powers of two.
///
/// # Errors
/// [`Error::Singular`] naming `what`.
pub(crate) fn solve_in_any_units(what: &str, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let plain = solve(what, a, b);
    if plain.is_ok() {
        return plain;
    }
    let n = a.nrows();
    let (mut rows, mut columns) = (vec![1.0_f64; n], vec![1.0_f64; n]);
    let half = |size: f64| if size.is_normal() { (-0.5 * size.log2()).round().exp2() } else { 1.0 };
    for _ in 0..20 {
        let size = |i: usize, j: usize| (a[(i, j)] * rows[i] * columns[j]).abs();
        let row: Vec<f64> = (0..n).map(|i| half((0..n).map(|j| size(i, j)).fold(0.0, f64::max))).collect();
        let column: Vec<f64> = (0..n).map(|j| half((0..n).map(|i| size(i, j)).fold(0.0, f64::max))).collect();
        rows.iter_mut().zip(&row).for_each(|(r, factor)| *r *= factor);
        columns.iter_mut().zip(&column).for_each(|(c, factor)| *c *= factor);
    }
    let scaled = Mat::from_fn(n, n, |i, j| a[(i, j)] * rows[i] * columns[j]);
    let rhs = Mat::from_fn(n, b.ncols(), |i, j| b[(i, j)] * rows[i]);
    let x = solve(what, scaled.as_ref(), rhs.as_ref())?;
    Ok(Mat::from_fn(n, b.ncols(), |i, j| x[(i, j)] * columns[i]))
}

/// Solves `x a = b`, by transposition of [`solve`].
///
/// # Errors
/// [`Error::Singular`] naming `what`.
pub(crate) fn solve_right(what: &str, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    Ok(solve(what, a.transpose(), b.transpose())?.transpose().to_owned())
}

/// Ratio of the smallest to the largest singular value; 1 for an empty matrix, 0 where it cannot be computed.
pub fn reciprocal_condition(a: MatRef<'_, f64>) -> f64 {
    if a.nrows() == 0 {
        return 1.0;
    }
    match a.singular_values() {
        Ok(s) if s[0] > 0.0 => s[s.len() - 1] / s[0],
        _ => 0.0,
    }
}

/// Eigenvalues of a square matrix, balanced first: states in very different units cost no digits. The iteration is that of
/// [`real_schur`], whose number of steps is bounded for every matrix.
///
/// # Errors
/// [`Error::NoConvergence`], [`Error::NotFinite`] and [`Error::Shape`] naming `what`.
pub fn eigenvalues(what: &str, a: MatRef<'_, f64>) -> Result<Vec<c64>> {
    eigen::schur::eigenvalues(what, balance(what, a)?.a.as_ref())
}

/// Fails with the position of the first entry that is NaN or infinite.
///
/// # Errors
/// [`Error::NotFinite`] naming `what`.
pub fn check_finite(what: &str, a: MatRef<'_, f64>) -> Result<()> {
    for j in 0..a.ncols() {
        for i in 0..a.nrows() {
            if !a[(i, j)].is_finite() {
                return Err(Error::NotFinite { what: what.to_owned(), row: i + 1, column: j + 1 });
            }
        }
    }
    Ok(())
}

/// Fails unless the matrix has the given shape.
///
/// # Errors
/// [`Error::Shape`] naming `what`.
pub fn check_shape(what: &str, a: MatRef<'_, f64>, expected: (usize, usize)) -> Result<()> {
    let found = (a.nrows(), a.ncols());
    if found == expected { Ok(()) } else { Err(Error::Shape { what: what.to_owned(), expected, found }) }
}
