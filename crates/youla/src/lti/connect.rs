//! Interconnection: series, parallel, stacking, inversion and the closing of internal loops, all in state space.

use super::{Discrete, StateSpace, TimeDomain};
use crate::linalg::{block, block_diagonal, eye, solve, solve_in_any_units, solve_right};
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::ops::Range;

impl StateSpace<Discrete> {
    /// `z^-samples` times this system: its outputs later by whole samples, with a state of each for every one.
    ///
    /// # Errors
    /// Those of [`StateSpace::new`].
    pub fn delayed(self, samples: usize) -> Result<Self> {
        let p = self.outputs();
        let one = Self::new(Mat::zeros(p, p), eye(p), eye(p), Mat::zeros(p, p), self.time())?;
        (0..samples).try_fold(self, |chain, _| chain.then(&one))
    }
}

impl<T: TimeDomain> StateSpace<T> {
    /// `next * self`: the output of this system drives `next`. States are those of this system, then of `next`.
    ///
    /// # Errors
    /// [`Error::Shape`] when the ports do not fit, [`Error::SampleTimeMismatch`].
    pub fn then(&self, next: &Self) -> Result<Self> {
        self.check_time("series connection", next)?;
        check_ports("the input matrix of the second system in series", next.inputs(), self.outputs())?;
        let upper_right = Mat::zeros(self.order(), next.order());
        let driven = next.b() * self.c();
        let a = block(&[&[self.a(), upper_right.as_ref()], &[driven.as_ref(), next.a()]]);
        let b = block(&[&[self.b()], &[(next.b() * self.d()).as_ref()]]);
        let c = block(&[&[(next.d() * self.c()).as_ref(), next.c()]]);
        Self::new(a, b, c, next.d() * self.d(), self.time())
    }

    /// `self + other`: both driven by the same input, outputs added.
    ///
    /// # Errors
    /// [`Error::Shape`] when the ports do not fit, [`Error::SampleTimeMismatch`].
    pub fn plus(&self, other: &Self) -> Result<Self> {
        self.check_time("parallel connection", other)?;
        check_ports("the number of inputs in parallel", other.inputs(), self.inputs())?;
        check_ports("the number of outputs in parallel", other.outputs(), self.outputs())?;
        let a = block_diagonal(self.a(), other.a());
        let b = block(&[&[self.b()], &[other.b()]]);
        let c = block(&[&[self.c(), other.c()]]);
        Self::new(a, b, c, self.d() + other.d(), self.time())
    }

    /// `-self`.
    pub fn negated(&self) -> Self {
        self.map_output(&(eye(self.outputs()) * faer::Scale(-1.0)))
    }

    /// Both systems side by side, not connected: inputs `[u1; u2]`, outputs `[y1; y2]`.
    ///
    /// # Errors
    /// [`Error::SampleTimeMismatch`].
    pub fn append(&self, other: &Self) -> Result<Self> {
        self.check_time("stacking", other)?;
        Self::new(
            block_diagonal(self.a(), other.a()),
            block_diagonal(self.b(), other.b()),
            block_diagonal(self.c(), other.c()),
            block_diagonal(self.d(), other.d()),
            self.time(),
        )
    }

    /// The inverse system, `[A - B D^-1 C, B D^-1; -D^-1 C, D^-1]`; its poles are the zeros of this one.
    ///
    /// # Errors
    /// [`Error::Shape`] unless square, [`Error::Singular`] when D is not invertible.
    pub fn inverse(&self) -> Result<Self> {
        check_ports("the number of inputs of a system to invert", self.inputs(), self.outputs())?;
        let d_inv =
            solve_in_any_units("the feedthrough of the system to invert", self.d(), eye(self.outputs()).as_ref())?;
        let b = self.b() * &d_inv;
        let a = self.a() - &b * self.c();
        let c = faer::Scale(-1.0) * (&d_inv * self.c());
        Self::new(a, b, c, d_inv, self.time())
    }

    /// The part from some inputs to some outputs, with all states.
    ///
    /// # Panics
    /// When a range lies outside of the ports.
    pub fn part(&self, outputs: Range<usize>, inputs: Range<usize>) -> Self {
        let (rows, cols) = (outputs.len(), inputs.len());
        let d = self.d().submatrix(outputs.start, inputs.start, rows, cols).to_owned();
        let b = self.b().subcols(inputs.start, cols).to_owned();
        let c = self.c().subrows(outputs.start, rows).to_owned();
        self.with_ports(b, c, d)
    }

    /// `matrix * self`.
    ///
    /// # Panics
    /// When the matrix does not have as many columns as this system has outputs.
    pub fn map_output(&self, matrix: &Mat<f64>) -> Self {
        self.with_ports(self.b().to_owned(), matrix * self.c(), matrix * self.d())
    }

    /// `self * matrix`.
    ///
    /// # Panics
    /// When the matrix does not have as many rows as this system has inputs.
    pub fn map_input(&self, matrix: &Mat<f64>) -> Self {
        self.with_ports(self.b() * matrix, self.c().to_owned(), self.d() * matrix)
    }

    /// Closes internal loops: the last `routing.nrows()` inputs v are fed from the last `routing.ncols()` outputs r by
    /// `v = routing * r`, and both disappear.
    ///
    /// With `r = Cr x + Dre e + Drv v`: `(I - routing Drv) v = routing (Cr x + Dre e)`.
    ///
    /// # Errors
    /// [`Error::AlgebraicLoop`] when `I - routing Drv` is singular: the loop is not well posed.
    pub(crate) fn close(&self, routing: MatRef<'_, f64>) -> Result<Self> {
        let (nv, nr) = (routing.nrows(), routing.ncols());
        let (ne, nz) = (self.inputs() - nv, self.outputs() - nr);
        let external = self.part(0..nz, 0..ne);
        let from_v = self.part(0..nz, ne..self.inputs());
        let to_r = self.part(nz..self.outputs(), 0..ne);
        let drv = self.part(nz..self.outputs(), ne..self.inputs());
        let loop_matrix = eye(nv) - routing * drv.d();
        let rhs = block(&[&[(routing * to_r.c()).as_ref(), (routing * to_r.d()).as_ref()]]);
        let v = solve_in_any_units("loop", loop_matrix.as_ref(), rhs.as_ref()).map_err(|e| match e {
            Error::Singular { rcond, .. } => Error::AlgebraicLoop { rcond },
            other => other,
        })?;
        let (v_x, v_e) = (v.subcols(0, self.order()), v.subcols(self.order(), ne));
        Self::new(
            self.a() + from_v.b() * v_x,
            external.b() + from_v.b() * v_e,
            external.c() + from_v.d() * v_x,
            external.d() + from_v.d() * v_e,
            self.time(),
        )
    }

    /// Left division of the columns of a row system: for `w = X1 u + X2 y` the system `y = -X2^-1 X1 u` that keeps w = 0.
    ///
    /// # Errors
    /// [`Error::Singular`] when the feedthrough of X2 is not invertible.
    pub(crate) fn solve_last_inputs(&self, count: usize) -> Result<Self> {
        let kept = self.inputs() - count;
        let x2 = self.d().subcols(kept, count);
        let (b1, b2) = (self.b().subcols(0, kept), self.b().subcols(kept, count));
        let c = solve("the feedthrough of a left factor", x2, self.c())?;
        let d = solve("the feedthrough of a left factor", x2, self.d().subcols(0, kept))?;
        let minus = faer::Scale(-1.0);
        Self::new(self.a() - b2 * &c, b1 - b2 * &d, minus * c, minus * d, self.time())
    }

    /// Right division of the rows of a column system: for `[p; q] = [X1; X2] w` the system `q = X2 X1^-1 p`.
    ///
    /// # Errors
    /// [`Error::Singular`] when the feedthrough of X1 is not invertible.
    pub(crate) fn divide_by_first_outputs(&self, count: usize) -> Result<Self> {
        let rest = self.outputs() - count;
        let x1 = self.d().subrows(0, count);
        let (c1, c2) = (self.c().subrows(0, count), self.c().subrows(count, rest));
        let b = solve_right("the feedthrough of a right factor", x1, self.b())?;
        let d = solve_right("the feedthrough of a right factor", x1, self.d().subrows(count, rest))?;
        Self::new(self.a() - &b * c1, b, c2 - &d * c1, d, self.time())
    }

    pub(crate) fn check_time(&self, what: &str, other: &Self) -> Result<()> {
        if self.time() == other.time() {
            return Ok(());
        }
        let seconds = |s: &Self| s.time().sample_time().unwrap_or(0.0);
        Err(Error::SampleTimeMismatch { what: what.to_owned(), left: seconds(self), right: seconds(other) })
    }

    fn with_ports(&self, b: Mat<f64>, c: Mat<f64>, d: Mat<f64>) -> Self {
        Self::from_checked(self.a().to_owned(), b, c, d, self.time())
    }
}

fn check_ports(what: &str, found: usize, expected: usize) -> Result<()> {
    if found == expected { Ok(()) } else { Err(Error::Ports { what: what.to_owned(), expected, found }) }
}
