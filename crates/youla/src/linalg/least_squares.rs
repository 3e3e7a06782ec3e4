//! Linear least squares `min ||A X - B||` with the solution of least norm where A lacks rank.
//!
//! The columns of A are brought to unit length first, so that units do not decide what counts as dependent; then the
//! singular value decomposition is truncated (Golub, Van Loan, Matrix Computations, section 5.5).

use crate::linalg::triangular_condition;
use crate::{Error, Result};
use faer::linalg::solvers::SolveLstsq;
use faer::{Mat, MatRef};

/// Singular values below this share of the largest one count as zero.
const RANK_TOLERANCE: f64 = 1e-12;

/// Condition number, columns of unit length, up to which QR without pivoting is as good as the singular values.
const WELL_CONDITIONED: f64 = 1e8;

/// The solution of a least-squares problem and how well determined it is.
#[derive(Debug, Clone)]
pub struct LeastSquares {
    /// The solution, columns of A x columns of B.
    pub x: Mat<f64>,
    /// Numerical rank of A with columns of unit length.
    pub rank: usize,
    /// Its reciprocal condition number (2-norm); 1 where A has no columns.
    pub rcond: f64,
}

/// Solves `min ||A X - B||` for all columns of `B` at once.
///
/// # Errors
/// [`Error::NoConvergence`] naming `what` where the singular value decomposition fails.
///
/// ```
/// use youla::{Mat, linalg::least_squares};
/// let line = Mat::from_fn(3, 1, |_, _| 1.0);
/// let data = Mat::from_fn(3, 1, |i, _| i as f64);
/// assert!((least_squares("the mean", line.as_ref(), data.as_ref())?.x[(0, 0)] - 1.0).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn least_squares(what: &str, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<LeastSquares> {
    let columns = a.ncols();
    if columns == 0 || a.nrows() == 0 {
        return Ok(LeastSquares { x: Mat::zeros(columns, b.ncols()), rank: 0, rcond: 1.0 });
    }
    let length: Vec<f64> = (0..columns).map(|j| positive_or_one(a.col(j).norm_l2())).collect();
    let unit = Mat::from_fn(a.nrows(), columns, |i, j| a[(i, j)] / length[j]);
    let svd = unit
        .thin_svd()
        .map_err(|_| Error::NoConvergence { what: format!("the singular values of {what}"), iterations: 0 })?;
    let sigma: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    let rank = sigma.iter().filter(|s| **s > RANK_TOLERANCE * sigma[0]).count();
    let mut coordinates = svd.U().subcols(0, rank).transpose() * b;
    for (i, s) in sigma[..rank].iter().enumerate() {
        coordinates.row_mut(i).iter_mut().for_each(|v| *v /= s);
    }
    let mut x = svd.V().subcols(0, rank) * coordinates;
    for (i, l) in length.iter().enumerate() {
        x.row_mut(i).iter_mut().for_each(|v| *v /= l);
    }
    let determined = if a.nrows() < columns { 0.0 } else { sigma[columns - 1] };
    Ok(LeastSquares { x, rank, rcond: if sigma[0] > 0.0 { determined / sigma[0] } else { 0.0 } })
}

/// The solution alone: by QR where the columns are far from dependent, else as [`least_squares`].
///
/// # Errors
/// As [`least_squares`].
pub fn regress(what: &str, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let columns = a.ncols();
    if columns == 0 || a.nrows() < columns {
        return Ok(least_squares(what, a, b)?.x);
    }
    let qr = a.qr();
    let r = qr.thin_R();
    let length: Vec<f64> = (0..columns).map(|j| r.col(j).norm_l2()).collect();
    let lower = Mat::from_fn(columns, columns, |i, j| if i >= j { r[(j, i)] / length[i] } else { 0.0 });
    // A zero column makes the condition NaN.
    let well_conditioned = triangular_condition(lower.as_ref()) < WELL_CONDITIONED;
    if well_conditioned { Ok(qr.solve_lstsq(b)) } else { Ok(least_squares(what, a, b)?.x) }
}

fn positive_or_one(length: f64) -> f64 {
    if length > 0.0 { length } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residual_is_orthogonal_and_units_do_not_matter() {
        let a = Mat::from_fn(9, 3, |i, j| ((i * i * (j + 2)) as f64 + 1.0).sin() * [1.0, 1e9, 1e-9][j]);
        let b = Mat::from_fn(9, 2, |i, j| ((2 * i + j) as f64).cos());
        let solution = least_squares("a test", a.as_ref(), b.as_ref()).unwrap();
        let residual = &a * &solution.x - &b;
        for j in 0..3 {
            assert!((a.col(j).transpose() * &residual).norm_max() < 1e-14 * a.col(j).norm_l2());
        }
        assert_eq!(solution.rank, 3);
        assert!(solution.rcond > 1e-2);
    }

    #[test]
    fn both_ways_agree_and_dependent_columns_take_the_careful_one() {
        let good = Mat::from_fn(9, 3, |i, j| ((i * i * (j + 2)) as f64 + 1.0).sin() * [1.0, 1e9, 1e-9][j]);
        let twice = Mat::from_fn(9, 3, |i, j| good[(i, j.min(1))]);
        let zero = Mat::from_fn(9, 3, |i, j| if j == 1 { 0.0 } else { good[(i, j)] });
        let b = Mat::from_fn(9, 2, |i, j| ((2 * i + j) as f64).cos());
        for a in [good, twice, zero] {
            let (fast, careful) =
                (regress("a test", a.as_ref(), b.as_ref()), least_squares("a test", a.as_ref(), b.as_ref()));
            let (fast, careful) = (fast.unwrap(), careful.unwrap().x);
            let error = (&a * (&fast - &careful)).norm_max();
            assert!(error < 1e-13 && fast.norm_l2() < 1.001 * careful.norm_l2(), "{error:.1e}");
        }
    }

    #[test]
    fn dependent_columns_share() {
        let a = Mat::from_fn(4, 2, |i, _| i as f64 + 1.0);
        let b = Mat::from_fn(4, 1, |i, _| i as f64 + 1.0);
        let solution = least_squares("a test", a.as_ref(), b.as_ref()).unwrap();
        assert_eq!(solution.rank, 1);
        assert!((solution.x[(0, 0)] - 0.5).abs() < 1e-14 && (solution.x[(1, 0)] - 0.5).abs() < 1e-14);
    }
}
