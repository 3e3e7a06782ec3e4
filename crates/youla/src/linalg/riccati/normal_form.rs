//! Normal form of a Riccati problem: with the Cholesky factor `R = L L'`, inputs `v = L' u` and states `z = D^-1 x`,
//!
//! ```text
//! A <- D^-1 A D,   B <- D^-1 B L'^-1,   Q <- D Q D,   S <- D S L'^-1,   R <- I
//! ```
//!
//! D holds powers of two. It balances the Hamiltonian matrix `[A -G; -Q -A']` under the symplectic scaling
//! `diag(D, D^-1)`, which keeps its structure (P. Benner, Symplectic balancing of Hamiltonian matrices, SIAM J. Sci. Comput.
//! 22 (2001), 1885). Positions in micrometres beside velocities in SI units differ by six decades; unscaled, the small
//! entries of Q and G would drown in the rounding of the large ones.

use super::{Equation, RiccatiProblem};
use crate::linalg::definite::UnitDiagonal;
use crate::{Error, Result};
use faer::{Mat, MatRef, Side};

/// A Riccati problem with R = I and balanced states.
pub(super) struct NormalForm {
    pub(super) equation: Equation,
    pub(super) a: Mat<f64>,
    pub(super) b: Mat<f64>,
    pub(super) q: Mat<f64>,
    pub(super) s: Mat<f64>,
    /// Diagonal of D.
    scale: Vec<f64>,
    /// Cholesky factor L of R.
    factor: Mat<f64>,
}

impl NormalForm {
    /// Checks the problem and brings it to normal form.
    pub(super) fn new(what: &str, equation: Equation, problem: &RiccatiProblem<'_>) -> Result<Self> {
        problem.check(what)?;
        let RiccatiProblem { a, b, q, r, s } = *problem;
        let factor = cholesky(&format!("the input weight R of {what}"), r)?;
        let b = divide_by_transpose(b, factor.as_ref());
        let s = match s {
            Some(s) => divide_by_transpose(s, factor.as_ref()),
            None => Mat::zeros(b.nrows(), b.ncols()),
        };
        let q = Mat::from_fn(q.nrows(), q.nrows(), |i, j| 0.5 * (q[(i, j)] + q[(j, i)]));
        let n = a.nrows();
        let mut normal = NormalForm { equation, a: a.to_owned(), b, q, s, scale: vec![1.0; n], factor };
        let scale = balancing_scale(&normal);
        normal.rescale(scale);
        Ok(normal)
    }

    /// A problem without cross term in other coordinates, balanced.
    pub(super) fn within(equation: Equation, a: Mat<f64>, b: Mat<f64>, q: Mat<f64>) -> Self {
        let (n, m) = (a.nrows(), b.ncols());
        let s = Mat::zeros(n, m);
        let mut normal = NormalForm { equation, a, b, q, s, scale: vec![1.0; n], factor: Mat::identity(m, m) };
        let scale = balancing_scale(&normal);
        normal.rescale(scale);
        normal
    }

    /// `A - B S'`, the state matrix when the cross term is absorbed by feedback.
    pub(super) fn a_without_cross_term(&self) -> Mat<f64> {
        &self.a - &self.b * self.s.transpose()
    }

    /// `Q - S S'`, the state weight when the cross term is absorbed by feedback.
    pub(super) fn q_without_cross_term(&self) -> Mat<f64> {
        &self.q - &self.s * self.s.transpose()
    }

    /// Size of the eigenvalues that count: the norm of A, and in discrete time at least that of the unit circle.
    pub(super) fn size(&self) -> f64 {
        match self.equation {
            Equation::Continuous => self.a.norm_l2(),
            Equation::Discrete => self.a.norm_l2().max(1.0),
        }
    }

    /// X in the coordinates of the problem: `D^-1 X D^-1`.
    pub(super) fn original_solution(&self, x: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] / (self.scale[i] * self.scale[j]))
    }

    /// K in the coordinates of the problem: `L'^-1 K D^-1`.
    pub(super) fn original_gain(&self, gain: &Mat<f64>) -> Mat<f64> {
        let mut k = Mat::from_fn(gain.nrows(), gain.ncols(), |i, j| gain[(i, j)] / self.scale[j]);
        self.factor.transpose().solve_upper_triangular_in_place(k.as_mut());
        k
    }

    fn rescale(&mut self, scale: Vec<f64>) {
        let n = scale.len();
        for i in 0..n {
            for j in 0..n {
                self.a[(i, j)] *= scale[j] / scale[i];
                self.q[(i, j)] *= scale[j] * scale[i];
            }
            for j in 0..self.b.ncols() {
                self.b[(i, j)] /= scale[i];
                self.s[(i, j)] *= scale[i];
            }
        }
        self.scale = scale;
    }
}

pub(super) fn check_symmetric(what: &str, a: MatRef<'_, f64>) -> Result<()> {
    let tolerance = 1e-10 * a.norm_max();
    for j in 0..a.ncols() {
        for i in 0..j {
            if (a[(i, j)] - a[(j, i)]).abs() > tolerance {
                let (upper, lower) = (a[(i, j)], a[(j, i)]);
                return Err(Error::NotSymmetric { what: what.to_owned(), row: i + 1, column: j + 1, upper, lower });
            }
        }
    }
    Ok(())
}

/// Lower Cholesky factor; refuses a matrix that is not clearly positive definite.
fn cholesky(what: &str, r: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let m = r.nrows();
    let unit = UnitDiagonal::of(r);
    let eigenvalue = unit.smallest_eigenvalue(what)?;
    let refusal = || Error::NotPositive { what: what.to_owned(), must: "positive definite", eigenvalue };
    if eigenvalue < 100.0 * f64::EPSILON * (m as f64) {
        return Err(refusal());
    }
    let factor = unit.matrix.llt(Side::Lower).map_err(|_| refusal())?;
    Ok(Mat::from_fn(m, m, |i, j| if j <= i { factor.L()[(i, j)] * unit.scale[i] } else { 0.0 }))
}

/// `B L'^-1`.
fn divide_by_transpose(b: MatRef<'_, f64>, factor: MatRef<'_, f64>) -> Mat<f64> {
    let mut transposed = b.transpose().to_owned();
    factor.solve_lower_triangular_in_place(transposed.as_mut());
    transposed.transpose().to_owned()
}

/// Powers of two that balance `[A -G; -Q -A']` under `diag(D, D^-1)`: first one common factor, then state by state while
/// that lowers the sum of the norms.
fn balancing_scale(normal: &NormalForm) -> Vec<f64> {
    let a = normal.a_without_cross_term();
    let q = normal.q_without_cross_term();
    let g = &normal.b * normal.b.transpose();
    let n = a.nrows();
    let common = match g.norm_l2() / q.norm_l2() {
        ratio if ratio.is_normal() => (0.25 * ratio.log2()).round().exp2(),
        _ => 1.0,
    };
    let mut scale = vec![common; n];
    for _ in 0..100 {
        let mut changed = false;
        for k in 0..n {
            let cost = StateCost::of(&a, &g, &q, &scale, k);
            let factor = cost.best_factor();
            if factor != 1.0 {
                scale[k] *= factor;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    scale
}

/// What a factor f on one state does to the norms: `linear f + quadratic f^2 + inverse / f + inverse_square / f^2`.
struct StateCost {
    linear: f64,
    quadratic: f64,
    inverse: f64,
    inverse_square: f64,
}

impl StateCost {
    fn of(a: &Mat<f64>, g: &Mat<f64>, q: &Mat<f64>, scale: &[f64], k: usize) -> Self {
        let d = scale[k];
        let (mut linear, mut inverse) = (0.0_f64, 0.0_f64);
        for j in (0..scale.len()).filter(|&j| j != k) {
            let e = scale[j];
            linear = linear.hypot(a[(j, k)] * d / e).hypot(q[(j, k)] * d * e);
            inverse = inverse.hypot(a[(k, j)] * e / d).hypot(g[(k, j)] / (d * e));
        }
        StateCost { linear, quadratic: q[(k, k)].abs() * d * d, inverse, inverse_square: g[(k, k)].abs() / (d * d) }
    }

    fn at(&self, f: f64) -> f64 {
        self.linear * f + self.quadratic * f * f + self.inverse / f + self.inverse_square / (f * f)
    }

    /// Power of two of least cost, 1 where it would gain less than 5 % or where one side is empty.
    fn best_factor(&self) -> f64 {
        if self.linear + self.quadratic == 0.0 || self.inverse + self.inverse_square == 0.0 {
            return 1.0;
        }
        let mut best = 1.0;
        for step in [2.0, 0.5] {
            while self.at(best * step) < 0.95 * self.at(best) {
                best *= step;
            }
        }
        best
    }
}
