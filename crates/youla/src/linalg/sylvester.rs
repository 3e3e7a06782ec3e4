//! Sylvester equations `A X + X B = C` and `A X B - X = C` by the method of Bartels and Stewart (Comm. ACM 15 (1972), 820):
//! real Schur forms `A = U T U'` and `B' = V S V'` turn them into `T Y + Y S' = D` and `T Y S' - Y = D` with `D = U' C V`,
//! which are solved block by block from the lower right corner; then `X = U Y V'`.

use super::kronecker::{Small, SmallSolution};
use super::schur::{DiagonalBlock, RealSchur, blocks, real_schur};
use super::{check_finite, check_shape};
use crate::{Error, Result};
use faer::prelude::*;
use faer::{Mat, MatMut, MatRef};

/// Order up to which an equation is not split.
const UNSPLIT: usize = 16;

/// Solution of a Sylvester equation.
#[derive(Debug, Clone)]
pub struct SylvesterSolution {
    /// Solution X, n x m.
    pub x: Mat<f64>,
    /// `||A X + X B - C|| / (||A X|| + ||X B|| + ||C||)`, or the same of `A X B - X = C`, in the Frobenius norm.
    pub relative_residual: f64,
}

/// Solves `A X + X B = C` for A (n x n), B (m x m) and C (n x m).
///
/// The solution exists and is unique where no eigenvalue of A is the negative of one of B. The relative residual is a
/// small multiple of the machine precision (held to 1e-13 by `random_equations_are_solved`).
///
/// # Errors
/// [`Error::Shape`] and [`Error::NotFinite`] naming `what`; [`Error::Singular`] where the solution is not unique to
/// working precision; [`Error::NoConvergence`] of a Schur form.
///
/// ```
/// use youla::{Mat, linalg::{eye, sylvester}};
/// let solution = sylvester("X", eye(2).as_ref(), eye(3).as_ref(), Mat::full(2, 3, 4.0).as_ref())?;
/// assert!((solution.x[(1, 2)] - 2.0).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn sylvester(what: &str, a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> Result<SylvesterSolution> {
    bartels_stewart(what, Form::Sum, a, b, c)
}

/// Solves `A X B - X = C` for A (n x n), B (m x m) and C (n x m).
///
/// The solution exists and is unique where no product of an eigenvalue of A and one of B is 1. Accuracy as for
/// [`sylvester()`].
///
/// # Errors
/// As for [`sylvester()`].
///
/// ```
/// use youla::{Mat, linalg::{discrete_sylvester, eye}};
/// let half = 0.5 * eye(1);
/// let solution = discrete_sylvester("X", half.as_ref(), half.as_ref(), Mat::full(1, 1, -3.0).as_ref())?;
/// assert!((solution.x[(0, 0)] - 4.0).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn discrete_sylvester(
    what: &str,
    a: MatRef<'_, f64>,
    b: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
) -> Result<SylvesterSolution> {
    bartels_stewart(what, Form::Product, a, b, c)
}

/// The two equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// `A X + X B = C`.
    Sum,
    /// `A X B - X = C`.
    Product,
}

fn bartels_stewart(
    what: &str,
    form: Form,
    a: MatRef<'_, f64>,
    b: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
) -> Result<SylvesterSolution> {
    check_shape(&format!("the right-hand side of the equation of {what}"), c, (a.nrows(), b.nrows()))?;
    check_finite(&format!("the right-hand side of the equation of {what}"), c)?;
    let left = real_schur(&format!("the left coefficient of the equation of {what}"), a)?;
    let right = real_schur(&format!("the right coefficient of the equation of {what}"), b.transpose())?;
    let x = solve_on_schur_forms(what, form, &left, &right, c)?;
    let (first, second) = match form {
        Form::Sum => (a * &x, &x * b),
        Form::Product => (a * &x * b, -&x),
    };
    let residual = (&first + &second - c).norm_l2();
    let size = first.norm_l2() + second.norm_l2() + c.norm_l2();
    let relative_residual = if size == 0.0 { 0.0 } else { residual / size };
    Ok(SylvesterSolution { x, relative_residual })
}

/// Solves the equation whose coefficients are `A = U T U'` (`left`) and `B = V S' V'` (`right` is the Schur form of B').
/// With `left` and `right` the same, these are the Lyapunov and Stein equations.
pub(super) fn solve_on_schur_forms(
    what: &str,
    form: Form,
    left: &RealSchur,
    right: &RealSchur,
    c: MatRef<'_, f64>,
) -> Result<Mat<f64>> {
    let mut y = left.q.transpose() * c * &right.q;
    solve_quasi_triangular(what, form, left.t.as_ref(), right.t.as_ref(), y.as_mut())?;
    Ok(&left.q * y * right.q.transpose())
}

/// Solves `T Y + Y S' = D` or `T Y S' - Y = D` by halves of the longer side, so that most of the work is matrix products: with
/// `T = [T1 T12; 0 T2]` the lower half of Y comes first, with `S = [S1 S12; 0 S2]` its right half.
fn solve_quasi_triangular(
    what: &str,
    form: Form,
    t: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
    mut y: MatMut<'_, f64>,
) -> Result<()> {
    let (n, m) = (t.nrows(), s.nrows());
    if n.max(m) <= UNSPLIT {
        return solve_by_columns(what, form, t, s, y);
    }
    if n >= m {
        let k = middle(t);
        let (t1, t12, _, t2) = t.split_at(k, k);
        let (mut upper, mut lower) = y.split_at_row_mut(k);
        solve_quasi_triangular(what, form, t2, s, lower.rb_mut())?;
        let known = match form {
            Form::Sum => t12 * &lower,
            Form::Product => t12 * (&lower * s.transpose()),
        };
        upper -= known;
        return solve_quasi_triangular(what, form, t1, s, upper);
    }
    let k = middle(s);
    let (s1, s12, _, s2) = s.split_at(k, k);
    let (mut left, mut right) = y.rb_mut().split_at_col_mut(k);
    solve_quasi_triangular(what, form, t, s2, right.rb_mut())?;
    let known = &right * s12.transpose();
    left -= if form == Form::Sum { known } else { t * known };
    solve_quasi_triangular(what, form, t, s1, left)
}

/// A row near the middle between two diagonal blocks.
fn middle(t: MatRef<'_, f64>) -> usize {
    let k = t.nrows() / 2;
    if t[(k, k - 1)] == 0.0 { k } else { k + 1 }
}

/// The same, block column by block column from the right.
fn solve_by_columns(
    what: &str,
    form: Form,
    t: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
    mut y: MatMut<'_, f64>,
) -> Result<()> {
    let (rows, columns) = (blocks(t), blocks(s));
    let (n, m) = (t.nrows(), s.nrows());
    for &column in columns.iter().rev() {
        let (j, width) = (column.start, column.size);
        let solved = j + width..m;
        // Y_right S'_right,j is known; it enters as it is or multiplied by T.
        let known = y.as_ref().subcols(solved.start, solved.len())
            * s.submatrix(j, solved.start, width, solved.len()).transpose();
        let known = if form == Form::Sum { known } else { t * known };
        for k in 0..width {
            for i in 0..n {
                y[(i, j + k)] -= known[(i, k)];
            }
        }
        for &row in rows.iter().rev() {
            solve_block(what, form, t, s, y.rb_mut(), row, column)?;
        }
    }
    Ok(())
}

/// Solves for one block of Y, all blocks below it in its block column being known.
fn solve_block(
    what: &str,
    form: Form,
    t: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
    y: MatMut<'_, f64>,
    row: DiagonalBlock,
    column: DiagonalBlock,
) -> Result<()> {
    let n = t.nrows();
    let (i, j, height, width) = (row.start, column.start, row.size, column.size);
    let (t_ii, s_jj) = (t.submatrix(i, i, height, height), s.submatrix(j, j, width, width));
    let mut below = [[0.0; 2]; 2];
    for l in i + height..n {
        for k in 0..width {
            for r in 0..height {
                below[k][r] += t[(i + r, l)] * y[(l, j + k)];
            }
        }
    }
    let rhs = Mat::from_fn(height, width, |r, k| {
        let from_below = match form {
            Form::Sum => below[k][r],
            Form::Product => (0..width).map(|q| below[q][r] * s_jj[(k, q)]).sum(),
        };
        y[(i + r, j + k)] - from_below
    });
    let (system, size) = match form {
        Form::Sum => (Small::sum(t_ii, s_jj, rhs.as_ref()), t_ii.norm_max() + s_jj.norm_max()),
        Form::Product => (Small::product(t_ii, s_jj, rhs.as_ref()), t_ii.norm_max() * s_jj.norm_max() + 1.0),
    };
    let SmallSolution { x, smallest_pivot, .. } = system.solve();
    let rcond = smallest_pivot / size;
    if !rcond.is_finite() || rcond <= f64::EPSILON {
        return Err(Error::Singular { what: format!("the equation of {what}"), rcond: rcond.max(0.0) });
    }
    y.submatrix_mut(i, j, height, width).copy_from(&x);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn random(rng: &mut ChaCha8Rng, n: usize, m: usize) -> Mat<f64> {
        Mat::from_fn(n, m, |_, _| StandardNormal.sample(rng))
    }

    #[test]
    fn random_equations_are_solved() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for n in 1..=20 {
            for m in [1, 2, 5, 17] {
                let (a, b) = (random(&mut rng, n, n), random(&mut rng, m, m));
                let x = random(&mut rng, n, m);
                let c = &a * &x + &x * &b;
                let solution = sylvester("X", a.as_ref(), b.as_ref(), c.as_ref()).unwrap();
                assert!(solution.relative_residual < 1e-13, "{}", solution.relative_residual);
                assert!((&solution.x - &x).norm_l2() < 1e-8 * x.norm_l2());
                let c = &a * &x * &b - &x;
                let solution = discrete_sylvester("X", a.as_ref(), b.as_ref(), c.as_ref()).unwrap();
                assert!(solution.relative_residual < 1e-13, "{}", solution.relative_residual);
                assert!((&solution.x - &x).norm_l2() < 1e-8 * x.norm_l2());
            }
        }
    }

    #[test]
    fn common_eigenvalues_are_refused() {
        let a = Mat::from_fn(2, 2, |i, j| [[0.0, 2.0], [-2.0, 0.0]][i][j]);
        let c = Mat::full(2, 2, 1.0);
        assert!(matches!(sylvester("X", a.as_ref(), a.as_ref(), c.as_ref()), Err(Error::Singular { .. })));
        let one = Mat::full(1, 1, 1.0);
        assert!(matches!(
            discrete_sylvester("X", one.as_ref(), one.as_ref(), one.as_ref()),
            Err(Error::Singular { .. })
        ));
    }

    #[test]
    fn a_right_hand_side_of_wrong_shape_is_refused() {
        let (a, b, c) = (Mat::zeros(2, 2), Mat::zeros(3, 3), Mat::zeros(3, 2));
        assert!(matches!(sylvester("X", a.as_ref(), b.as_ref(), c.as_ref()), Err(Error::Shape { .. })));
    }
}
