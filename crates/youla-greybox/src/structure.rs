//! The seam between an estimator and a physical structure: matrices as functions of named parameters, in continuous or
//! discrete time, and their derivatives.

use crate::{Error, Result};
use youla::lti::{Continuous, Discrete, StateSpace};

/// One of the four matrices of `x' = A x + B u, y = C x + D u`, or of `x(k+1) = A x(k) + B u(k)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Matrix {
    /// State matrix, n x n.
    A,
    /// Input matrix, n x m.
    B,
    /// Output matrix, p x n.
    C,
    /// Feedthrough, p x m.
    D,
}

/// A derivative that is not zero: of one entry of one matrix with respect to one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The matrix.
    pub matrix: Matrix,
    /// Row of the entry, counted from 0.
    pub row: usize,
    /// Column of the entry, counted from 0.
    pub column: usize,
    /// `d entry / d parameter`.
    pub value: f64,
}

/// A family of models `A(theta), B(theta), C(theta), D(theta)` with derivatives, in continuous time unless
/// [`Structure::sample_time`] says otherwise.
///
/// The shapes of the matrices must not depend on the parameters. Entries that a parameter does not move are left out of
/// its slopes; a parameter may move any number of entries, each named once.
///
/// ```
/// use youla_greybox::{Matrix, Result, Slope, Structure};
/// use youla::lti::{Continuous, StateSpace};
/// use youla::{Mat, linalg::eye};
///
/// /// `x' = -rate x + rate u, y = x`.
/// struct Lag;
///
/// impl Structure for Lag {
///     fn names(&self) -> Vec<String> {
///         vec!["rate".into()]
///     }
///     fn model(&self, theta: &[f64]) -> Result<StateSpace<Continuous>> {
///         let rate = Mat::from_fn(1, 1, |_, _| theta[0]);
///         Ok(StateSpace::new(-&rate, rate, eye(1), Mat::zeros(1, 1), Continuous)?)
///     }
///     fn slopes(&self, _: &[f64], _: usize) -> Vec<Slope> {
///         [(Matrix::A, -1.0), (Matrix::B, 1.0)].map(|(matrix, value)| Slope { matrix, row: 0, column: 0, value }).into()
///     }
/// }
/// ```
pub trait Structure: Sync {
    /// Names of the parameters, in the order of `theta`.
    fn names(&self) -> Vec<String>;

    /// The continuous-time model at `theta`, one value per name; an error for a structure of discrete time.
    ///
    /// # Errors
    /// Whatever makes a model impossible there; a trial point with an error counts as rejected.
    fn model(&self, theta: &[f64]) -> Result<StateSpace<Continuous>>;

    /// Derivatives of the entries with respect to parameter `parameter` (counted from 0) at `theta`.
    fn slopes(&self, theta: &[f64], parameter: usize) -> Vec<Slope>;

    /// The sample time of a structure whose matrices, and slopes, are those of `x(k+1) = A x(k) + B u(k)`; `None`, as where
    /// this is not implemented, for one of continuous time. A structure of discrete time implements
    /// [`Structure::sampled`] too.
    fn sample_time(&self) -> Option<Discrete> {
        None
    }

    /// The sampled model at `theta`: where this is not implemented, [`Structure::model`] behind a zero-order hold.
    ///
    /// # Errors
    /// As [`Structure::model`].
    fn sampled(&self, theta: &[f64], time: Discrete) -> Result<StateSpace<Discrete>> {
        self.model(theta)?.zoh(time).map_err(Error::from)
    }

    /// Smallest and largest value of each parameter; infinite where there is none, as for all where this is not
    /// implemented.
    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(f64::NEG_INFINITY, f64::INFINITY); self.names().len()]
    }

    /// Typical size of each parameter, positive; 1 where this is not implemented. The search measures a parameter by its
    /// effect on the outputs, and by its typical size only as long as it has none.
    fn scales(&self) -> Vec<f64> {
        vec![1.0; self.names().len()]
    }
}
