//! Lyapunov equations `A X + X A' + Q = 0` and `A X A' - X + Q = 0` (Stein) by the Schur method: R. H. Bartels and G. W.
//! Stewart, Commun. ACM 15 (1972), 820; G. Kitagawa, Int. J. Control 25 (1977), 745. They are Sylvester equations
//! whose two coefficients share one real Schur form.

use crate::linalg::eigen::schur::RealSchur;
use crate::linalg::sylvester::{Form, solve_on_schur_forms, solve_symmetric};
use crate::linalg::{check_finite, check_shape, real_schur};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Solution of a Lyapunov equation.
#[derive(Debug, Clone)]
pub struct Lyapunov {
    /// Symmetric where Q is, n x n.
    pub x: Mat<f64>,
    /// Frobenius norm of the left-hand side over the sum of the norms of its terms, `||A|| ||X||` standing for products.
    pub residual: f64,
}

/// Which of the two equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Domain {
    /// `A X + X A' + Q = 0`.
    Continuous,
    /// `A X A' - X + Q = 0`.
    Discrete,
}

/// Solves `A X + X A' + Q = 0` for A and Q (n x n); A need not be stable.
///
/// Relative residual below 1e-14 n (held by `solutions_satisfy_their_equations`).
///
/// # Errors
/// [`Error::NoSolution`] where two eigenvalues of A add up to zero; [`Error::Shape`], [`Error::NotFinite`],
/// [`Error::NoConvergence`].
///
/// ```
/// use youla::linalg::{eye, lyapunov};
/// let a = eye(2) * faer::Scale(-0.5);
/// assert!((lyapunov(a.as_ref(), eye(2).as_ref())?.x - eye(2)).norm_l2() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn lyapunov(a: MatRef<'_, f64>, q: MatRef<'_, f64>) -> Result<Lyapunov> {
    solve(Domain::Continuous, a, q)
}

/// Solves `A X A' - X + Q = 0` for A and Q (n x n); A need not be stable.
///
/// Relative residual below 1e-14 n (held by `solutions_satisfy_their_equations`).
///
/// # Errors
/// [`Error::NoSolution`] where two eigenvalues of A have the product 1; [`Error::Shape`], [`Error::NotFinite`],
/// [`Error::NoConvergence`].
///
/// ```
/// use youla::linalg::{discrete_lyapunov, eye};
/// let a = eye(2) * faer::Scale(0.5);
/// assert!((discrete_lyapunov(a.as_ref(), eye(2).as_ref())?.x[(0, 0)] - 4.0 / 3.0).abs() < 1e-15);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn discrete_lyapunov(a: MatRef<'_, f64>, q: MatRef<'_, f64>) -> Result<Lyapunov> {
    solve(Domain::Discrete, a, q)
}

fn solve(domain: Domain, a: MatRef<'_, f64>, q: MatRef<'_, f64>) -> Result<Lyapunov> {
    let n = a.nrows();
    check_shape("the constant term of the Lyapunov equation", q, (n, n))?;
    check_finite("the constant term of the Lyapunov equation", q)?;
    let schur = real_schur("the matrix A of the Lyapunov equation", a)?;
    let (form, condition) = match domain {
        Domain::Continuous => (Form::Sum, "two eigenvalues of A add up to zero"),
        Domain::Discrete => (Form::Product, "two eigenvalues of A have the product 1"),
    };
    let x = if q == q.transpose() {
        solve_symmetric("X", form, &schur, (-q).as_ref())
    } else {
        solve_on_schur_forms("X", form, &schur, &schur, (-q).as_ref())
    };
    let x = x.map_err(|e| match e {
        Error::Singular { .. } => {
            let what = "the Lyapunov equation".into();
            Error::NoSolution { what, condition: condition.into(), residual: f64::NAN }
        }
        other => other,
    })?;
    let residual = residual(domain, a, x.as_ref(), q);
    Ok(Lyapunov { x, residual })
}

/// X of `A X A' - X + Q = 0` for a symmetric Q, with the Schur form of A.
///
/// # Errors
/// [`Error::Singular`] where two eigenvalues of A have the product 1.
pub(crate) fn discrete_lyapunov_on(schur: &RealSchur, q: MatRef<'_, f64>) -> Result<Mat<f64>> {
    solve_symmetric("X", Form::Product, schur, (-q).as_ref())
}

/// Relative residual, zero where all terms are.
pub(super) fn residual(domain: Domain, a: MatRef<'_, f64>, x: MatRef<'_, f64>, q: MatRef<'_, f64>) -> f64 {
    let (left, size) = match domain {
        Domain::Continuous => (a * x + x * a.transpose() + q, 2.0 * a.norm_l2() * x.norm_l2()),
        Domain::Discrete => (a * x * a.transpose() - x + q, (a.norm_l2().powi(2) + 1.0) * x.norm_l2()),
    };
    let size = size + q.norm_l2();
    if size == 0.0 { 0.0 } else { left.norm_l2() / size }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::eye;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn solutions_satisfy_their_equations() {
        let mut rng = ChaCha8Rng::seed_from_u64(21);
        for n in 0..=25 {
            let a = Mat::from_fn(n, n, |_, _| StandardNormal.sample(&mut rng));
            let q: Mat<f64> = Mat::from_fn(n, n, |_, _| StandardNormal.sample(&mut rng));
            for solution in [lyapunov(a.as_ref(), q.as_ref()), discrete_lyapunov(a.as_ref(), q.as_ref())] {
                let residual = solution.unwrap().residual;
                assert!(residual <= 1e-14 * n as f64, "n = {n}: {residual}");
            }
        }
    }

    #[test]
    fn equations_without_a_unique_solution_are_refused() {
        let a = Mat::from_fn(2, 2, |i, j| if i == j { [2.0, -2.0][i] } else { 0.0 });
        assert!(matches!(lyapunov(a.as_ref(), eye(2).as_ref()), Err(Error::NoSolution { .. })));
        let a = Mat::from_fn(2, 2, |i, j| if i == j { [2.0, 0.5][i] } else { 0.0 });
        assert!(matches!(discrete_lyapunov(a.as_ref(), eye(2).as_ref()), Err(Error::NoSolution { .. })));
    }
}
