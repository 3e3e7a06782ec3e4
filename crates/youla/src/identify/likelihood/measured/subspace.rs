//! Starts of all orders from one decomposition, in a variable that spreads the lines over the unit circle.
//!
//! With `w = (z - a) / (1 - a z)` the rows `[Y; w Y; ...; w^(q-1) Y] = O X + Gamma [U; w U; ...]`, O observable in w; U is projected out
//! and the noise whitened. A model `(A_w, C_w)` in w is in z
//! ```text
//! A = (A_w + a I) M,    C = C_w M (I - a A),    M = (I + a A_w)^-1.
//! ```
//! Lines far below the Nyquist frequency have powers of z that differ by rounding; powers of w do not.
//!
//! Source: T. McKelvey, H. Akçay, L. Ljung, Subspace-based multivariable system identification from frequency response data, IEEE Trans.
//! Autom. Control 41 (1996), 960; the map is that of discrete Laguerre functions.

use super::lines::WeighedLines;
use crate::identify::likelihood::search::model::Model;
use faer::linalg::solvers::DenseSolveCore;
use faer::prelude::*;
use faer::{Mat, Side, c64};

/// Singular values below this share of the largest end the orders.
const NEGLIGIBLE: f64 = 1e-12;

/// What all orders start from.
pub(super) struct Subspace {
    /// Observability matrix, one column for each state.
    observability: Mat<f64>,
    outputs: usize,
    inputs: usize,
    /// a
    warp: f64,
}

impl Subspace {
    /// `None` for too few lines.
    pub(super) fn new(lines: &WeighedLines, largest: usize) -> Option<Self> {
        let (m, p) = (lines.inputs, lines.outputs);
        let columns: usize = 2 * lines.lines.iter().map(|l| l.columns.len()).sum::<usize>();
        let depth = (3 * largest.div_ceil(p) / 2 + 4).min(columns / (2 * (m + p)).max(1));
        if depth < 2 {
            return None;
        }
        let warp = warp(lines);
        let (stacked, noise) = stacked(lines, depth, warp);
        let r = stacked.transpose().qr().thin_R().to_owned();
        let (inputs, outputs) = (depth * m, depth * p);
        if r.nrows() < inputs + 2 {
            return None;
        }
        let rest = r.submatrix(inputs, inputs, r.nrows() - inputs, outputs).transpose().to_owned();
        let root = noise.llt(Side::Lower).ok()?.L().to_owned();
        let mut whitened = rest;
        root.solve_lower_triangular_in_place(&mut whitened);
        let svd = whitened.svd().ok()?;
        let s = svd.S().column_vector();
        let count = (0..s.nrows().min(largest).min((depth - 1) * p)).take_while(|k| s[*k] > NEGLIGIBLE * s[0]).count();
        let observability = &root * svd.U().subcols(0, count);
        Some(Subspace { observability, outputs: p, inputs: m, warp })
    }

    /// Largest order.
    pub(super) fn orders(&self) -> usize {
        self.observability.ncols()
    }

    /// A and C of an order, B and D zero.
    pub(super) fn model(&self, order: usize) -> Option<Model> {
        let (p, rows) = (self.outputs, self.observability.nrows() - self.outputs);
        let o = self.observability.subcols(0, order);
        let a = o.subrows(0, rows).qr().solve_lstsq(o.subrows(p, rows));
        let identity = || Mat::<f64>::identity(order, order);
        let inverse = (identity() + &a * Scale(self.warp)).partial_piv_lu().inverse();
        let in_z = (&a + identity() * Scale(self.warp)) * &inverse;
        let c = o.subrows(0, p) * &inverse * (identity() - &in_z * Scale(self.warp));
        let finite = in_z.col_iter().chain(c.col_iter()).all(|x| x.iter().all(|v| v.is_finite()));
        finite.then(|| Model::without_inputs(in_z.as_ref(), c.as_ref(), self.inputs)).flatten()
    }
}

/// a such that the geometric mean of the frequencies comes to a quarter of the circle; lines that lie there already stay.
fn warp(lines: &WeighedLines) -> f64 {
    let angles: Vec<f64> = lines.lines.iter().map(|l| l.z.arg()).filter(|w| *w > 0.0).collect();
    let mean = (angles.iter().map(|w| w.ln()).sum::<f64>() / angles.len().max(1) as f64).exp();
    let stretch = (0.5 * mean).tan().recip().max(1.0);
    (stretch - 1.0) / (stretch + 1.0)
}

/// `[U; Y]` block rows, real and imaginary parts side by side, lines in units of their noise; and the covariance of the noise in Y.
fn stacked(lines: &WeighedLines, depth: usize, warp: f64) -> (Mat<f64>, Mat<f64>) {
    let (m, p) = (lines.inputs, lines.outputs);
    let count: usize = lines.lines.iter().map(|l| l.columns.len()).sum();
    let mut out = Mat::zeros(depth * (m + p), 2 * count);
    let mut noise = Mat::zeros(depth * p, depth * p);
    let mut at = 0;
    for line in &lines.lines {
        let w = (line.z - warp) / (1.0 - line.z * warp);
        let powers: Vec<c64> = (0..depth).map(|k| w.powu(k as u32)).collect();
        for column in &line.columns {
            let covariance = covariance(&column.w);
            let size = (0..p).map(|i| covariance[(i, i)].re).sum::<f64>().max(f64::MIN_POSITIVE).sqrt();
            for (k, power) in powers.iter().enumerate() {
                let mut write = |row: usize, value: c64| {
                    let value = power * value / size;
                    (out[(row, at)], out[(row, at + 1)]) = (value.re, value.im);
                };
                (0..m).for_each(|j| write(k * m + j, column.u[j]));
                (0..p).for_each(|i| write(depth * m + k * p + i, column.y[i]));
                for (l, other) in powers.iter().enumerate() {
                    let turn = power * other.conj() / (size * size);
                    for (i, j) in (0..p).flat_map(|i| (0..p).map(move |j| (i, j))) {
                        noise[(k * p + i, l * p + j)] += (turn * covariance[(i, j)]).re;
                    }
                }
            }
            at += 2;
        }
    }
    // rounding keeps the factor from existing where lines are few
    let mean = (0..depth * p).map(|i| noise[(i, i)]).sum::<f64>() / (depth * p) as f64;
    (0..depth * p).for_each(|i| noise[(i, i)] += 1e-9 * mean);
    (out, noise)
}

/// `W^-1 W^-H`
fn covariance(w: &Mat<c64>) -> Mat<c64> {
    let inverse = w.partial_piv_lu().inverse();
    &inverse * inverse.adjoint()
}
