//! State-space systems `x^+ = A x + B u, y = C x + D u`, eq. (8), where `+` is d/dt or the shift.

use super::TimeDomain;
use crate::linalg::{check_finite, check_shape, eigenvalues};
use crate::{Error, Result};
use faer::{Mat, MatRef, c64};

/// A state-space system with n states, m inputs and p outputs, checked at construction.
#[derive(Debug, Clone, PartialEq)]
pub struct StateSpace<T: TimeDomain> {
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    d: Mat<f64>,
    time: T,
}

impl<T: TimeDomain> StateSpace<T> {
    /// Builds a system from `a` (n x n), `b` (n x m), `c` (p x n) and `d` (p x m).
    ///
    /// # Errors
    /// [`Error::Shape`] names the matrix that does not fit, [`Error::NotFinite`] the first bad entry.
    ///
    /// ```
    /// use youla::{Mat, lti::{Continuous, StateSpace}, linalg::eye};
    /// let integrator = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), Mat::zeros(1, 1), Continuous)?;
    /// assert_eq!(integrator.order(), 1);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn new(a: Mat<f64>, b: Mat<f64>, c: Mat<f64>, d: Mat<f64>, time: T) -> Result<Self> {
        let (n, m, p) = (a.nrows(), d.ncols(), d.nrows());
        check_shape("the matrix A", a.as_ref(), (n, n))?;
        check_shape("the matrix B", b.as_ref(), (n, m))?;
        check_shape("the matrix C", c.as_ref(), (p, n))?;
        for (name, matrix) in [("A", &a), ("B", &b), ("C", &c), ("D", &d)] {
            check_finite(&format!("the matrix {name}"), matrix.as_ref())?;
        }
        Ok(StateSpace { a, b, c, d, time })
    }

    /// Builds a system from matrices whose shapes follow from those of checked systems.
    pub(super) fn from_checked(a: Mat<f64>, b: Mat<f64>, c: Mat<f64>, d: Mat<f64>, time: T) -> Self {
        debug_assert_eq!((b.nrows(), b.ncols(), c.nrows(), c.ncols()), (a.nrows(), d.ncols(), d.nrows(), a.nrows()));
        StateSpace { a, b, c, d, time }
    }

    /// A system without states.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for a bad entry.
    pub fn gain(d: Mat<f64>, time: T) -> Result<Self> {
        let (p, m) = (d.nrows(), d.ncols());
        Self::new(Mat::zeros(0, 0), Mat::zeros(0, m), Mat::zeros(p, 0), d, time)
    }

    /// State matrix, n x n.
    pub fn a(&self) -> MatRef<'_, f64> {
        self.a.as_ref()
    }

    /// Input matrix, n x m.
    pub fn b(&self) -> MatRef<'_, f64> {
        self.b.as_ref()
    }

    /// Output matrix, p x n.
    pub fn c(&self) -> MatRef<'_, f64> {
        self.c.as_ref()
    }

    /// Feedthrough, p x m.
    pub fn d(&self) -> MatRef<'_, f64> {
        self.d.as_ref()
    }

    /// The time domain.
    pub fn time(&self) -> T {
        self.time
    }

    /// Number of states n.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Number of inputs m.
    pub fn inputs(&self) -> usize {
        self.d.ncols()
    }

    /// Number of outputs p.
    pub fn outputs(&self) -> usize {
        self.d.nrows()
    }

    /// Whether it is the gain 0: no states, no feedthrough.
    pub fn is_zero(&self) -> bool {
        self.order() == 0 && self.d.norm_max() == 0.0
    }

    /// Eigenvalues of A.
    ///
    /// # Errors
    /// [`Error::NoConvergence`].
    pub fn poles(&self) -> Result<Vec<c64>> {
        eigenvalues("the state matrix", self.a.as_ref())
    }

    /// The pole farthest beyond the stability boundary; `None` without states.
    ///
    /// # Errors
    /// [`Error::NoConvergence`].
    pub fn worst_pole(&self) -> Result<Option<c64>> {
        let poles = self.poles()?;
        Ok(poles.into_iter().max_by(|p, q| self.time.instability(*p).total_cmp(&self.time.instability(*q))))
    }

    /// Whether all poles are strictly inside of the stability boundary.
    ///
    /// # Errors
    /// [`Error::NoConvergence`].
    pub fn is_stable(&self) -> Result<bool> {
        Ok(self.worst_pole()?.is_none_or(|p| self.time.instability(p) < 0.0))
    }

    /// Refuses an unstable system with its worst pole.
    ///
    /// # Errors
    /// [`Error::Unstable`] naming `what`.
    pub fn require_stable(&self, what: &str) -> Result<()> {
        match self.worst_pole()? {
            Some(pole) if self.time.instability(pole) >= 0.0 => Err(Error::Unstable { what: what.to_owned(), pole }),
            _ => Ok(()),
        }
    }

    /// The dual system (A', C', B', D'), by which every left-hand algorithm is the right-hand one.
    pub fn dual(&self) -> Self {
        StateSpace {
            a: self.a.transpose().to_owned(),
            b: self.c.transpose().to_owned(),
            c: self.b.transpose().to_owned(),
            d: self.d.transpose().to_owned(),
            time: self.time,
        }
    }
}
