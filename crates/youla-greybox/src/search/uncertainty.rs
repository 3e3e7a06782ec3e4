//! Covariance of the estimate for white output noise.
//!
//! ```text
//! cov theta = sigma^2 (J' J)^-1 = sigma^2 R^-1 R^-T,     sigma^2 = 2 V / (N p - unknowns)
//! ```
//! the inverse of the Fisher information (L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, section
//! 9.4), where the noise is white, Gaussian, and of the stated ratio between the outputs.

use crate::prediction::linearisation::Linearisation;
use crate::search::identifiability::{RANK_TOLERANCE, Undetermined};
use faer::{Mat, MatRef};

/// A parameter whose change by its own size moves the outputs by less than this share of themselves has no effect.
const NO_EFFECT: f64 = 1e-10;

/// How well the parameters are determined.
pub(crate) struct Information {
    /// Rank of the Jacobian with columns of unit length.
    pub(crate) rank: usize,
    /// Its reciprocal condition number.
    pub(crate) rcond: f64,
    /// `(J' J)^-1`, `None` where J lacks rank.
    pub(crate) inverse: Option<Mat<f64>>,
    /// J with columns of unit length; zero where a parameter has no effect.
    unit: Mat<f64>,
    lengths: Vec<f64>,
}

impl Information {
    /// `sizes` of the parameters, `outputs` the length of the scaled outputs.
    pub(crate) fn new(here: &Linearisation, sizes: &[f64], outputs: f64) -> Self {
        let (jacobian, q) = (here.jacobian(), here.parameters());
        let lengths: Vec<f64> = jacobian.col_iter().map(|column| column.norm_l2()).collect();
        let effect = |j: usize| lengths[j] > 0.0 && lengths[j] * sizes[j] >= NO_EFFECT * outputs;
        let entry = |i: usize, j: usize| if effect(j) { jacobian[(i, j)] / lengths[j] } else { 0.0 };
        let unit = Mat::from_fn(jacobian.nrows(), q, entry);
        let sigma = unit.singular_values().unwrap_or_default();
        let largest = sigma.first().copied().unwrap_or(0.0);
        let rank = sigma.iter().filter(|s| **s > RANK_TOLERANCE * largest).count();
        let rcond = match q {
            0 => 1.0,
            _ if q > sigma.len() || largest == 0.0 => 0.0,
            _ => sigma[q - 1] / largest,
        };
        let inverse = (rank == q).then(|| inverse_gram(unit.as_ref(), &lengths));
        Information { rank, rcond, inverse, unit, lengths }
    }

    /// What is not determined, by name.
    pub(crate) fn undetermined(&self, names: &[String], sizes: &[f64]) -> Undetermined {
        let changes: Vec<f64> = self.lengths.iter().zip(sizes).map(|(length, size)| 1.0 / (length * size)).collect();
        if self.rank == names.len() {
            Undetermined::default()
        } else {
            Undetermined::new(self.unit.as_ref(), names, &changes)
        }
    }
}

/// A matrix over some of `count` parameters as one over all, with zeros for the others.
pub(crate) fn spread(matrix: MatRef<'_, f64>, parameters: &[usize], count: usize) -> Mat<f64> {
    let mut whole = Mat::zeros(count, count);
    for (i, row) in parameters.iter().enumerate() {
        parameters.iter().enumerate().for_each(|(j, column)| whole[(*row, *column)] = matrix[(i, j)]);
    }
    whole
}

/// `(J' J)^-1` from the triangular J of full rank with columns of unit length.
fn inverse_gram(unit: MatRef<'_, f64>, lengths: &[f64]) -> Mat<f64> {
    let q = lengths.len();
    let mut root = Mat::<f64>::identity(q, q);
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(unit.subrows(0, q), root.as_mut(), faer::Par::Seq);
    let gram = &root * root.transpose();
    Mat::from_fn(q, q, |i, j| gram[(i, j)] / lengths[i] / lengths[j])
}
