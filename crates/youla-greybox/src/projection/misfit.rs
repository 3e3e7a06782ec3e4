//! The weighted misfit of a structure to a frequency response, and its slopes.
//!
//! On the sampled model, with `X = (zI - Ad)^-1 Bd U`, `R = C (zI - Ad)^-1` and `z = exp(s ts)`,
//! ```text
//! G_theta U = C X + D U,     d(G_theta U) = R (dAd X + dBd U) + dC X + dD U
//! ```
//! with the exact derivatives of the zero-order hold (`../sampled.rs`).

use super::target::FrequencyTarget;
use crate::prediction::sampled::{Coordinates, Sample, SampledSlope, sample, sampled_slopes};
use crate::prediction::small_qr::SmallQr;
use crate::structure::Structure;
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, c64};
use youla::linalg::check_shape;
use youla::lti::{Discrete, FrequencyResponse, StateSpace};

/// Structure and target, in fixed coordinates of the states.
pub(super) struct Misfit<'a> {
    pub(super) structure: &'a dyn Structure,
    pub(super) target: &'a FrequencyTarget,
    pub(super) parameters: usize,
    /// `|W Y|`.
    pub(super) size: f64,
}

/// The misfit at one parameter vector.
pub(super) struct Point {
    pub(super) theta: Vec<f64>,
    /// `sum |W (Y - G_theta U)|^2`.
    pub(super) cost: f64,
    coordinates: Coordinates,
    sample: Sample,
    /// `G_theta` on the grid.
    pub(super) response: FrequencyResponse,
}

impl<'a> Misfit<'a> {
    pub(super) fn new(structure: &'a dyn Structure, target: &'a FrequencyTarget) -> Self {
        let parameters = structure.names().len();
        Misfit { structure, target, parameters, size: target.size() }
    }

    /// The value at `theta`.
    pub(super) fn evaluate(&self, theta: &[f64]) -> Result<Point> {
        let time = self.target.time();
        let coordinates = Coordinates::new(self.structure, theta, time)?;
        let sample = sample(self.structure, theta, &coordinates, time)?;
        let direct = sample.discrete.d();
        check_shape("the feedthrough of the structure", direct, (self.target.outputs(), self.target.inputs()))?;
        let response = self.target.response(&sample.discrete)?;
        let cost: f64 = self.entries(&response).col_iter().flat_map(|column| column.iter()).sum();
        if !cost.is_finite() {
            return Err(Error::Method(youla::Error::PoleOnBoundary { omega: self.target.omega()[0] }));
        }
        Ok(Point { theta: theta.to_vec(), cost, coordinates, sample, response })
    }

    /// `sum_k |W (Y - G_theta U)|^2` for each entry, p x r.
    pub(super) fn entries(&self, response: &FrequencyResponse) -> Mat<f64> {
        let mut sums = Mat::zeros(self.target.outputs(), self.target.columns());
        for (k, model) in response.iter().enumerate() {
            let (y, u, w) = (self.target.value(k), self.target.excited(k), self.target.weight(k));
            for j in 0..sums.ncols() {
                for i in 0..sums.nrows() {
                    let error = (0..u.nrows()).fold(y[(i, j)], |error, l| error - model[(i, l)] * u[(l, j)]);
                    sums[(i, j)] += error.norm_sqr() * w[(i, j)].powi(2);
                }
            }
        }
        sums
    }

    /// The triangular factor of `[J r]`, J the slopes of the weighted model, r the weighted misfit, real and imaginary parts.
    pub(super) fn linearise(&self, point: &Point) -> Result<Mat<f64>> {
        let slopes =
            sampled_slopes(self.structure, &point.theta, &point.sample, &point.coordinates, self.target.time())?;
        let (p, r, q) = (self.target.outputs(), self.target.columns(), self.parameters);
        let each = 2 * p * r;
        let count = each * self.target.omega().len();
        let mut rows = vec![0.0; count * (q + 1)];
        let mut values = vec![c64::new(0.0, 0.0); p * r];
        for k in 0..self.target.omega().len() {
            let mut here = Resolvent::new(&point.sample.discrete, self.target.s(k), self.target.excited(k));
            let (y, w) = (self.target.value(k), self.target.weight(k));
            let mut write = |column: usize, values: &[c64]| {
                let rows = &mut rows[column * count + k * each..][..each];
                for (entry, (pair, value)) in rows.chunks_exact_mut(2).zip(values).enumerate() {
                    let value = value * w[(entry % p, entry / p)];
                    pair.copy_from_slice(&[value.re, value.im]);
                }
            };
            for (column, slope) in slopes.iter().enumerate() {
                here.slope(slope, &mut values);
                write(column, &values);
            }
            for (entry, value) in values.iter_mut().enumerate() {
                let (i, j) = (entry % p, entry / p);
                *value = y[(i, j)] - here.value(&point.sample.discrete, i, j);
            }
            write(q, &values);
        }
        let mut triangle = SmallQr::new(q + 1);
        triangle.fold(&mut rows, count);
        Ok(triangle.into_factor())
    }
}

/// A sampled model at one frequency.
struct Resolvent {
    /// `[X; U]`, (n + m) x r.
    signals: Mat<c64>,
    /// R, p x n.
    outputs: Mat<c64>,
    /// What a slope moves in the states, n x r, column by column.
    moved: Vec<c64>,
}

impl Resolvent {
    fn new(model: &StateSpace<Discrete>, s: c64, excited: MatRef<'_, c64>) -> Self {
        let (n, m, r) = (model.order(), model.inputs(), excited.ncols());
        let z = (s * model.time().ts()).exp();
        let pencil =
            Mat::from_fn(n, n, |i, j| if i == j { z - model.a()[(i, j)] } else { (-model.a()[(i, j)]).into() });
        let lu = pencil.partial_piv_lu();
        let states = lu.solve(complex(model.b()) * excited);
        let outputs = lu.solve_transpose(complex(model.c().transpose())).transpose().to_owned();
        let signals = Mat::from_fn(n + m, r, |i, j| if i < n { states[(i, j)] } else { excited[(i - n, j)] });
        Resolvent { signals, outputs, moved: vec![c64::new(0.0, 0.0); n * r] }
    }

    /// One entry of `G_theta U`.
    fn value(&self, model: &StateSpace<Discrete>, i: usize, j: usize) -> c64 {
        let n = model.order();
        let row = |l: usize| if l < n { model.c()[(i, l)] } else { model.d()[(i, l - n)] };
        (0..self.signals.nrows()).fold(c64::new(0.0, 0.0), |sum, l| sum + self.signals[(l, j)] * row(l))
    }

    /// `d(G_theta U)` with respect to one parameter, p x r, column by column.
    fn slope(&mut self, slope: &SampledSlope, values: &mut [c64]) {
        let (n, p) = (self.outputs.ncols(), self.outputs.nrows());
        times(slope.states.as_ref(), &self.signals, &mut self.moved);
        times(slope.outputs.as_ref(), &self.signals, values);
        for (entry, value) in values.iter_mut().enumerate() {
            let moved = &self.moved[entry / p * n..][..n];
            *value +=
                moved.iter().enumerate().fold(c64::new(0.0, 0.0), |sum, (l, x)| sum + self.outputs[(entry % p, l)] * x);
        }
    }
}

/// A real matrix times a complex one, column by column.
fn times(real: MatRef<'_, f64>, complex: &Mat<c64>, product: &mut [c64]) {
    let rows = real.nrows();
    product.fill(c64::new(0.0, 0.0));
    for (j, product) in product.chunks_exact_mut(rows).enumerate() {
        for (l, column) in real.col_iter().enumerate() {
            let factor = complex[(l, j)];
            product.iter_mut().zip(column.iter()).for_each(|(sum, value)| *sum += factor * *value);
        }
    }
}

/// A real matrix as a complex one.
pub(super) fn complex(real: MatRef<'_, f64>) -> Mat<c64> {
    Mat::from_fn(real.nrows(), real.ncols(), |i, j| c64::new(real[(i, j)], 0.0))
}
