//! An orthonormal basis that grows column by column.

use faer::{Col, Scale};

/// Orthonormal columns, by the Gram-Schmidt process applied twice to each, which keeps them orthogonal to rounding (L. Giraud and others, Numerische
/// Mathematik 101 (2005), 87).
#[derive(Default)]
pub(crate) struct Orthonormal(Vec<Col<f64>>);

impl Orthonormal {
    /// Adds the direction of a column beyond those before it where that part is longer than `least`, and says whether it is.
    pub(crate) fn add(&mut self, mut column: Col<f64>, least: f64) -> bool {
        for v in self.0.iter().chain(&self.0) {
            let along = v.transpose() * &column;
            column -= Scale(along) * v;
        }
        let beyond = column.norm_l2();
        let new = beyond > least;
        if new {
            self.0.push(Scale(1.0 / beyond) * column);
        }
        new
    }

    /// The columns, in the order in which they were added.
    pub(crate) fn columns(&self) -> &[Col<f64>] {
        &self.0
    }
}
