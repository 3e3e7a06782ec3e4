//! The stabilising solution as an invariant subspace. With `G = B B'` and the cross term absorbed, `[I; X]` spans the stable
//! invariant subspace of the Hamiltonian matrix `[A -G; -Q -A']` in continuous time, and the stable deflating subspace of
//!
//! ```text
//! M - z N,    M = [A 0; -Q I],    N = [I G; 0 A']
//! ```
//!
//! in discrete time. With `z = c (1 + w) / (1 - w)`, c = +1 or -1, the pencil becomes the Hamiltonian matrix
//! `(M + c N)^-1 (M - c N)`, whose stable eigenvalues w are those with |z| < 1. It exists unless -c is itself an eigenvalue,
//! and a singular A (z = 0 and infinity, w = -c and c) is nothing special.

use super::normal_form::NormalForm;
use super::{Equation, equation_name};
use crate::error::Pole;
use crate::linalg::{block, eye, real_schur, solve_right};
use crate::{Error, Result};
use faer::prelude::*;
use faer::{Mat, c64};

/// Norm of a Cayley transform beyond which the other one is tried as well.
const LARGE_TRANSFORM: f64 = 1e4;

/// X from the ordered real Schur form of the Hamiltonian matrix, symmetrised.
pub(super) fn stabilising_solution(what: &str, normal: &NormalForm) -> Result<Mat<f64>> {
    let n = normal.a.nrows();
    let Hamiltonian { matrix, sign } = Hamiltonian::new(what, normal)?;
    let schur = real_schur(&format!("the Hamiltonian matrix of {what}"), matrix.as_ref())?;
    let eigenvalues = schur.eigenvalues();
    let ordered = schur.reorder(|w| w.re < 0.0)?;
    if ordered.dimension != n {
        return Err(on_boundary(what, normal.equation, sign, &eigenvalues));
    }
    let basis = ordered.q.as_ref().subcols(0, n);
    let (upper, lower) = basis.split_at_row(n);
    let x = solve_right(&format!("the basis of the stable subspace of {what}"), upper, lower)?;
    Ok(0.5 * (&x + x.transpose()))
}

/// A Hamiltonian matrix and the sign c of the Cayley transformation by which it came about.
struct Hamiltonian {
    matrix: Mat<f64>,
    sign: f64,
}

impl Hamiltonian {
    fn new(what: &str, normal: &NormalForm) -> Result<Self> {
        let a = normal.a_without_cross_term();
        let q = normal.q_without_cross_term();
        let g = &normal.b * normal.b.transpose();
        match normal.equation {
            Equation::Continuous => {
                let matrix = block(&[&[a.as_ref(), (-&g).as_ref()], &[(-&q).as_ref(), (-a.transpose()).as_ref()]]);
                Ok(Hamiltonian { matrix, sign: 1.0 })
            }
            Equation::Discrete => Self::from_pencil(what, &a, &g, &q),
        }
    }

    /// The better conditioned of the two Cayley transforms.
    fn from_pencil(what: &str, a: &Mat<f64>, g: &Mat<f64>, q: &Mat<f64>) -> Result<Self> {
        let first = cayley(a, g, q, 1.0);
        if first.norm_max() < LARGE_TRANSFORM {
            return Ok(Hamiltonian { matrix: first, sign: 1.0 });
        }
        let second = cayley(a, g, q, -1.0);
        let (first_size, second_size) = (size(&first), size(&second));
        let (matrix, sign) = if first_size <= second_size { (first, 1.0) } else { (second, -1.0) };
        if first_size.min(second_size).is_finite() {
            return Ok(Hamiltonian { matrix, sign });
        }
        let condition = "the symplectic pencil has eigenvalues at both 1 and -1".to_owned();
        Err(Error::NoSolution { what: equation_name(what), condition, residual: f64::NAN })
    }
}

/// Largest entry, infinite where an entry is not finite.
fn size(m: &Mat<f64>) -> f64 {
    if m.is_all_finite() { m.norm_max() } else { f64::INFINITY }
}

/// `(M + c N)^-1 (M - c N)`.
fn cayley(a: &Mat<f64>, g: &Mat<f64>, q: &Mat<f64>, sign: f64) -> Mat<f64> {
    let n = a.nrows();
    let (one, zero) = (eye(n), Mat::zeros(n, n));
    let m = block(&[&[a.as_ref(), zero.as_ref()], &[(-q).as_ref(), one.as_ref()]]);
    let n = block(&[&[one.as_ref(), g.as_ref()], &[zero.as_ref(), a.transpose()]]);
    (&m + sign * &n).partial_piv_lu().solve(&m - sign * &n)
}

/// The refusal that names the eigenvalue nearest to the stability boundary.
fn on_boundary(what: &str, equation: Equation, sign: f64, eigenvalues: &[c64]) -> Error {
    let nearest = eigenvalues.iter().copied().min_by(|v, w| v.re.abs().total_cmp(&w.re.abs()));
    let condition = match nearest {
        Some(w) => {
            let pole = match equation {
                Equation::Continuous => w,
                Equation::Discrete => sign * (c64::ONE + w) / (c64::ONE - w),
            };
            format!("its Hamiltonian matrix has the eigenvalue {} on the stability boundary", Pole(pole))
        }
        None => "its Hamiltonian matrix is empty".to_owned(),
    };
    Error::NoSolution { what: equation_name(what), condition, residual: f64::NAN }
}
