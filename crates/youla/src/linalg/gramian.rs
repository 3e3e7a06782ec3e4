//! Factors of Gramians without the Gramians: X = L L' with
//! ```text
//! A X + X A' + B B' = 0      or      A X A' - X + B B' = 0,
//! ```
//! A stable, L from A and B alone, so that L keeps the digits that squaring would lose: S. J. Hammarling, Numerical solution
//! of the stable, non-negative definite Lyapunov equation, IMA J. Numer. Anal. 2 (1982), 303.
//!
//! With `A = Z T Z^H` the last row of `T = [T1 t; 0 lambda]` and of `Z^H B = [B1; b^H]` gives the last column `[u; v]` of the
//! triangular factor, and what remains is an equation of the same form for T1 with another B1:
//! ```text
//! continuous:  alpha = sqrt(-2 Re lambda)      (T1 + lambda^* I) u = -alpha B1 e - v t
//!              B1 := B1 - alpha u e^H
//! discrete:    alpha = sqrt(1 - |lambda|^2)    (I - lambda^* T1) u = alpha B1 e + v lambda^* t
//!              B1 := B1 + (alpha w - (1 + lambda) B1 e) e^H,   w = T1 u + v t
//! ```
//! where `v = ||b|| / alpha`, `e = b / ||b||`. The complex factor F becomes real by `X = Re F Re F' + Im F Im F'`.

use crate::linalg::eigen::complex_schur::{ComplexSchur, complex, complex_schur};
use crate::linalg::lyapunov::Domain;
use crate::linalg::{check_finite, check_shape};
use crate::{Error, Result};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::prelude::*;
use faer::{Mat, MatRef, Par, c64};

/// Lower triangular factor L of the solution `X = L L'` of `A X + X A' + B B' = 0`, A (n x n) stable, B (n x m). The observability Gramian is that of the
/// dual: `gramian_factor(A', C')`.
///
/// Relative residual below 1e-14 n (held by `factors_satisfy_their_equations`); unlike a factor of the computed Gramian it
/// keeps singular values far below the square root of the machine precision (`weak_directions_keep_their_digits`).
///
/// # Errors
/// [`Error::Unstable`] with the pole; [`Error::Shape`], [`Error::NotFinite`], [`Error::NoConvergence`].
pub(crate) fn gramian_factor(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    factor(Domain::Continuous, a, b)
}

/// Factor of the solution of `A X A' - X + B B' = 0`, A (n x n) stable, B (n x m); otherwise as [`gramian_factor`].
///
/// # Errors
/// [`Error::Unstable`] with the pole; [`Error::Shape`], [`Error::NotFinite`], [`Error::NoConvergence`].
pub(crate) fn discrete_gramian_factor(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    factor(Domain::Discrete, a, b)
}

fn factor(domain: Domain, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    check_shape("the input matrix of the Gramian", b, (a.nrows(), b.ncols()))?;
    check_finite("the input matrix of the Gramian", b)?;
    let form = complex_schur("the state matrix of the Gramian", a)?;
    require_stable(domain, &form)?;
    let ComplexSchur { q, t } = form;
    let u = triangular(domain, &t, q.adjoint() * complex(b));
    Ok(real_factor(&(q * u)))
}

fn require_stable(domain: Domain, form: &ComplexSchur) -> Result<()> {
    let beyond = |p: c64| match domain {
        Domain::Continuous => p.re,
        Domain::Discrete => p.norm() - 1.0,
    };
    match form.eigenvalues().max_by(|p, q| beyond(*p).total_cmp(&beyond(*q))) {
        Some(pole) if beyond(pole) >= 0.0 => Err(Error::Unstable { what: "the system of the Gramian".into(), pole }),
        _ => Ok(()),
    }
}

/// Upper triangular U with `X = U U^H` for the triangular T and any B (n x m), from the last column to the first.
fn triangular(domain: Domain, t: &Mat<c64>, mut b: Mat<c64>) -> Mat<c64> {
    let n = t.nrows();
    let mut factor = Mat::<c64>::zeros(n, n);
    for k in (0..n).rev() {
        let e = b.row(k).adjoint().to_owned();
        let length = e.norm_l2();
        if length == 0.0 {
            continue; // X has neither row nor column k.
        }
        let e = Scale(c64::new(1.0 / length, 0.0)) * e;
        let step = match domain {
            Domain::Continuous => continuous_step(t, &b, k, &e, length),
            Domain::Discrete => discrete_step(t, &b, k, &e, length),
        };
        factor[(k, k)] = c64::new(step.v, 0.0);
        for i in 0..k {
            factor[(i, k)] = step.u[i];
            for j in 0..b.ncols() {
                b[(i, j)] += step.change[i] * e[j].conj();
            }
        }
    }
    factor
}

/// Last column `[u; v]` of the factor, and the column c of the update `B1 := B1 + c e^H`.
struct Step {
    u: Col<c64>,
    v: f64,
    change: Col<c64>,
}

fn continuous_step(t: &Mat<c64>, b: &Mat<c64>, k: usize, e: &Col<c64>, length: f64) -> Step {
    let pole = t[(k, k)];
    let alpha = (-2.0 * pole.re).sqrt();
    let v = length / alpha;
    let (t1, column) = (t.submatrix(0, 0, k, k), t.col(k).subrows(0, k));
    let rhs = Scale(c64::new(-alpha, 0.0)) * (b.subrows(0, k) * e) - Scale(c64::new(v, 0.0)) * column;
    let u = solve_upper(t1 + Scale(pole.conj()) * Mat::<c64>::identity(k, k), rhs);
    Step { change: Scale(c64::new(-alpha, 0.0)) * &u, u, v }
}

fn discrete_step(t: &Mat<c64>, b: &Mat<c64>, k: usize, e: &Col<c64>, length: f64) -> Step {
    let pole = t[(k, k)];
    let modulus = pole.norm();
    let alpha = ((1.0 - modulus) * (1.0 + modulus)).sqrt();
    let v = length / alpha;
    let (t1, column) = (t.submatrix(0, 0, k, k), Scale(c64::new(v, 0.0)) * t.col(k).subrows(0, k));
    let along = b.subrows(0, k) * e;
    let alpha = c64::new(alpha, 0.0);
    let rhs = Scale(alpha) * &along + Scale(pole.conj()) * &column;
    let u = solve_upper(Mat::<c64>::identity(k, k) - Scale(pole.conj()) * t1, rhs);
    let w = t1 * &u + column;
    Step { change: Scale(alpha) * w - Scale(pole + 1.0) * along, u, v }
}

/// Solves an upper triangular system with one right-hand side.
fn solve_upper(operator: Mat<c64>, mut rhs: Col<c64>) -> Col<c64> {
    solve_upper_triangular_in_place(operator.as_ref(), rhs.as_mat_mut(), Par::Seq);
    rhs
}

/// Real lower triangular L with `L L' = F F^H`, which is real: R' of the QR factorisation of `[Re F, Im F]'`.
fn real_factor(f: &Mat<c64>) -> Mat<f64> {
    let n = f.nrows();
    let stacked = Mat::from_fn(2 * n, n, |i, j| if i < n { f[(j, i)].re } else { f[(j, i - n)].im });
    stacked.qr().thin_R().transpose().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::lyapunov::residual;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    type Factor = fn(MatRef<'_, f64>, MatRef<'_, f64>) -> Result<Mat<f64>>;

    fn random(rows: usize, columns: usize, rng: &mut ChaCha8Rng) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| StandardNormal.sample(rng))
    }

    #[test]
    fn factors_satisfy_their_equations() {
        let mut rng = ChaCha8Rng::seed_from_u64(31);
        for n in 0..=25 {
            for m in 0..=3 {
                let (a, b) = (random(n, n, &mut rng), random(n, m, &mut rng));
                let size = 0.1 + a.norm_l2();
                let shifted = &a - Scale(size) * Mat::<f64>::identity(n, n);
                let shrunk = Scale(1.0 / size) * &a;
                let continuous = gramian_factor(shifted.as_ref(), b.as_ref()).unwrap();
                let discrete = discrete_gramian_factor(shrunk.as_ref(), b.as_ref()).unwrap();
                let cases = [(Domain::Continuous, shifted, continuous), (Domain::Discrete, shrunk, discrete)];
                for (domain, a, l) in cases {
                    let (x, input) = (&l * l.transpose(), &b * b.transpose());
                    let residual = residual(domain, a.as_ref(), x.as_ref(), input.as_ref());
                    assert!(residual <= 1e-14 * n as f64, "n = {n}, m = {m}: {residual}");
                    assert!((0..n).all(|j| (0..j).all(|i| l[(i, j)] == 0.0)));
                }
            }
        }
    }

    #[test]
    fn weak_directions_keep_their_digits() {
        // Two decoupled states, the second driven 1e-12 as strongly, behind a rotation.
        let (c, s) = (0.6, 0.8);
        let q = Mat::from_fn(2, 2, |i, j| [[c, -s], [s, c]][i][j]);
        let diagonal = |x: f64, y: f64| Mat::from_fn(2, 2, |i, j| if i == j { [x, y][i] } else { 0.0 });
        let b = diagonal(1.0, 1e-12);
        for (factor, poles, exact) in [
            (gramian_factor as Factor, diagonal(-1.0, -3.0), 1e-12 / 6f64.sqrt()),
            (discrete_gramian_factor, diagonal(0.3, 0.6), 1.25e-12),
        ] {
            let a = &q * poles * q.transpose();
            let result = factor(a.as_ref(), (&q * &b).as_ref()).unwrap();
            let singular = result.singular_values().unwrap();
            assert!((singular[1] / exact - 1.0).abs() < 1e-2, "{} {exact}", singular[1]);
        }
    }

    #[test]
    fn unstable_systems_are_refused_with_their_pole() {
        let a = Mat::from_fn(2, 2, |i, j| [[0.5, 0.0], [0.0, -1.25]][i][j]);
        let b = Mat::zeros(2, 1);
        let pole = |result: Result<Mat<f64>>| match result {
            Err(Error::Unstable { pole, .. }) => pole.re,
            other => panic!("{other:?}"),
        };
        assert_eq!(pole(gramian_factor(a.as_ref(), b.as_ref())), 0.5);
        assert_eq!(pole(discrete_gramian_factor(a.as_ref(), b.as_ref())), -1.25);
    }
}
