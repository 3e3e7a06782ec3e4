//! The linearised criterion.

use youla::linalg::{SequentialQr, leading_rank};
use youla::{Mat, MatRef};

/// The linearised criterion `1/2 |r - J step|^2` as the triangular factor of `[J r]`.
#[derive(Clone)]
pub(crate) struct Linearisation {
    factor: Mat<f64>,
}

impl Linearisation {
    pub(crate) fn new(factor: Mat<f64>) -> Self {
        Linearisation { factor }
    }

    /// Rows of the factor that belong to the Jacobian J, q columns, triangular.
    pub(crate) fn jacobian(&self) -> MatRef<'_, f64> {
        self.factor.as_ref().subcols(0, self.parameters())
    }

    /// The residual r in the same rows.
    pub(crate) fn residual(&self) -> MatRef<'_, f64> {
        self.factor.as_ref().subcols(self.parameters(), 1)
    }

    pub(crate) fn parameters(&self) -> usize {
        self.factor.ncols() - 1
    }

    /// The same where only these parameters move.
    pub(crate) fn along(&self, parameters: &[usize]) -> Linearisation {
        let (rows, count) = (self.factor.nrows(), parameters.len());
        if count == self.parameters() {
            return self.clone();
        }
        let column = |j: usize| parameters.get(j).copied().unwrap_or(self.parameters());
        let mut whole = SequentialQr::new(count + 1, rows);
        whole.fold_rows(Mat::from_fn(rows, count + 1, |i, j| self.factor[(i, column(j))]).as_ref());
        Linearisation { factor: whole.r().to_owned() }
    }

    /// Length of the part of r that J can remove, over the length of the rest, each by its degrees of freedom: the
    /// distance to the minimum in units of the radius of the confidence region.
    pub(crate) fn relative_offset(&self, degrees_of_freedom: usize) -> f64 {
        let rank = leading_rank(self.factor.as_ref(), self.parameters());
        let (removable, rest) = self.residual().split_at_row(rank);
        let per_freedom = |r: MatRef<'_, f64>, freedom: usize| r.norm_l2() / (freedom.max(1) as f64).sqrt();
        let (offset, radius) = (per_freedom(removable, rank), per_freedom(rest, degrees_of_freedom));
        if offset == 0.0 { 0.0 } else { offset / radius }
    }
}
