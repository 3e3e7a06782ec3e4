//! Feedback that gives one block of one or two states the wanted poles.
//!
//! In the coordinates of the singular vectors of `B = U diag(b1, b2) W'` the closed block X is chosen freely in the rows
//! with `b_i > 0`, where a change of row i costs `(change / b_i)^2`. The diagonal takes the smallest change that gives the sum of
//! the poles, the other two entries the smallest that then gives their product: the choice of the reference implementation
//! (SLICOT, `reference`). The stationary points for the multiplier mu of the product follow from linear equations; the minimum has
//! `|mu| <= 1 / (b1 b2)`, where the determinant rises with mu, so that bisection finds it.

use super::BlockFeedback;
use crate::linalg::eye;
use crate::lti::TimeDomain;
use crate::{Error, Result};
use faer::{Mat, Scale, c64};

/// Singular values of B below this part of the largest count as zero.
const RANK: f64 = 1e-12;

/// Feedback that puts the pole, or the pair that it belongs to, onto the boundary `degree`: a real part (the imaginary part
/// is kept) or a modulus (the angle is kept).
pub(super) fn feedback<T: TimeDomain>(
    time: T,
    a: &Mat<f64>,
    b: &Mat<f64>,
    pole: c64,
    degree: f64,
) -> Result<BlockFeedback> {
    let wanted = match time.sample_time() {
        None => c64::new(degree, pole.im),
        Some(_) => c64::new(degree * pole.re / pole.norm(), degree * pole.im / pole.norm()),
    };
    let f = match a.nrows() {
        1 => Scale((wanted.re - a[(0, 0)]) / b.squared_norm_l2()) * b.transpose(),
        _ => pair(a, b, 2.0 * wanted.re, wanted.norm_sqr(), pole)?,
    };
    Ok(BlockFeedback { f, v: eye(b.ncols()) })
}

/// The same for two states with the sum s and the product p of the wanted poles.
fn pair(a: &Mat<f64>, b: &Mat<f64>, s: f64, p: f64, pole: c64) -> Result<Mat<f64>> {
    let svd =
        b.thin_svd().map_err(|_| Error::NoConvergence { what: "the singular values of B".into(), iterations: 0 })?;
    // A single input has one singular direction; the other is orthogonal to it.
    let first = svd.U().col(0);
    let u = Mat::from_fn(2, 2, |i, j| if j == 0 { first[i] } else { [-first[1], first[0]][i] });
    let a = u.transpose() * a * &u;
    let b = u.transpose() * b;
    let size = |row: usize| b.row(row).norm_l2();
    let (b1, b2) = (size(0), size(1));
    let x = if b2 > RANK * b1 {
        two_directions(&a, [b1, b2], s, p)
    } else {
        one_direction(&a, s, p).ok_or_else(|| Error::NotStabilisable {
            what: "the coprime factorisation".into(),
            pole,
            distance: a[(1, 0)].abs().min(b1),
        })?
    };
    // Rows of U'B are orthogonal: F = sum over i of b_i' (X - A)_i / |b_i|^2.
    let scale = [b1, b2].map(|size| if size > RANK * b1 { size.powi(-2) } else { 0.0 });
    let rows = Mat::from_fn(2, 2, |i, j| scale[i] * (x[i][j] - a[(i, j)]));
    Ok(b.transpose() * rows * u.transpose())
}

/// The closed block where only the first row can be chosen.
fn one_direction(a: &Mat<f64>, s: f64, p: f64) -> Option<[[f64; 2]; 2]> {
    let (x21, x22) = (a[(1, 0)], a[(1, 1)]);
    let x11 = s - x22;
    (x21.abs() > RANK * a.norm_l2()).then(|| [[x11, (x11 * x22 - p) / x21], [x21, x22]])
}

/// The closed block where both rows can be chosen.
fn two_directions(a: &Mat<f64>, b: [f64; 2], s: f64, p: f64) -> [[f64; 2]; 2] {
    let limit = 1.0 / (b[0] * b[1]);
    let excess = |mu: f64| determinant(&stationary(a, b, s, mu)) - p;
    let (mut low, mut high) = (-limit * (1.0 - 1e-13), limit * (1.0 - 1e-13));
    if excess(low) > 0.0 || excess(high) < 0.0 {
        let end = if excess(low) > 0.0 { low } else { high };
        return along_null_direction(stationary(a, b, s, end), b, end, p);
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    stationary(a, b, s, 0.5 * (low + high))
}

fn determinant(x: &[[f64; 2]; 2]) -> f64 {
    x[0][0] * x[1][1] - x[0][1] * x[1][0]
}

/// The stationary point of the cost for a multiplier of the determinant, with the trace s.
fn stationary(a: &Mat<f64>, b: [f64; 2], s: f64, mu: f64) -> [[f64; 2]; 2] {
    let [q1, q2] = b.map(|b| b * b);
    let x11 = a[(0, 0)] + q1 / (q1 + q2) * (s - a[(0, 0)] - a[(1, 1)]);
    let rest = (1.0 - mu * b[0] * b[1]) * (1.0 + mu * b[0] * b[1]);
    let x12 = (a[(0, 1)] - mu * q1 * a[(1, 0)]) / rest;
    let x21 = (a[(1, 0)] - mu * q2 * a[(0, 1)]) / rest;
    [[x11, x12], [x21, s - x11]]
}

/// At the end of the range of mu the entries beside the diagonal may still move along `(b1, -+b2)` without changing the cost of
/// first order; there the determinant is met by the smaller of the two steps.
fn along_null_direction(mut x: [[f64; 2]; 2], b: [f64; 2], mu: f64, p: f64) -> [[f64; 2]; 2] {
    let sign = -mu.signum();
    // det(t) = det - t (sign b2 x12 + b1 x21) - sign b1 b2 t^2
    let (square, linear) = (-sign * b[0] * b[1], -(sign * b[1] * x[0][1] + b[0] * x[1][0]));
    let constant = determinant(&x) - p;
    let root = (linear * linear - 4.0 * square * constant).max(0.0).sqrt();
    let step = -2.0 * constant / (linear + root.copysign(if linear == 0.0 { 1.0 } else { linear }));
    let step = if step.is_finite() { step } else { 0.0 };
    x[0][1] += step * b[0];
    x[1][0] += step * sign * b[1];
    x
}
