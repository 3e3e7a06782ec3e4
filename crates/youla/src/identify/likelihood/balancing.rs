//! States in which controllability and observability weigh alike: there, and only there, closeness of eigenvectors says that
//! poles are hard to tell apart.
//!
//! ```text
//! P = L_c L_c',  Q = L_o L_o',   L_o' L_c = U S V',   x = T z,   T = L_c V S^(-1/2),   T^-1 = S^(-1/2) U' L_o'
//! ```
//! Poles at or beyond the unit circle are drawn inside for the Gramians.

use crate::linalg::{discrete_gramian_factor, eigenvalues};
use faer::{Mat, MatRef};

/// Spectral radius for the Gramians.
const INSIDE: f64 = 0.9995;
/// Singular values below this share of the largest leave the states as they are.
const NEGLIGIBLE: f64 = 1e-11;

/// A, B and C in balanced states; as they were where a state is neither reached nor seen.
pub(crate) fn balanced(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> [Mat<f64>; 3] {
    let as_they_were = || [a.to_owned(), b.to_owned(), c.to_owned()];
    let Some((t, inverse)) = transformation(a, b, c) else { return as_they_were() };
    [&inverse * a * &t, &inverse * b, c * &t]
}

fn transformation(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> Option<(Mat<f64>, Mat<f64>)> {
    let radius = eigenvalues("A", a).ok()?.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let scale = if radius > INSIDE { INSIDE / radius } else { 1.0 };
    let inside = Mat::from_fn(a.nrows(), a.nrows(), |i, j| a[(i, j)] * scale);
    let reached = discrete_gramian_factor(inside.as_ref(), b).ok()?.l;
    let seen = discrete_gramian_factor(inside.transpose(), c.transpose()).ok()?.l;
    let svd = (seen.transpose() * &reached).svd().ok()?;
    let sigma: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    let (largest, smallest) = (sigma.first()?, sigma.last()?);
    let usable = *smallest > NEGLIGIBLE * largest;
    if !usable {
        return None;
    }
    let n = sigma.len();
    let (u, v) = (svd.U(), svd.V());
    let right = Mat::from_fn(n, n, |i, j| v[(i, j)] / sigma[j].sqrt());
    let left = Mat::from_fn(n, n, |i, j| u[(j, i)] / sigma[i].sqrt());
    Some((reached * right, left * seen.transpose()))
}
