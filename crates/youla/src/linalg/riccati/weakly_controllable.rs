//! Coordinates for a Riccati equation in which every mode that needs feedback is equally within reach of the input.
//!
//! A mode that is unstable, or nearly so, and almost out of reach (a reach of r) makes X as large as 1 / r^2 in one direction, and no
//! scaling of the states helps where that direction is not an axis. An ordered Schur form splits the states: with
//! `A = Q [A1 A12; 0 A2] Q'`, where A2 holds the modes that need feedback and `Q'B = [B1; B2]`, the Gramian
//!
//! ```text
//! continuous:  A2 W + W A2' = B2 B2'      discrete:  A2 W A2' - W = B2 B2'
//! ```
//!
//! is the inverse of the least energy that brings such a state to rest, which is X where the weight is zero. With its factor
//! `W = V S^2 V'`, taken without W (S. J. Hammarling, see `gramian.rs`), the states `S^-1 V' x2` have a least energy of I.
//! A2 is moved away from the stability boundary for W alone: only coordinates come of it.

use super::Equation;
use super::normal_form::NormalForm;
use crate::Result;
use crate::linalg::{
    OrderedSchur, block, block_diagonal, discrete_gramian_factor, eye, gramian_factor, real_schur, solve,
};
use faer::prelude::*;
use faer::{Mat, MatRef};

/// Distance to the stability boundary, relative to A, within which a stable mode counts as one that needs feedback.
const BESIDE_BOUNDARY: f64 = 1e-3;

/// Ratio of the singular values of the factor of W from which on the coordinates are worth it.
const WITHIN_REACH: f64 = 1e-2;

/// Least singular value of the factor of W that is told from zero, relative to the largest.
const OUT_OF_REACH: f64 = 1e-15;

/// A problem in such coordinates.
pub(super) struct WithinReach {
    pub(super) normal: NormalForm,
    /// T of `x = T z`, n x n.
    expansion: Mat<f64>,
    /// Its inverse.
    contraction: Mat<f64>,
}

impl WithinReach {
    /// None where all modes are well damped or within reach as they are.
    pub(super) fn new(what: &str, normal: &NormalForm) -> Result<Option<Self>> {
        let damped = -BESIDE_BOUNDARY * normal.size();
        let schur = real_schur(&format!("the state matrix of {what}"), normal.a_without_cross_term().as_ref())?;
        let OrderedSchur { q: basis, t, dimension: k, .. } =
            schur.reorder(|p| normal.equation.instability(p) < damped)?;
        let weak = basis.nrows() - k;
        if weak == 0 {
            return Ok(None);
        }
        let (a1, a12, _, a2) = t.as_ref().split_at(k, k);
        let b = basis.transpose() * &normal.b;
        let (b1, b2) = b.as_ref().split_at_row(k);
        let factor = reach(normal.equation, -damped, a2, b2)?;
        let Ok(svd) = factor.thin_svd() else { return Ok(None) };
        let singular = svd.S().column_vector();
        if singular[weak - 1] >= WITHIN_REACH * singular[0] {
            return Ok(None);
        }
        let size = |i: usize| singular[i].max(OUT_OF_REACH * singular[0]);
        let up = Mat::from_fn(weak, weak, |i, j| svd.U()[(i, j)] * size(j));
        let down = Mat::from_fn(weak, weak, |i, j| svd.U()[(j, i)] / size(i));
        let (one, zero) = (eye(k), Mat::zeros(weak, k));
        let a = block(&[&[a1, (a12 * &up).as_ref()], &[zero.as_ref(), (&down * a2 * &up).as_ref()]]);
        let b = block(&[&[b1], &[(&down * b2).as_ref()]]);
        let expansion = &basis * block_diagonal(one.as_ref(), up.as_ref());
        let contraction = block_diagonal(one.as_ref(), down.as_ref()) * basis.transpose();
        let q = expansion.transpose() * normal.q_without_cross_term() * &expansion;
        Ok(Some(WithinReach { normal: NormalForm::within(normal.equation, a, b, q), expansion, contraction }))
    }

    /// X in the coordinates of `normal`.
    pub(super) fn solution(&self, x: &Mat<f64>) -> Mat<f64> {
        let x = self.contraction.transpose() * self.normal.original_solution(x) * &self.contraction;
        0.5 * (&x + x.transpose())
    }

    /// K in the coordinates of `normal`, its cross term included.
    pub(super) fn gain(&self, gain: &Mat<f64>, normal: &NormalForm) -> Mat<f64> {
        self.normal.original_gain(gain) * &self.contraction + normal.s.transpose()
    }

    /// Bound on what the rounding of `A - B K` in the coordinates of `normal` is in these:
    ///
    /// ```text
    /// eps |T^-1| (|A| + |B| |K|) |T|      Frobenius norms
    /// ```
    pub(super) fn rounding(&self, gain: &Mat<f64>, normal: &NormalForm) -> f64 {
        let [there, back] = [&self.expansion, &self.contraction].map(|m| m.norm_l2());
        f64::EPSILON * back * (normal.a.norm_l2() + normal.b.norm_l2() * gain.norm_l2()) * there
    }
}

/// A factor of W for A2 moved by `distance` to the unstable side, twice as far as its modes may lie on the stable one.
fn reach(equation: Equation, distance: f64, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let n = a.nrows();
    let moved = 2.0 * distance;
    Ok(match equation {
        Equation::Continuous => {
            let backwards = Mat::from_fn(n, n, |i, j| -a[(i, j)] - if i == j { moved } else { 0.0 });
            gramian_factor(backwards.as_ref(), b)?
        }
        Equation::Discrete => {
            let both = solve("the modes that need feedback", a, block(&[&[eye(n).as_ref(), b]]).as_ref())?;
            let (backwards, b) = both.as_ref().split_at_col(n);
            discrete_gramian_factor((Scale(1.0 - moved.min(0.5)) * backwards).as_ref(), b)?
        }
    })
}
