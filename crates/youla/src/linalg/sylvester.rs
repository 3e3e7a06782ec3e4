//! Sylvester equations `A X + X B = C` and `A X B - X = C` by the method of Bartels and Stewart (Comm. ACM 15 (1972), 820):
//! real Schur forms `A = U T U'` and `B' = V S V'` turn them into `T Y + Y S' = D` and `T Y S' - Y = D` with `D = U' C V`,
//! which are solved block by block from the lower right corner; then `X = U Y V'`.

use crate::Result;
use crate::linalg::eigen::schur::{RealSchur, real_schur};
pub(super) use crate::linalg::substitution::Form;
use crate::linalg::substitution::{substitute, substitute_symmetric};
use crate::linalg::{check_finite, check_shape};
use faer::{Mat, MatRef};

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
/// [`crate::Error::Shape`] and [`crate::Error::NotFinite`] naming `what`; [`crate::Error::Singular`] where the solution is not unique to
/// working precision; [`crate::Error::NoConvergence`] of a Schur form.
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
    substitute(what, form, left.t.as_ref(), right.t.as_ref(), y.as_mut())?;
    Ok(&left.q * y * right.q.transpose())
}

/// The same for one form on both sides and a symmetric right-hand side; the solution is symmetric to the last digit.
pub(super) fn solve_symmetric(what: &str, form: Form, schur: &RealSchur, c: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let mut y = schur.q.transpose() * c * &schur.q;
    substitute_symmetric(what, form, schur.t.as_ref(), y.as_mut())?;
    let x = &schur.q * y * schur.q.transpose();
    Ok(0.5 * (&x + x.transpose()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
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
