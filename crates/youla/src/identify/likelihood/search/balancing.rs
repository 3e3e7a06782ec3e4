//! States in which controllability and observability weigh alike: there, and only there, closeness of eigenvectors says that
//! poles are hard to distinguish. Poles at or beyond the unit circle are drawn inside for the Gramians.

use crate::linalg::{eigenvalues, gramian_balancing};
use faer::{Mat, MatRef};

/// Spectral radius for the Gramians.
const INSIDE: f64 = 0.9995;
/// Singular values below this share of the largest leave the states as they are.
const NEGLIGIBLE: f64 = 1e-11;

/// A, B and C in balanced states; as they were where a state is neither reached nor seen.
pub(crate) fn balanced(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> [Mat<f64>; 3] {
    match transformation(a, b, c) {
        Some([t, inverse]) => [&inverse * a * &t, &inverse * b, c * &t],
        None => [a.to_owned(), b.to_owned(), c.to_owned()],
    }
}

fn transformation(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> Option<[Mat<f64>; 2]> {
    let radius = eigenvalues("A", a).ok()?.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let scale = if radius > INSIDE { INSIDE / radius } else { 1.0 };
    let inside = Mat::from_fn(a.nrows(), a.nrows(), |i, j| a[(i, j)] * scale);
    gramian_balancing([inside.as_ref(), b, c], NEGLIGIBLE)
}
