//! Residual, gain and Newton refinement of a Riccati equation in normal form (R = I).
//!
//! A Newton step adds the solution D of the Lyapunov or Stein equation of the closed loop `Ac = A - B K`,
//!
//! ```text
//! Ac'D + D Ac = -residual(X)       Ac'D Ac - D = -residual(X)
//! ```
//!
//! (Kleinman 1968; Hewer 1971). Started near the solution it converges quadratically, and it works on the data of
//! the problem, so that it removes the rounding of the transformations that led to the start.

use super::Equation;
use super::normal_form::NormalForm;
use crate::Result;
use crate::linalg::sylvester::{Form, solve_on_schur_forms};
use crate::linalg::{eye, real_schur, solve, solve_in_any_units};
use faer::prelude::*;
use faer::{Mat, Side};

/// Most Newton steps; near the solution two suffice.
const MOST_STEPS: usize = 8;

/// A refined solution.
pub(super) struct Refined {
    pub(super) x: Mat<f64>,
    pub(super) relative_residual: f64,
    pub(super) steps: usize,
}

/// Newton steps as long as each at least halves the residual.
pub(super) fn refine(what: &str, normal: &NormalForm, start: Mat<f64>) -> Result<Refined> {
    let mut x = start;
    let mut residual = Residual::of(normal, &x)?;
    for steps in 0..MOST_STEPS {
        let Some(next) = step(what, normal, &x, &residual) else {
            return Ok(Refined { x, relative_residual: residual.relative, steps });
        };
        let next_residual = Residual::of(normal, &next)?;
        let gained = next_residual.relative / residual.relative;
        if gained < 1.0 {
            (x, residual) = (next, next_residual);
        }
        if gained.is_nan() || gained > 0.5 {
            let steps = steps + usize::from(gained < 1.0);
            return Ok(Refined { x, relative_residual: residual.relative, steps });
        }
    }
    Ok(Refined { x, relative_residual: residual.relative, steps: MOST_STEPS })
}

/// `K = B'X + S'`, or `(I + B'X B)^-1 (B'X A + S')`, with `A - B K` stable.
pub(super) fn gain(normal: &NormalForm, x: &Mat<f64>) -> Result<Mat<f64>> {
    let NormalForm { a, b, s, .. } = normal;
    let bx = b.transpose() * x;
    match normal.equation {
        Equation::Continuous => Ok(bx + s.transpose()),
        // `(I + B'X B)^-1 B'X = B'X (I + B B'X)^-1`, whichever is smaller: the larger one would be nearly singular.
        Equation::Discrete if a.nrows() < b.ncols() => {
            let weight = eye(a.nrows()) + b * &bx;
            let rhs = normal.a_without_cross_term();
            let moved =
                solve_in_any_units("the matrix I + B B'X of a Riccati equation", weight.as_ref(), rhs.as_ref())?;
            Ok(bx * moved + s.transpose())
        }
        // By Cholesky's factor inputs of very different effect cost no digits.
        Equation::Discrete => {
            let weight = eye(b.ncols()) + &bx * b;
            let rhs = bx * a + s.transpose();
            match weight.llt(Side::Lower) {
                Ok(factor) => Ok(factor.solve(rhs)),
                Err(_) => solve("the matrix R + B'X B of a Riccati equation", weight.as_ref(), rhs.as_ref()),
            }
        }
    }
}

/// Left-hand side of the equation, written with the closed loop `Ac = A - B K`:
///
/// ```text
/// Ac'X + X Ac + W = 0      Ac'X Ac - X + W = 0      W = Q - S K - K'S' + K'K
/// ```
///
/// In this form (P. D. Joseph's) an error in K enters squared only, and no large terms cancel.
struct Residual {
    matrix: Mat<f64>,
    /// Its norm over the sum of the norms of the terms.
    relative: f64,
    /// Transposed closed loop.
    closed_loop: Mat<f64>,
}

impl Residual {
    fn of(normal: &NormalForm, x: &Mat<f64>) -> Result<Self> {
        let NormalForm { a, b, q, s, .. } = normal;
        let k = gain(normal, x)?;
        let closed_loop = (a - b * &k).transpose().to_owned();
        let cross = s * &k;
        let weight = q - &cross - cross.transpose() + k.transpose() * &k;
        let (first, second) = match normal.equation {
            Equation::Continuous => (&closed_loop * x, x * closed_loop.transpose()),
            Equation::Discrete => (&closed_loop * x * closed_loop.transpose(), -x),
        };
        let matrix = &first + &second + &weight;
        let size = first.norm_l2() + second.norm_l2() + weight.norm_l2();
        let relative = if size == 0.0 { 0.0 } else { matrix.norm_l2() / size };
        Ok(Residual { matrix: 0.5 * (&matrix + matrix.transpose()), relative, closed_loop })
    }
}

/// X after one Newton step; none where the closed loop does not determine it.
fn step(what: &str, normal: &NormalForm, x: &Mat<f64>, residual: &Residual) -> Option<Mat<f64>> {
    let schur = real_schur(what, residual.closed_loop.as_ref()).ok()?;
    let form = match normal.equation {
        Equation::Continuous => Form::Sum,
        Equation::Discrete => Form::Product,
    };
    let correction = solve_on_schur_forms(what, form, &schur, &schur, (-&residual.matrix).as_ref()).ok()?;
    let next = x + correction;
    Some(0.5 * (&next + next.transpose()))
}
