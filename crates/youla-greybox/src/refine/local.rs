//! Data driven local coordinates: the entries of a model less the directions of its similarity transformations.
//!
//! Moving the states by `I + T` changes the entries, to first order, by
//! ```text
//! (dA, dB, dC) = (T A - A T, T B, -C T)
//! ```
//! an n^2-dimensional tangent space; the columns of P, orthonormal, span its orthogonal complement, and
//! ```text
//! [A B; C] = [A B; C]_0 + P theta
//! ```
//! (McKelvey, Helmersson and Ribarits 2004, section 3). For an observable or reachable model there are n (m + p) columns.

use crate::{Error, Result};
use crate::{Matrix, Slope, Structure};
use youla::Mat;
use youla::lti::{Continuous, Discrete, StateSpace};

/// A structure of discrete time around a model; `theta = 0` is the model itself.
///
/// ```
/// use youla_greybox::{Structure, refine::LocalCoordinates};
/// use youla::lti::{Discrete, StateSpace};
/// use youla::Mat;
/// let time = Discrete::new(0.1)?;
/// let a = Mat::from_fn(2, 2, |i, j| if i == j { 0.5 + 0.1 * i as f64 } else { 0.0 });
/// let ones = |rows, columns| Mat::from_fn(rows, columns, |_, _| 1.0);
/// let model = StateSpace::new(a, ones(2, 1), ones(1, 2), Mat::zeros(1, 1), time)?;
/// let local = LocalCoordinates::new(model, false);
/// assert_eq!(local.names().len(), 2 * (1 + 1));
/// # Ok::<(), youla_greybox::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LocalCoordinates {
    base: StateSpace<Discrete>,
    /// What each parameter moves.
    directions: Vec<Vec<Slope>>,
}

impl LocalCoordinates {
    /// The coordinates at a model, with the entries of D behind the others where they are free.
    pub fn new(base: StateSpace<Discrete>, feedthrough: bool) -> Self {
        let (n, m, p) = (base.order(), base.inputs(), base.outputs());
        let tangents = tangents(&base);
        let (rows, columns) = (tangents.nrows(), tangents.ncols());
        let q = tangents.qr().compute_Q();
        let complement = (columns..rows).map(|k| {
            let slope = |row: usize| Slope { value: q[(row, k)], ..entry(row, (n, m)) };
            (0..rows).map(slope).filter(|slope| slope.value != 0.0).collect()
        });
        let direct = (0..if feedthrough { p * m } else { 0 })
            .map(|k| vec![Slope { matrix: Matrix::D, row: k % p, column: k / p, value: 1.0 }]);
        let directions = complement.chain(direct).collect();
        LocalCoordinates { base, directions }
    }

    /// `theta = 0`.
    pub fn origin(&self) -> Vec<f64> {
        vec![0.0; self.directions.len()]
    }
}

/// The entry at a place of the vector of A and B, column by column, and C, row by row.
fn entry(place: usize, (n, m): (usize, usize)) -> Slope {
    let at = |matrix, k: usize, rows: usize| Slope { matrix, row: k % rows, column: k / rows, value: 0.0 };
    match place {
        k if k < n * n => at(Matrix::A, k, n),
        k if k < n * (n + m) => at(Matrix::B, k - n * n, n),
        k => {
            let k = k - n * (n + m);
            Slope { matrix: Matrix::C, row: k / n, column: k % n, value: 0.0 }
        }
    }
}

/// The tangent space of the similarity transformations, one column for each entry of T.
fn tangents(model: &StateSpace<Discrete>) -> Mat<f64> {
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    let (a, b, c) = (model.a(), model.b(), model.c());
    let mut all = Mat::zeros(n * (n + m + p), n * n);
    for i in 0..n {
        for j in 0..n {
            // T = e_i e_j'
            let column = j * n + i;
            for k in 0..n {
                all[(k * n + i, column)] += a[(j, k)];
                all[(j * n + k, column)] -= a[(k, i)];
            }
            (0..m).for_each(|k| all[(n * n + k * n + i, column)] += b[(j, k)]);
            (0..p).for_each(|k| all[(n * (n + m) + k * n + j, column)] -= c[(k, i)]);
        }
    }
    all
}

impl Structure for LocalCoordinates {
    fn names(&self) -> Vec<String> {
        (1..=self.directions.len()).map(|k| format!("direction {k}")).collect()
    }

    fn model(&self, _theta: &[f64]) -> Result<StateSpace<Continuous>> {
        Err(Error::DiscreteStructure { ts: self.base.time().ts() })
    }

    fn sample_time(&self) -> Option<Discrete> {
        Some(self.base.time())
    }

    fn sampled(&self, theta: &[f64], _time: Discrete) -> Result<StateSpace<Discrete>> {
        let base = &self.base;
        let mut matrices = [base.a(), base.b(), base.c(), base.d()].map(|m| m.to_owned());
        for (direction, value) in self.directions.iter().zip(theta) {
            for slope in direction {
                matrices[slope.matrix as usize][(slope.row, slope.column)] += value * slope.value;
            }
        }
        let [a, b, c, d] = matrices;
        StateSpace::new(a, b, c, d, base.time()).map_err(Error::from)
    }

    fn slopes(&self, _theta: &[f64], parameter: usize) -> Vec<Slope> {
        self.directions.get(parameter).cloned().unwrap_or_default()
    }
}
