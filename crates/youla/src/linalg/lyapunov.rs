//! Lyapunov equations `A X + X A' + Q = 0` and `A X A' - X + Q = 0` (Stein) by the Schur method: R. H. Bartels and G. W.
//! Stewart, Commun. ACM 15 (1972), 820; G. Kitagawa, Int. J. Control 25 (1977), 745. With `A = Z T Z^H` the columns of
//! `Z^H X Z` follow from the last to the first, each from a triangular system.

use super::complex_schur::{ComplexSchur, complex, complex_schur, real_part};
use super::{check_finite, check_shape};
use crate::{Error, Result};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::prelude::*;
use faer::{Mat, MatRef, Par, c64};

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
    let ComplexSchur { q: z, t } = complex_schur("the matrix A of the Lyapunov equation", a)?;
    let constant = z.adjoint() * complex(q) * &z;
    let y = triangular(domain, &t, &constant)?;
    let x = real_part((&z * y * z.adjoint()).as_ref());
    let residual = residual(domain, a, x.as_ref(), q);
    Ok(Lyapunov { x, residual })
}

/// The equation with the triangular T in place of A. Column k of `T Y + Y T^H + Q = 0` reads
/// `(T + t_kk^* I) y_k = -q_k - sum_(j>k) t_kj^* y_j`; of `T Y T^H - Y + Q = 0`,
/// `(t_kk^* T - I) y_k = -q_k - T sum_(j>k) t_kj^* y_j`.
fn triangular(domain: Domain, t: &Mat<c64>, q: &Mat<c64>) -> Result<Mat<c64>> {
    let n = t.nrows();
    let identity = Mat::<c64>::identity(n, n);
    let mut y = Mat::<c64>::zeros(n, n);
    for k in (0..n).rev() {
        let mut later = Mat::<c64>::zeros(n, 1);
        for j in k + 1..n {
            for i in 0..n {
                later[(i, 0)] += t[(k, j)].conj() * y[(i, j)];
            }
        }
        let pole = t[(k, k)].conj();
        let (operator, later) = match domain {
            Domain::Continuous => (t + Scale(pole) * &identity, later),
            Domain::Discrete => (Scale(pole) * t - &identity, t * later),
        };
        check_regular(domain, &operator, t)?;
        let mut column = Scale(c64::new(-1.0, 0.0)) * q.subcols(k, 1) - later;
        solve_upper_triangular_in_place(operator.as_ref(), column.as_mut(), Par::Seq);
        y.as_mut().subcols_mut(k, 1).copy_from(column);
    }
    Ok(y)
}

fn check_regular(domain: Domain, operator: &Mat<c64>, t: &Mat<c64>) -> Result<()> {
    let (floor, condition) = match domain {
        Domain::Continuous => (f64::EPSILON * t.norm_max(), "two eigenvalues of A add up to zero"),
        Domain::Discrete => (f64::EPSILON, "two eigenvalues of A have the product 1"),
    };
    if (0..t.nrows()).all(|i| operator[(i, i)].norm() > floor) {
        return Ok(());
    }
    Err(Error::NoSolution { what: "the Lyapunov equation".into(), condition: condition.into(), residual: f64::NAN })
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
