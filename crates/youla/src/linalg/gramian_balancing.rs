//! States in which the Gramians of reachability and of observability are equal and diagonal:
//!
//! ```text
//! P = L_c L_c',  Q = L_o L_o',   L_o' L_c = U S V',   x = T z,   T = L_c V S^(-1/2),   T^-1 = S^(-1/2) U' L_o'
//! ```
//! (A. J. Laub, M. T. Heath, C. C. Paige and R. C. Ward, IEEE Trans. Automatic Control 32 (1987), 115).

use crate::linalg::discrete_gramian_factor;
use faer::{Mat, MatRef};

/// T and its inverse, n x n, that balance a stable system of discrete time: A (n x n), B (n x m), C (p x n).
///
/// `None` unless A is stable and the smallest Hankel singular value is above `negligible` times the largest: a state that is neither
/// reached nor seen has no balanced coordinate.
pub(crate) fn gramian_balancing([a, b, c]: [MatRef<'_, f64>; 3], negligible: f64) -> Option<[Mat<f64>; 2]> {
    let reached = discrete_gramian_factor(a, b).ok()?;
    let seen = discrete_gramian_factor(a.transpose(), c.transpose()).ok()?;
    let svd = (seen.transpose() * &reached).svd().ok()?;
    let sigma: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    let (largest, smallest) = (sigma.first()?, sigma.last()?);
    // Written so that values that are not numbers are refused too.
    let usable = *smallest > negligible * largest;
    if !usable {
        return None;
    }
    let n = sigma.len();
    let (u, v) = (svd.U(), svd.V());
    let right = Mat::from_fn(n, n, |i, j| v[(i, j)] / sigma[j].sqrt());
    let left = Mat::from_fn(n, n, |i, j| u[(j, i)] / sigma[i].sqrt());
    Some([reached * right, left * seen.transpose()])
}
