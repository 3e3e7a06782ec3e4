//! Principal matrix logarithm by inverse scaling and squaring on the Schur form: A. H. Al-Mohy and N. J. Higham, Improved
//! inverse scaling and squaring algorithms for the matrix logarithm, SIAM J. Sci. Comput. 34 (2012), C153.
//!
//! `log(A) = 2^k log(A^(1/2^k))`. Square roots of the triangular factor are taken until it is near to I; then the diagonal
//! Padé approximant of `log(I + X)` is the Gauss-Legendre rule of `integral_0^1 X (I + x X)^-1 dx`.

use crate::linalg::eigen::complex_schur::{ComplexSchur, complex_schur, real_part};
use crate::{Error, Result};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::prelude::*;
use faer::{Mat, MatRef, Par, c64};

/// Largest `||T - I||` (1-norm) for which the approximant of degree 7 is exact to rounding (Al-Mohy and Higham 2012,
/// table 2.1).
const RADIUS: f64 = 2.64e-1;

/// Nodes and weights of the Gauss-Legendre rule of 7 points on [-1, 1], nodes not negative.
const LEGENDRE: [(f64, f64); 4] = [
    (0.0, 0.417_959_183_673_469_4),
    (0.405_845_151_377_397_2, 0.381_830_050_505_118_9),
    (0.741_531_185_599_394_4, 0.279_705_391_489_276_67),
    (0.949_107_912_342_758_5, 0.129_484_966_168_869_7),
];

/// Roots that are taken at most; 60 bring any eigenvalue of double precision near to 1.
const MOST_ROOTS: usize = 100;

/// The principal logarithm of a real square matrix: all its eigenvalues have imaginary parts in (-pi, pi).
///
/// `log(exp A) = A` to 1e-12 of `||A||` for `||A||` up to about 1 (held by `exponential_undoes_the_logarithm`); the
/// eigenvalues keep full relative accuracy whatever the condition number (`far_eigenvalues_keep_relative_accuracy`).
///
/// # Errors
/// [`Error::NoLogarithm`] where an eigenvalue is zero or real and negative; [`Error::Shape`], [`Error::NotFinite`] and
/// [`Error::NoConvergence`] naming `what`.
pub(crate) fn logm(what: &str, a: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let form = complex_schur(what, a)?;
    if let Some(pole) = form.eigenvalues().find(|p| p.im == 0.0 && p.re <= 0.0) {
        return Err(Error::NoLogarithm { pole });
    }
    let ComplexSchur { q, t } = form;
    let (root, roots) = roots_near_identity(what, &t)?;
    let mut log = Scale(c64::new((roots as f64).exp2(), 0.0)) * near_identity_log(&root);
    for k in 0..t.nrows() {
        log[(k, k)] = t[(k, k)].ln();
    }
    Ok(real_part((&q * log * q.adjoint()).as_ref()))
}

/// `T^(1/2^k)` within [`RADIUS`] of I, and k.
fn roots_near_identity(what: &str, t: &Mat<c64>) -> Result<(Mat<c64>, usize)> {
    let mut root = t.clone();
    for roots in 0..MOST_ROOTS {
        if distance_to_identity(&root) <= RADIUS {
            return Ok((root, roots));
        }
        root = triangular_root(&root);
    }
    Err(Error::NoConvergence { what: format!("the logarithm of {what}"), iterations: MOST_ROOTS })
}

/// `||T - I||` in the 1-norm.
fn distance_to_identity(t: &Mat<c64>) -> f64 {
    let n = t.nrows();
    (t - Mat::<c64>::identity(n, n)).col_iter().map(|c| c.norm_l1()).fold(0.0, f64::max)
}

/// Principal square root of a triangular matrix, column by column from `R R = T` (A. Bjorck and S. Hammarling, Linear
/// Algebra Appl. 52-53 (1983), 127).
fn triangular_root(t: &Mat<c64>) -> Mat<c64> {
    let n = t.nrows();
    let mut r = Mat::<c64>::zeros(n, n);
    for j in 0..n {
        r[(j, j)] = t[(j, j)].sqrt();
        for i in (0..j).rev() {
            let mut sum = t[(i, j)];
            for k in i + 1..j {
                sum -= r[(i, k)] * r[(k, j)];
            }
            r[(i, j)] = sum / (r[(i, i)] + r[(j, j)]);
        }
    }
    r
}

/// `log(T)` for triangular T near to I.
fn near_identity_log(t: &Mat<c64>) -> Mat<c64> {
    let n = t.nrows();
    let identity = Mat::<c64>::identity(n, n);
    let x = t - &identity;
    let mut log = Mat::<c64>::zeros(n, n);
    for (node, weight) in LEGENDRE {
        for signed in if node == 0.0 { vec![0.0] } else { vec![-node, node] } {
            let denominator = &identity + Scale(c64::new(0.5 * (1.0 + signed), 0.0)) * &x;
            let mut term = x.clone();
            solve_upper_triangular_in_place(denominator.as_ref(), term.as_mut(), Par::Seq);
            log += Scale(c64::new(0.5 * weight, 0.0)) * term;
        }
    }
    log
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{expm, eye};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn exponential_undoes_the_logarithm() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        for n in [1, 2, 3, 6, 12] {
            for size in [1e-6, 0.1, 0.5] {
                let a = Mat::from_fn(n, n, |_, _| {
                    let x: f64 = StandardNormal.sample(&mut rng);
                    x * size / (n as f64).sqrt()
                });
                let log = logm("exp A", expm("A", a.as_ref()).unwrap().as_ref()).unwrap();
                let error = (&log - &a).norm_l2();
                assert!(error < 1e-14 + 1e-12 * a.norm_l2(), "n = {n}, size = {size}: {error}");
            }
        }
    }

    #[test]
    fn logarithm_of_a_jordan_block_is_its_series() {
        let t = Mat::from_fn(3, 3, |i, j| if i == j || j == i + 1 { 1.0 } else { 0.0 });
        let log = logm("A", t.as_ref()).unwrap();
        for (j, exact) in [0.0, 1.0, -0.5].into_iter().enumerate() {
            assert!((log[(0, j)] - exact).abs() < 1e-14);
        }
    }

    #[test]
    fn far_eigenvalues_keep_relative_accuracy() {
        let a = Mat::from_fn(2, 2, |i, j| [[1e-8, 1.0], [0.0, 1e8]][i][j]);
        let log = logm("A", a.as_ref()).unwrap();
        let exact = (1e8f64.ln() - 1e-8f64.ln()) / (1e8 - 1e-8);
        assert!((log[(0, 1)] / exact - 1.0).abs() < 1e-7, "{}", log[(0, 1)] / exact - 1.0);
        assert!((log[(0, 0)] / 1e-8f64.ln() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn eigenvalues_on_the_closed_negative_axis_are_refused() {
        for value in [0.0, -1.0] {
            let a = Mat::from_fn(2, 2, |i, j| if i == j { [2.0, value][i] } else { 0.0 });
            match logm("A", a.as_ref()) {
                Err(Error::NoLogarithm { pole }) => assert_eq!(pole.re, value),
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(logm("A", eye(3).as_ref()).unwrap().norm_max(), 0.0);
    }
}
