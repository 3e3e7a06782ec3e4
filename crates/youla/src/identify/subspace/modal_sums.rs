//! The triangular factor of the modal regressors from sums of products, without their rows.
//!
//! The modes obey `z+ = Lambda z + u` (for x0 without u), so that their second moments follow from those with the inputs alone:
//! ```text
//! P = sum z z^H,   C = sum z u',   U = sum u u'
//! P - Lambda P Lambda^H = z(0) z(0)^H - z(N) z(N)^H + Lambda C + C^H Lambda^H + U        (entry by entry; also with z z')
//! ```
//! A sample costs two multiplications per mode and one per mode and channel, where the factor of the rows costs the square
//! of their number. Like every Gram matrix this one squares the condition number: [`Sums::factor`] says where that is too much.
//!
//! The samples are dealt to lanes that start from zero; what a lane's true start adds is linear in it, and is added when
//! the lanes are joined.

use super::gram::LIMIT;
use crate::linalg::triangular_condition;
use crate::{Mat, MatRef, c64};
use faer::linalg::matmul::matmul;
use faer::{Accum, Par, Side};
use pulp::{Arch, NullaryFnOnce};
use rayon::prelude::*;

/// Samples whose modes are held at a time: they stay in the first- or second-level cache.
const PIECE: usize = 256;
/// Samples of a lane.
const LANE: usize = 2048;
/// Least `|1 - lambda lambda'|`: fewer digits are lost than by the largest condition number.
const DECAYING: f64 = 1e-7;

/// Numbers below this are zero; it keeps decaying modes out of the slow subnormal range.
const VANISHED: f64 = 1e-150;

/// What a lane that starts from zero leaves behind; group 0 starts from one and is not driven, group q + 1 is driven by
/// input q. Complex numbers as real and imaginary rows.
struct Lane {
    /// `sum z w'`, `w = [u; beside]`.
    products: Mat<f64>,
    /// z behind the last sample.
    end: Vec<c64>,
}

/// Sums over the samples taken in.
pub(super) struct Sums<'a> {
    lambda: &'a [c64],
    inputs: usize,
    /// State of every group and mode at the first sample, and behind the last one taken in.
    start: Vec<c64>,
    end: Vec<c64>,
    /// `sum z w'`: a row per group and mode, a column per channel of `[u; beside]`.
    products: Mat<c64>,
    /// `sum w w'`.
    channels: Mat<f64>,
}

impl<'a> Sums<'a> {
    /// Whether all modes decay fast enough.
    pub(super) fn can_be_of(lambda: &[c64]) -> bool {
        lambda.iter().all(|l| 1.0 - l.norm_sqr() >= DECAYING)
    }

    /// Of no samples.
    pub(super) fn new(lambda: &'a [c64], inputs: usize, beside: usize) -> Self {
        let (width, modes) = (inputs + beside, lambda.len());
        let count = (inputs + 1) * modes;
        let start: Vec<c64> = (0..count).map(|a| c64::new(f64::from(u8::from(a < modes)), 0.0)).collect();
        let (products, channels) = (Mat::zeros(count, width), Mat::zeros(width, width));
        Sums { lambda, inputs, end: start.clone(), start, products, channels }
    }

    /// Takes in the next samples.
    pub(super) fn add(&mut self, u: MatRef<'_, f64>, beside: MatRef<'_, f64>) {
        let (samples, modes) = (u.nrows(), self.lambda.len());
        let lanes = samples.div_ceil(LANE);
        let cut = |l: usize| l * samples / lanes;
        let parts: Vec<Lane> = (0..lanes)
            .into_par_iter()
            .map(|l| {
                let (from, count) = (cut(l), cut(l + 1) - cut(l));
                let (u, beside) = (u.subrows(from, count), beside.subrows(from, count));
                Arch::new().dispatch(LaneOf { lambda: self.lambda, u, beside })
            })
            .collect();
        let (count, width) = (self.start.len(), self.channels.ncols());
        for (l, part) in parts.iter().enumerate() {
            let sum = |a: usize, w: usize| c64::new(part.products[(a, w)], part.products[(count + a, w)]);
            let steps = (cut(l + 1) - cut(l)) as i32;
            for a in 0..count {
                let driven = a >= modes;
                for w in 0..width {
                    let own = if driven { sum(a, w) } else { c64::new(0.0, 0.0) };
                    self.products[(a, w)] += own + self.end[a] * sum(a % modes, w);
                }
                let own = if driven { part.end[a] } else { c64::new(0.0, 0.0) };
                self.end[a] = own + self.lambda[a % modes].powi(steps) * self.end[a];
            }
        }
        for (i, left) in u.col_iter().chain(beside.col_iter()).enumerate() {
            for (j, right) in u.col_iter().chain(beside.col_iter()).enumerate().skip(i) {
                self.channels[(i, j)] += left.transpose() * right;
                self.channels[(j, i)] = self.channels[(i, j)];
            }
        }
    }

    /// R over `[z of x0 | z of every input | beside]`, pairs as real and imaginary part; `None` where the squared condition
    /// number would cost too many digits.
    pub(super) fn factor(&self, initial: bool) -> Option<Mat<f64>> {
        let gram = self.gram(initial);
        let n = gram.nrows();
        let length: Vec<f64> = (0..n).map(|j| gram[(j, j)].sqrt()).collect();
        let unit = Mat::from_fn(n, n, |i, j| gram[(i, j)] / (length[i] * length[j]));
        let cholesky = unit.llt(Side::Lower).ok()?;
        let lower = cholesky.L();
        let well_conditioned = triangular_condition(lower) <= LIMIT;
        well_conditioned.then(|| Mat::from_fn(n, n, |i, j| if i <= j { lower[(j, i)] * length[j] } else { 0.0 }))
    }

    /// The real Gram matrix of the columns that are sought.
    fn gram(&self, initial: bool) -> Mat<f64> {
        let modes = self.lambda.len();
        let first = if initial { 0 } else { modes };
        let columns: Vec<Column> = (first..(self.inputs + 1) * modes)
            .flat_map(|a| {
                let imaginary = (self.lambda[a % modes].im != 0.0).then_some(Column::Imaginary(a));
                [Some(Column::Real(a)), imaginary].into_iter().flatten()
            })
            .chain((self.inputs..self.channels.ncols()).map(Column::Channel))
            .collect();
        let mut gram = Mat::zeros(columns.len(), columns.len());
        for (i, left) in columns.iter().enumerate() {
            for (j, right) in columns.iter().enumerate().skip(i) {
                gram[(i, j)] = self.product(*left, *right);
                gram[(j, i)] = gram[(i, j)];
            }
        }
        gram
    }

    /// With `z_a = x + i y`, `z_b = s + i t`: `2 x s = Re(Q + P)`, `2 y t = Re(P - Q)`, `2 x t = Im(Q - P)`, `2 y s = Im(Q + P)`.
    fn product(&self, left: Column, right: Column) -> f64 {
        match (left, right) {
            (Column::Channel(i), Column::Channel(j)) => self.channels[(i, j)],
            (Column::Real(a), Column::Channel(w)) | (Column::Channel(w), Column::Real(a)) => self.products[(a, w)].re,
            (Column::Imaginary(a), Column::Channel(w)) | (Column::Channel(w), Column::Imaginary(a)) => {
                self.products[(a, w)].im
            }
            (Column::Real(a), Column::Real(b)) => 0.5 * (self.moment(a, b, false) + self.moment(a, b, true)).re,
            (Column::Imaginary(a), Column::Imaginary(b)) => {
                0.5 * (self.moment(a, b, true) - self.moment(a, b, false)).re
            }
            (Column::Real(a), Column::Imaginary(b)) => 0.5 * (self.moment(a, b, false) - self.moment(a, b, true)).im,
            (Column::Imaginary(a), Column::Real(b)) => 0.5 * (self.moment(a, b, false) + self.moment(a, b, true)).im,
        }
    }

    /// `sum z_a z_b`, or `sum z_a conj(z_b)`.
    fn moment(&self, a: usize, b: usize, conjugate: bool) -> c64 {
        let modes = self.lambda.len();
        let second = |z: c64| if conjugate { z.conj() } else { z };
        let (la, lb) = (self.lambda[a % modes], second(self.lambda[b % modes]));
        let mut sum = self.start[a] * second(self.start[b]) - self.end[a] * second(self.end[b]);
        let (driver_a, driver_b) = ((a / modes).checked_sub(1), (b / modes).checked_sub(1));
        if let Some(q) = driver_b {
            sum += la * self.products[(a, q)];
        }
        if let Some(q) = driver_a {
            sum += lb * second(self.products[(b, q)]);
        }
        if let (Some(q), Some(r)) = (driver_a, driver_b) {
            sum += c64::new(self.channels[(q, r)], 0.0);
        }
        sum / (c64::new(1.0, 0.0) - la * lb)
    }
}

/// A column of the regressors.
#[derive(Clone, Copy)]
enum Column {
    /// Real part of a mode of a group.
    Real(usize),
    /// Its imaginary part.
    Imaginary(usize),
    /// A signal beside them.
    Channel(usize),
}

/// The samples of a lane, for the widest registers of the processor.
struct LaneOf<'a> {
    lambda: &'a [c64],
    u: MatRef<'a, f64>,
    beside: MatRef<'a, f64>,
}

impl NullaryFnOnce for LaneOf<'_> {
    type Output = Lane;

    #[inline(always)]
    fn call(self) -> Lane {
        let LaneOf { lambda, u, beside } = self;
        let (inputs, modes) = (u.ncols(), lambda.len());
        let count = (inputs + 1) * modes;
        let part = |of: fn(&c64) -> f64| -> Vec<f64> { lambda.iter().map(of).cycle().take(count).collect() };
        let (lambda_re, lambda_im) = (part(|l| l.re), part(|l| l.im));
        let mut drive = vec![0.0; count];
        let mut now = vec![0.0; 2 * count];
        now[..modes].fill(1.0);
        let mut held = vec![0.0; 2 * count * PIECE];
        let mut products = Mat::zeros(2 * count, inputs + beside.ncols());
        for from in (0..u.nrows()).step_by(PIECE) {
            let samples = PIECE.min(u.nrows() - from);
            for (k, column) in held.chunks_exact_mut(2 * count).take(samples).enumerate() {
                column.copy_from_slice(&now);
                for (q, drive) in drive[modes..].chunks_exact_mut(modes).enumerate() {
                    drive.fill(u[(from + k, q)]);
                }
                let (re, im) = now.split_at_mut(count);
                for a in 0..count {
                    let (x, y) = (re[a], im[a]);
                    re[a] = lambda_re[a] * x - lambda_im[a] * y + drive[a];
                    im[a] = lambda_im[a] * x + lambda_re[a] * y;
                }
            }
            now.iter_mut().filter(|v| v.abs() < VANISHED).for_each(|v| *v = 0.0);
            let z = MatRef::from_column_major_slice(&held[..2 * count * samples], 2 * count, samples);
            let (into_u, into_beside) = products.as_mut().split_at_col_mut(inputs);
            for (into, channels) in [(into_u, u), (into_beside, beside)] {
                matmul(into, Accum::Add, z, channels.subrows(from, samples), 1.0, Par::Seq);
            }
        }
        Lane { products, end: (0..count).map(|a| c64::new(now[a], now[count + a])).collect() }
    }
}
