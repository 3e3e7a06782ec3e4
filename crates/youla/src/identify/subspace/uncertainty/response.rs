//! The delta method for frequency responses and modes.
//!
//! ```text
//! dG = X (dA Y + dB) + dC Y + dD,   X = C (z I - A)^-1,   Y = (z I - A)^-1 B
//! dlambda = w' dA v / (w' v)  for the left and right eigenvectors of a pole
//! ```

use super::band::{ModeBand, Reach, ResponseBand};
use super::delta::{BlockInfluence, Delta};
use crate::lti::{Discrete, Eigen, Mode, StateSpace, TimeDomain, frequency_response};
use crate::{Mat, MatRef, Result, c64};
use faer::prelude::*;
use std::f64::consts::TAU;

impl Delta {
    /// The frequency response at the angular frequencies `omega`, rad/s, with its regions.
    ///
    /// # Errors
    /// As [`frequency_response`].
    pub fn response(&self, omega: &[f64]) -> Result<ResponseBand> {
        let response = frequency_response(&self.model, omega)?;
        let covariance = |changes: &[[f64; 2]]| {
            let v = self.covariance(&changes.iter().map(|c| c.to_vec()).collect::<Vec<_>>());
            [v[(0, 0)], v[(0, 1)], v[(1, 1)]]
        };
        let reach = Reach { student: self.student(), ellipse: self.ellipse() };
        ResponseBand::by_changes(response, |w| self.response_changes(w), covariance, reach)
    }

    /// The change of the response with each block at one frequency, rad/s; p m numbers, column by column.
    pub fn response_changes(&self, omega: f64) -> Vec<Vec<c64>> {
        response_changes(&self.model, &self.blocks, omega)
    }

    /// The modes in the order of [`StateSpace::modes`], with their intervals.
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`] of the eigenvectors.
    pub fn modes(&self) -> Result<Vec<ModeBand>> {
        let modes = self.model.modes()?;
        let eigen = Eigen::new(&self.model)?;
        let student = self.student();
        Ok(modes.into_iter().map(|mode| self.mode_band(mode, &eigen, student)).collect())
    }

    fn mode_band(&self, mode: Mode, eigen: &Eigen, student: f64) -> ModeBand {
        let changes: Vec<Vec<f64>> = self
            .blocks
            .iter()
            .map(|block| mode_change(mode.pole, eigen.change(mode.pole, &block.a), self.model.time()).to_vec())
            .collect();
        let v = self.covariance(&changes);
        ModeBand::new(mode, [v[(0, 0)], v[(1, 1)]], student)
    }
}

/// What changes of a system make of its response at one frequency, rad/s; p m numbers each, column by column.
pub fn response_changes(model: &StateSpace<Discrete>, changes: &[BlockInfluence], omega: f64) -> Vec<Vec<c64>> {
    let z = model.time().boundary(omega);
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    let a = model.a();
    let pencil = Mat::from_fn(n, n, |i, j| if i == j { z - a[(i, j)] } else { c64::new(-a[(i, j)], 0.0) });
    let lu = pencil.partial_piv_lu();
    let y = lu.solve(complex(model.b()));
    let x = lu.solve_transpose(complex(model.c()).transpose()).transpose().to_owned();
    let change = |block: &BlockInfluence| {
        let states = product(&block.a, &y) + complex(block.b.as_ref());
        let d = &x * states + product(&block.c, &y) + complex(block.d.as_ref());
        (0..m * p).map(|k| d[(k % p, k / p)]).collect()
    };
    changes.iter().map(change).collect()
}

/// `|g| -+ t sigma`, sigma that of the part of the error along g.
pub(super) fn magnitude_interval(g: c64, v: &[f64; 3], student: f64) -> [f64; 2] {
    let size = g.norm();
    let (r, i) = if size > 0.0 { (g.re / size, g.im / size) } else { (1.0, 0.0) };
    let half = student * (r * r * v[0] + 2.0 * r * i * v[1] + i * i * v[2]).max(0.0).sqrt();
    [(size - half).max(0.0), size + half]
}

/// Change of frequency and damping with the pole: `s = ln(z) / ts`.
pub fn mode_change(pole: c64, dz: c64, time: Discrete) -> [f64; 2] {
    let s = time.continuous_pole(pole);
    let size = s.norm();
    if !size.is_finite() || size == 0.0 {
        return [0.0; 2];
    }
    let ds = dz / pole / time.ts();
    let along = (s.re * ds.re + s.im * ds.im) / size;
    let dzeta = if pole.im == 0.0 && pole.re > 0.0 { 0.0 } else { (s.re * along / size - ds.re) / size };
    [along / TAU, dzeta]
}

fn complex(m: MatRef<'_, f64>) -> Mat<c64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0))
}

/// A real times a complex matrix.
fn product(a: &Mat<f64>, b: &Mat<c64>) -> Mat<c64> {
    Mat::from_fn(a.nrows(), b.ncols(), |i, j| {
        (0..a.ncols()).fold(c64::new(0.0, 0.0), |sum, k| sum + b[(k, j)] * a[(i, k)])
    })
}
