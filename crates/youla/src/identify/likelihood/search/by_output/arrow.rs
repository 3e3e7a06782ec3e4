//! The triangular factor of normal equations that are an arrow.

use super::{Columns, Normal};
use crate::linalg::TINY;
use faer::{Mat, Par, Side};

/// Ridge relative to the squared length of a column: rounding.
pub(super) const RIDGES: [f64; 3] = [1e-13, 1e-10, 1e-6];

/// Triangular rows: per output `[R_own R_shared r]`, then `[R r]` of the shared columns.
pub(crate) struct Arrow {
    pub(crate) own: Vec<Mat<f64>>,
    pub(crate) shared: Mat<f64>,
    /// Squared lengths of the shared columns.
    pub(super) lengths: Vec<f64>,
    /// Own columns that are no parameters.
    pub(crate) nuisance: usize,
}

impl Arrow {
    /// Own and shared values.
    pub(super) fn solved(&self) -> (Vec<Vec<f64>>, Vec<f64>) {
        let shared = back(&self.shared, &[]);
        (self.own.iter().map(|rows| back(rows, &shared)).collect(), shared)
    }

    /// `|r|^2` of the parameters.
    pub(crate) fn explained(&self) -> f64 {
        let last = |m: &Mat<f64>| m.col(m.ncols() - 1).squared_norm_l2();
        self.own.iter().map(last).sum::<f64>() + last(&self.shared)
    }

    /// The values that solve the equations, by places.
    pub(crate) fn parameters(&self, normal: &Normal) -> Vec<f64> {
        let (by_output, shared) = self.solved();
        let mut out = vec![0.0; normal.parameters()];
        let Columns { plant, own, .. } = &normal.columns;
        plant.iter().zip(&shared).for_each(|(entry, value)| out[entry.place] = *value);
        for (places, of) in own.iter().zip(&by_output) {
            places.iter().zip(&of[self.nuisance..]).for_each(|(place, value)| out[*place] = *value);
        }
        out
    }
}

/// Solves `[R T r]` for the leading values, those of T known.
fn back(rows: &Mat<f64>, known: &[f64]) -> Vec<f64> {
    let (n, last) = (rows.nrows(), rows.ncols() - 1);
    let mut out = vec![0.0; n];
    for i in (0..n).rev() {
        let mut value = rows[(i, last)];
        known.iter().enumerate().for_each(|(j, s)| value -= rows[(i, n + j)] * s);
        (i + 1..n).for_each(|j| value -= rows[(i, j)] * out[j]);
        out[i] = value / rows[(i, i)];
    }
    out
}

/// Inverse of an upper triangle.
pub(crate) fn inverse(r: &Mat<f64>) -> Mat<f64> {
    let mut out = Mat::<f64>::identity(r.nrows(), r.nrows());
    faer::linalg::triangular_solve::solve_upper_triangular_in_place(r.as_ref(), out.as_mut(), Par::Seq);
    out
}

pub(super) fn symmetric(lower: &Mat<f64>) -> Mat<f64> {
    Mat::from_fn(lower.nrows(), lower.ncols(), |i, j| lower[(i.max(j), i.min(j))])
}

/// The rows of the triangular factor of the first `count` columns of symmetric normal equations, columns brought to unit length first.
pub(super) fn eliminated(gram: &mut Mat<f64>, count: usize, ridge: f64) -> Mat<f64> {
    let lengths: Vec<f64> = (0..count).map(|i| gram[(i, i)].max(TINY).sqrt()).collect();
    for ridge in RIDGES.into_iter().filter(|r| *r >= ridge) {
        let unit = Mat::from_fn(count, count, |i, j| {
            gram[(i, j)] / (lengths[i] * lengths[j]) + if i == j { ridge } else { 0.0 }
        });
        let Ok(factor) = unit.llt(Side::Lower) else { continue };
        let mut rows = Mat::from_fn(count, gram.ncols(), |i, j| gram[(i, j)] / lengths[i]);
        faer::linalg::triangular_solve::solve_lower_triangular_in_place(factor.L(), rows.as_mut(), Par::Seq);
        for j in 0..count {
            (0..count).for_each(|i| rows[(i, j)] = if i <= j { factor.L()[(j, i)] * lengths[j] } else { 0.0 });
        }
        return rows;
    }
    // Nothing is determined: unit rows that move nothing.
    Mat::from_fn(count, gram.ncols(), |i, j| if i == j { lengths[i] } else { 0.0 })
}
