//! The stabilising solution by doubling: with `A0 = A, G0 = B B', H0 = Q` of a discrete equation (of a continuous one after the
//! Cayley transformation that maps its Hamiltonian matrix to a symplectic pencil)
//!
//! ```text
//! W = I + G H,   A <- A W^-1 A,   G <- G + A W^-1 G A',   H <- H + A' H W^-1 A
//! ```
//!
//! H converges quadratically to X where no eigenvalue lies on the stability boundary (E. K.-W. Chu, H.-Y. Fan and W.-W. Lin,
//! A structure-preserving doubling algorithm for continuous-time algebraic Riccati equations, Linear Algebra Appl. 396 (2005),
//! 55; and Int. J. Control 77 (2004), 767). Matrix products and LU factors of order n take the place of a Schur form of order
//! 2 n, which pays for large n.

use super::Equation;
use super::normal_form::NormalForm;
use crate::linalg::eye;
use faer::Mat;
use faer::prelude::*;

/// Most doublings; a mode at a distance of 1e-6 to the boundary takes 25.
const MOST_STEPS: usize = 40;

/// X, where the iteration converges; the caller judges it by its residual.
pub(super) fn stabilising_solution(normal: &NormalForm) -> Option<Mat<f64>> {
    let mut pencil = Pencil::new(normal)?;
    for _ in 0..MOST_STEPS {
        let change = pencil.double()?;
        if change <= f64::EPSILON {
            return Some(pencil.h);
        }
    }
    None
}

/// The symplectic pencil `[A 0; -H I] - z [I G; 0 A']`.
struct Pencil {
    a: Mat<f64>,
    g: Mat<f64>,
    h: Mat<f64>,
}

impl Pencil {
    fn new(normal: &NormalForm) -> Option<Self> {
        let a = normal.a_without_cross_term();
        let h = normal.q_without_cross_term();
        let g = &normal.b * normal.b.transpose();
        match normal.equation {
            Equation::Discrete => Some(Pencil { a, g, h }),
            Equation::Continuous => Self::of_hamiltonian(&a, &g, &h),
        }
    }

    /// With `Ac = A - c I` and `W = Ac' + H Ac^-1 G`, c > 0 of the size of A:
    ///
    /// ```text
    /// A <- I + 2 c W'^-1,   G <- 2 c Ac^-1 G W^-1,   H <- 2 c W^-1 H Ac^-1
    /// ```
    fn of_hamiltonian(a: &Mat<f64>, g: &Mat<f64>, h: &Mat<f64>) -> Option<Self> {
        let n = a.nrows();
        let c = a.norm_l2().max((g.norm_l2() * h.norm_l2()).sqrt()) / (n as f64).sqrt();
        let shifted = (a - Scale(c) * eye(n)).partial_piv_lu();
        let left_g = shifted.solve(g);
        let w = (a.transpose() - Scale(c) * eye(n) + h * &left_g).partial_piv_lu();
        let right_h = shifted.solve_transpose(h).transpose().to_owned();
        let inverse = w.solve(eye(n));
        let pencil = Pencil {
            a: eye(n) + Scale(2.0 * c) * inverse.transpose(),
            g: symmetric(Scale(2.0 * c) * (left_g * &inverse)),
            h: symmetric(Scale(2.0 * c) * (inverse * right_h)),
        };
        pencil.is_finite().then_some(pencil)
    }

    /// One doubling; returns the relative change of H.
    fn double(&mut self) -> Option<f64> {
        let n = self.a.nrows();
        let w = (eye(n) + &self.g * &self.h).partial_piv_lu();
        let (wa, wg) = (w.solve(&self.a), w.solve(&self.g));
        let step = self.a.transpose() * (&self.h * &wa);
        let change = step.norm_l2() / (&self.h + &step).norm_l2();
        self.g = symmetric(&self.g + &self.a * wg * self.a.transpose());
        self.h = symmetric(&self.h + step);
        self.a = &self.a * wa;
        self.is_finite().then_some(if change.is_nan() { 0.0 } else { change })
    }

    fn is_finite(&self) -> bool {
        self.a.is_all_finite() && self.g.is_all_finite() && self.h.is_all_finite()
    }
}

fn symmetric(m: Mat<f64>) -> Mat<f64> {
    0.5 * (&m + m.transpose())
}
