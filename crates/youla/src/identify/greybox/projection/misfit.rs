//! The weighted misfit of a structure to a frequency response, and its slopes.
//!
//! On the sampled model, with `X = (zI - Ad)^-1 Bd`, `Y = C (zI - Ad)^-1` and `z = exp(j omega ts)`,
//! ```text
//! G_theta = C X + D,     dG_theta = Y (dAd X + dBd) + dC X + dD
//! ```
//! with the exact derivatives of the zero-order hold (`../sampled.rs`).

use super::super::narrow::NarrowTriangle;
use super::super::sampled::{Coordinates, SampledSlope, sampled_slopes};
use super::super::structure::Structure;
use super::target::FrequencyTarget;
use crate::linalg::check_shape;
use crate::lti::{Continuous, Discrete, StateSpace, TimeDomain, frequency_response};
use crate::{Error, Result};
use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef, c64};

/// Structure and target, in fixed coordinates of the states.
pub(super) struct Misfit<'a> {
    pub(super) structure: &'a dyn Structure,
    pub(super) target: &'a FrequencyTarget,
    pub(super) parameters: usize,
    /// `|W G|`.
    pub(super) size: f64,
}

/// The misfit at one parameter vector.
pub(super) struct Point {
    pub(super) theta: Vec<f64>,
    /// `sum |W (G - G_theta)|^2`.
    pub(super) cost: f64,
    coordinates: Coordinates,
    continuous: StateSpace<Continuous>,
    pub(super) sampled: StateSpace<Discrete>,
}

impl<'a> Misfit<'a> {
    pub(super) fn new(structure: &'a dyn Structure, target: &'a FrequencyTarget) -> Self {
        let parameters = structure.names().len();
        Misfit { structure, target, parameters, size: target.size() }
    }

    /// The value at `theta`.
    pub(super) fn evaluate(&self, theta: &[f64]) -> Result<Point> {
        let model = self.structure.model(theta)?;
        check_shape("the feedthrough of the structure", model.d(), (self.target.outputs(), self.target.inputs()))?;
        let coordinates = Coordinates { states: model.state_scales()?, outputs: vec![1.0; model.outputs()] };
        let continuous = coordinates.apply(&model)?;
        let sampled = continuous.zoh(self.target.time())?;
        let cost = self.entries(&sampled)?.col_iter().flat_map(|column| column.iter()).sum();
        let point = Point { theta: theta.to_vec(), cost, coordinates, continuous, sampled };
        if point.cost.is_finite() { Ok(point) } else { Err(Error::PoleOnBoundary { omega: self.target.omega()[0] }) }
    }

    /// `sum_k |W (G - G_theta)|^2` for each entry, p x m.
    pub(super) fn entries(&self, sampled: &StateSpace<Discrete>) -> Result<Mat<f64>> {
        let response = frequency_response(sampled, self.target.omega())?;
        let mut sums = Mat::zeros(self.target.outputs(), self.target.inputs());
        for (k, model) in response.iter().enumerate() {
            let (g, w) = (self.target.value(k), self.target.weight(k));
            for j in 0..sums.ncols() {
                for i in 0..sums.nrows() {
                    sums[(i, j)] += (g[(i, j)] - model[(i, j)]).norm_sqr() * w[(i, j)].powi(2);
                }
            }
        }
        Ok(sums)
    }

    /// The triangular factor of `[J r]`, J the slopes of the weighted model, r the weighted misfit, real and imaginary parts.
    pub(super) fn linearise(&self, point: &Point) -> Result<Mat<f64>> {
        let slopes =
            sampled_slopes(self.structure, &point.theta, &point.continuous, &point.coordinates, self.target.time())?;
        let (p, m, q) = (self.target.outputs(), self.target.inputs(), self.parameters);
        let each = 2 * p * m;
        let count = each * self.target.omega().len();
        let mut rows = vec![0.0; count * (q + 1)];
        for k in 0..self.target.omega().len() {
            let here = Resolvent::new(&point.sampled, self.target.omega()[k]);
            let (g, w) = (self.target.value(k), self.target.weight(k));
            let mut write = |column: usize, value: &dyn Fn(usize, usize) -> c64| {
                let rows = &mut rows[column * count + k * each..][..each];
                for (pair, (i, j)) in rows.chunks_exact_mut(2).zip((0..m).flat_map(|j| (0..p).map(move |i| (i, j)))) {
                    let value = value(i, j) * w[(i, j)];
                    pair.copy_from_slice(&[value.re, value.im]);
                }
            };
            for (column, slope) in slopes.iter().enumerate() {
                let slope = here.slope(slope);
                write(column, &|i, j| slope[(i, j)]);
            }
            write(q, &|i, j| g[(i, j)] - here.value[(i, j)]);
        }
        let mut triangle = NarrowTriangle::new(q + 1);
        triangle.fold(&mut rows, count);
        Ok(triangle.into_factor())
    }
}

/// A sampled model at one frequency.
struct Resolvent {
    /// `[X; I]`, (n + m) x m.
    signals: Mat<c64>,
    /// Y, p x n.
    outputs: Mat<c64>,
    /// `G_theta`, p x m.
    value: Mat<c64>,
}

impl Resolvent {
    fn new(model: &StateSpace<Discrete>, omega: f64) -> Self {
        let (n, m) = (model.order(), model.inputs());
        let z = model.time().boundary(omega);
        let pencil =
            Mat::from_fn(n, n, |i, j| if i == j { z - model.a()[(i, j)] } else { (-model.a()[(i, j)]).into() });
        let lu = pencil.partial_piv_lu();
        let states = lu.solve(complex(model.b()));
        let outputs = lu.solve_transpose(complex(model.c().transpose())).transpose().to_owned();
        let value = complex(model.c()) * &states + complex(model.d());
        let one = |held: bool| c64::new(if held { 1.0 } else { 0.0 }, 0.0);
        let signals = Mat::from_fn(n + m, m, |i, j| if i < n { states[(i, j)] } else { one(i - n == j) });
        Resolvent { signals, outputs, value }
    }

    /// `dG_theta` with respect to one parameter, p x m.
    fn slope(&self, slope: &SampledSlope) -> Mat<c64> {
        let moved = times(slope.states.as_ref(), &self.signals);
        let direct = times(slope.outputs.as_ref(), &self.signals);
        &self.outputs * moved + direct
    }
}

/// A real matrix times a complex one.
fn times(real: MatRef<'_, f64>, complex: &Mat<c64>) -> Mat<c64> {
    let mut product = Mat::zeros(real.nrows(), complex.ncols());
    for (b, column) in real.col_iter().enumerate() {
        for (i, value) in column.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            for j in 0..complex.ncols() {
                product[(i, j)] += complex[(b, j)] * *value;
            }
        }
    }
    product
}

/// A real matrix as a complex one.
pub(super) fn complex(real: MatRef<'_, f64>) -> Mat<c64> {
    Mat::from_fn(real.nrows(), real.ncols(), |i, j| c64::new(real[(i, j)], 0.0))
}
