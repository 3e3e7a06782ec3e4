//! Lines in scaled channels, inputs delayed, each with the matrix that whitens its residual.

use super::data::{Column, MeasuredResponse};
use crate::identify::likelihood::data::spectra::Sizes;
use crate::identify::likelihood::search::model::Model;
use crate::lti::TimeDomain;
use crate::signal::output_rest;
use faer::prelude::*;
use faer::{Mat, Side, c64};

/// Degrees of freedom, as those of a complex number, to which estimated covariances of neighbouring lines are averaged: the spectrum of
/// the noise of an output is smooth, and fewer than 20 cost more than 10 % of the information.
const DEGREES: f64 = 20.0;
/// Least standard deviation of a residual relative to the output: a table has no more digits.
const ROUNDING: f64 = 1e-9;

/// All lines.
#[derive(Debug, Clone)]
pub(super) struct WeighedLines {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) lines: Vec<WeighedLine>,
}

/// One line.
#[derive(Debug, Clone)]
pub(super) struct WeighedLine {
    pub(super) z: c64,
    /// At the frequencies zero and Nyquist nothing is imaginary.
    pub(super) real: bool,
    pub(super) columns: Vec<WeighedColumn>,
}

/// One experiment of a line.
#[derive(Debug, Clone)]
pub(super) struct WeighedColumn {
    pub(super) u: Vec<c64>,
    pub(super) y: Vec<c64>,
    /// W, p x p: `|W (Y - G U)|^2` has the mean p, for a real line `p / 2`.
    pub(super) w: Mat<c64>,
}

/// Shares of an unknown variance: of the mean square of each output, and of the square of each value.
#[derive(Debug, Clone, Copy)]
pub(super) struct VarianceShape {
    pub(super) absolute: f64,
    pub(super) relative: f64,
}

/// Root mean squares over all lines.
pub(super) fn sizes(response: &MeasuredResponse) -> Sizes {
    let columns = || response.lines.iter().flatten();
    let size = |pick: &dyn Fn(&Column) -> f64| {
        let mean = columns().map(pick).sum::<f64>() / columns().count().max(1) as f64;
        if mean > 0.0 { mean.sqrt() } else { 1.0 }
    };
    Sizes {
        u: (0..response.inputs).map(|j| size(&|c| c.u[j].norm_sqr())).collect(),
        y: (0..response.outputs).map(|i| size(&|c| c.y[i].norm_sqr())).collect(),
    }
}

/// The lines for given dead times; `plant` is the response of the plant at each line, scaled, dead times included.
pub(super) fn weighed(
    response: &MeasuredResponse,
    sizes: &Sizes,
    delays: &[usize],
    plant: &[Mat<c64>],
    shape: VarianceShape,
) -> WeighedLines {
    let (m, p) = (response.inputs, response.outputs);
    let covariances = covariances(response, sizes, plant, shape);
    let line = |k: usize| {
        let z = response.time.boundary(response.omega[k]);
        let real = z.im.abs() < 1e-9;
        let phase = |j: usize| z.conj().powu(delays[j] as u32);
        let column = |(column, c): (&Column, &Mat<c64>)| WeighedColumn {
            u: (0..m).map(|j| column.u[j] / sizes.u[j] * phase(j)).collect(),
            y: (0..p).map(|i| column.y[i] / sizes.y[i]).collect(),
            w: inverse_root(c) * Scale(c64::new(if real { 0.5_f64.sqrt() } else { 1.0 }, 0.0)),
        };
        WeighedLine { z, real, columns: response.lines[k].iter().zip(&covariances[k]).map(column).collect() }
    };
    WeighedLines { inputs: m, outputs: p, lines: (0..response.lines.len()).map(line).collect() }
}

/// Covariance of `Y - G U` of each line and experiment, scaled channels.
fn covariances(
    response: &MeasuredResponse,
    sizes: &Sizes,
    plant: &[Mat<c64>],
    shape: VarianceShape,
) -> Vec<Vec<Mat<c64>>> {
    let (m, p) = (response.inputs, response.outputs);
    let of = |k: usize, column: &Column| {
        let floor = |i: usize| (ROUNDING * column.y[i].norm() / sizes.y[i]).powi(2).max(1e-30);
        let rest = output_rest(plant[k].as_ref());
        let mut out = match response.degrees.is_none() && !response.proportional {
            true => {
                let [absolute, relative] = unknown(response, sizes, column, &rest);
                absolute * Scale(c64::new(shape.absolute, 0.0)) + relative * Scale(c64::new(shape.relative, 0.0))
            }
            false => {
                let scale = |i: usize| if i < m { sizes.u[i] } else { sizes.y[i - m] };
                let c = Mat::from_fn(m + p, m + p, |i, j| column.covariance[(i, j)] / (scale(i) * scale(j)));
                &rest * &c * rest.adjoint()
            }
        };
        (0..p).for_each(|i| out[(i, i)] += floor(i));
        out
    };
    let all: Vec<Vec<Mat<c64>>> =
        response.lines.iter().enumerate().map(|(k, line)| line.iter().map(|c| of(k, c)).collect()).collect();
    match response.degrees {
        Some(degrees) if degrees.is_finite() => smoothed(&all, 0.5 * degrees),
        _ => all,
    }
}

/// Covariance of `Y - G U` for errors of every signal as large as its size, and as large as its value.
pub(super) fn unknown(response: &MeasuredResponse, sizes: &Sizes, column: &Column, rest: &Mat<c64>) -> [Mat<c64>; 2] {
    let m = response.inputs;
    let through = |of: &dyn Fn(usize) -> f64| {
        let weighed = Mat::from_fn(rest.nrows(), rest.ncols(), |i, j| rest[(i, j)] * of(j));
        &weighed * rest.adjoint()
    };
    let exact = |j: usize| j < m && response.exact_inputs;
    let value =
        |j: usize| if j < m { column.u[j].norm() / sizes.u[j] } else { column.y[j - m].norm() / sizes.y[j - m] };
    [through(&|j| if exact(j) { 0.0 } else { 1.0 }), through(&|j| if exact(j) { 0.0 } else { value(j).powi(2) })]
}

/// Means over experiments and neighbouring lines, so that the inverse has the mean of the inverse of the true covariance.
fn smoothed(all: &[Vec<Mat<c64>>], degrees: f64) -> Vec<Vec<Mat<c64>>> {
    let (count, p) = (all.len(), all[0][0].nrows());
    let half = ((DEGREES / degrees - 1.0) / 2.0).ceil().max(0.0) as usize;
    let at = |k: usize| {
        let near = k.saturating_sub(half)..(k + half + 1).min(count);
        let found = degrees * near.len() as f64;
        // E (C^-1) of a complex Wishart matrix with so many degrees of freedom
        let bias = found / (found - p as f64).max(1.0);
        let number = near.clone().map(|l| all[l].len()).sum::<usize>() as f64;
        let sum = near.flat_map(|l| &all[l]).fold(Mat::zeros(p, p), |sum: Mat<c64>, c| sum + c);
        vec![sum * Scale(c64::new(bias / number, 0.0)); all[k].len()]
    };
    (0..count).map(at).collect()
}

/// W with `W^H W = C^-1`.
fn inverse_root(c: &Mat<c64>) -> Mat<c64> {
    let p = c.nrows();
    match c.llt(Side::Lower) {
        Ok(factor) => {
            let mut w = Mat::<c64>::identity(p, p);
            factor.L().solve_lower_triangular_in_place(&mut w);
            w
        }
        // outputs whose noise is the same count apart
        Err(_) => {
            Mat::from_fn(p, p, |i, j| if i == j { c64::new(c[(i, i)].re.sqrt().recip(), 0.0) } else { c64::ZERO })
        }
    }
}

impl WeighedLines {
    /// Every k-th line, weighed for those between, so that at most so many are left.
    pub(super) fn thinned(mut self, most: usize) -> Self {
        let every = self.lines.len().div_ceil(most.max(1));
        if every > 1 {
            self.lines = self.lines.into_iter().step_by(every).collect();
            let weight = Scale(c64::new((every as f64).sqrt(), 0.0));
            self.lines.iter_mut().flat_map(|l| &mut l.columns).for_each(|c| c.w = &c.w * weight);
        }
        self
    }

    /// Real numbers that the lines hold.
    pub(super) fn rows(&self) -> usize {
        self.lines.iter().map(|l| l.columns.len() * self.outputs * if l.real { 1 } else { 2 }).sum()
    }

    /// Residuals `W (Y - G U)` times root 2, experiment after experiment, of one line.
    pub(super) fn residuals(&self, line: &WeighedLine, model: &Model) -> Vec<Vec<c64>> {
        let g = model.response(line.z);
        line.columns.iter().map(|c| c.whitened(&c.rest(&g, self.inputs))).collect()
    }

    /// Sum of squares of the residuals: -2 log likelihood up to a constant.
    pub(super) fn energy(&self, model: &Model) -> f64 {
        let of = |line: &WeighedLine| self.residuals(line, model).iter().flatten().map(|r| r.norm_sqr()).sum::<f64>();
        self.lines.iter().map(of).sum()
    }
}

impl WeighedColumn {
    /// `Y - G U`
    pub(super) fn rest(&self, g: &[c64], m: usize) -> Vec<c64> {
        let of = |(i, y): (usize, &c64)| (0..m).fold(*y, |sum, j| sum - g[i * m + j] * self.u[j]);
        self.y.iter().enumerate().map(of).collect()
    }

    /// `sqrt(2) W v`
    pub(super) fn whitened(&self, v: &[c64]) -> Vec<c64> {
        let of = |i: usize| (0..=i).fold(c64::ZERO, |sum, j| sum + self.w[(i, j)] * v[j]) * std::f64::consts::SQRT_2;
        (0..v.len()).map(of).collect()
    }
}
