//! Matrices of a linear system by rows, as they are written to JSON.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::lti::{Discrete, StateSpace, TimeDomain};
use youla::{Mat, MatRef};

/// A matrix by rows.
pub type Rows = Vec<Vec<f64>>;

/// Matrices of one linear system `x+ = A x + B v, w = C x + D v`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SystemMatrices {
    /// A, n x n.
    pub a: Rows,
    /// B, n x m.
    pub b: Rows,
    /// C, p x n.
    pub c: Rows,
    /// D, p x m.
    pub d: Rows,
}

impl SystemMatrices {
    /// The matrices of a system.
    pub fn new<T: TimeDomain>(system: &StateSpace<T>) -> Self {
        SystemMatrices { a: rows(system.a()), b: rows(system.b()), c: rows(system.c()), d: rows(system.d()) }
    }

    /// Number of inputs m, also where B has no rows.
    pub(crate) fn inputs(&self) -> usize {
        self.d.first().map_or(0, Vec::len)
    }

    /// The system with these matrices.
    ///
    /// # Errors
    /// [`youla::Error::Shape`] and [`youla::Error::NotFinite`] for matrices that do not fit together.
    pub fn system(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        let (n, m) = (self.a.len(), self.inputs());
        let nothing = |rows: &Rows| rows.iter().all(Vec::is_empty);
        if [&self.a, &self.b, &self.c].into_iter().all(nothing) {
            return Ok(StateSpace::gain(matrix("D", &self.d, m)?, time)?);
        }
        let (a, b) = (matrix("A", &self.a, n)?, matrix("B", &self.b, m)?);
        let (c, d) = (matrix("C", &self.c, n)?, matrix("D", &self.d, m)?);
        Ok(StateSpace::new(a, b, c, d, time)?)
    }
}

/// A matrix by rows.
pub(crate) fn rows(m: MatRef<'_, f64>) -> Rows {
    (0..m.nrows()).map(|i| m.row(i).iter().copied().collect()).collect()
}

pub(crate) fn matrix(what: &str, rows: &Rows, columns: usize) -> Result<Mat<f64>> {
    match rows.iter().position(|row| row.len() != columns) {
        Some(bad) => Err(Error::Method(youla::Error::Shape {
            what: format!("row {} of {what}", bad + 1),
            expected: (1, columns),
            found: (1, rows[bad].len()),
        })),
        None => Ok(Mat::from_fn(rows.len(), columns, |i, j| rows[i][j])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An empty list says nothing of its other size, as `jsonencode([])` and `numpy.zeros((0, 1)).tolist()` write it.
    #[test]
    fn a_gain_has_no_states_in_any_form_of_an_empty_matrix() {
        for empty in [
            "\"a\": [], \"b\": [], \"c\": []",
            "\"a\": [], \"b\": [], \"c\": [[]]",
            "\"a\": [[]], \"b\": [[]], \"c\": [[]]",
        ] {
            let read: SystemMatrices = serde_json::from_str(&format!("{{{empty}, \"d\": [[2.0, 3.0]]}}")).unwrap();
            let system = read.system(Discrete::new(0.1).unwrap()).unwrap();
            assert_eq!((system.order(), system.outputs(), system.inputs()), (0, 1, 2), "{empty}");
        }
    }
}
