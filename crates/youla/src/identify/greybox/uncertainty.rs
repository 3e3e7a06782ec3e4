//! Covariance of the estimate for white output noise.
//!
//! ```text
//! cov theta = sigma^2 (J' J)^-1 = sigma^2 R^-1 R^-T,     sigma^2 = 2 V / (N p - unknowns)
//! ```
//! the inverse of the Fisher information (L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, section
//! 9.4), where the noise is white, Gaussian, and of the stated ratio between the outputs.

use super::criterion::Linearisation;
use faer::{Mat, MatRef};

/// Directions in which the scaled Jacobian is shorter than this share of its longest one are not determined.
const RANK_TOLERANCE: f64 = 1e-10;

/// How well the parameters are determined.
pub(super) struct Information {
    /// Rank of the Jacobian with columns of unit length.
    pub(super) rank: usize,
    /// Its reciprocal condition number.
    pub(super) rcond: f64,
    /// `(J' J)^-1`, `None` where J lacks rank.
    pub(super) inverse: Option<Mat<f64>>,
}

impl Information {
    pub(super) fn new(here: &Linearisation) -> Self {
        let (jacobian, q) = (here.jacobian(), here.parameters());
        let lengths: Vec<f64> = jacobian.col_iter().map(|column| column.norm_l2()).collect();
        let unit =
            Mat::from_fn(
                jacobian.nrows(),
                q,
                |i, j| {
                    if lengths[j] > 0.0 { jacobian[(i, j)] / lengths[j] } else { 0.0 }
                },
            );
        let sigma = unit.singular_values().unwrap_or_default();
        let largest = sigma.first().copied().unwrap_or(0.0);
        let rank = sigma.iter().filter(|s| **s > RANK_TOLERANCE * largest).count();
        let rcond = if q > sigma.len() || largest == 0.0 { 0.0 } else { sigma[q - 1] / largest };
        let inverse = (rank == q).then(|| inverse_gram(unit.as_ref(), &lengths));
        Information { rank, rcond, inverse }
    }
}

/// `(J' J)^-1` from the triangular J of full rank with columns of unit length.
fn inverse_gram(unit: MatRef<'_, f64>, lengths: &[f64]) -> Mat<f64> {
    let q = lengths.len();
    let mut root = Mat::<f64>::identity(q, q);
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(unit.subrows(0, q), root.as_mut(), faer::Par::Seq);
    let gram = &root * root.transpose();
    Mat::from_fn(q, q, |i, j| gram[(i, j)] / lengths[i] / lengths[j])
}
