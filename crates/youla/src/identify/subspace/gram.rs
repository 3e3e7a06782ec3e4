//! The triangular factor of block-Hankel data from their Gram matrix, which lag sums give.
//!
//! With `z(t) = [u(t); y(t); w(t)]` (w: known disturbances, projected out in the end), q channels, b block rows and T Hankel columns, block (i, j) of the Gram matrix is
//! ```text
//! G(i, j) = sum_{t < T} z(t + i) z(t + j)',    G(i + 1, j + 1) = G(i, j) - z(i) z(j)' + z(T + i) z(T + j)'
//! ```
//! so the first block row gives all others: about b times less work than the product of the Hankel matrix with itself
//! (V. Sima, SLICOT working note 2000-4). The Cholesky factor squares the condition number k of the data: its relative error
//! is about `1e-16 k^2`, and beyond [`LIMIT`] the data are factored directly.

use super::channels::{Channels, Signals};
use super::disturbance;
use crate::linalg::triangular_condition;
use crate::{Mat, MatRef};
use faer::linalg::matmul::matmul;
use faer::{Accum, Par, Side};
use rayon::prelude::*;

/// Largest condition number of the data, columns of unit length, with which the factor of the Gram matrix is taken.
pub(super) const LIMIT: f64 = 1e4;

/// Samples of one channel in a frame times the channels: the rows of a product that fill the registers well.
const FRAME: usize = 64;
/// Samples copied at a time: frames and what they look ahead stay in the second-level cache.
const CHUNK: usize = 4096;
/// Lanes that may run at the same time; fixed, so that the result does not depend on the threads.
const LANES: usize = 16;

/// R and the condition number of the data behind it.
pub(super) struct GramFactor {
    pub(super) r: Mat<f64>,
    /// Known disturbances that were much larger than what they left count in it, by what their removal costs in digits.
    pub(super) condition: f64,
    /// Directions of all Hankel columns that known disturbances took.
    pub(super) taken: usize,
}

/// R by Cholesky for the columns at `order`, (block row, channel) in one number; `None` where the Gram matrix is not
/// positive definite to working precision.
pub(super) fn factor(data: &Channels, blocks: usize, order: &[usize]) -> Option<GramFactor> {
    let Gram { matrix: gram, taken, cancelled } = gram(data, blocks);
    let length: Vec<f64> = order.iter().map(|&c| gram[(c, c)].sqrt()).collect();
    let unit = Mat::from_fn(order.len(), order.len(), |i, j| {
        let (a, b) = (order[i], order[j]);
        gram[(a.min(b), a.max(b))] / (length[i] * length[j])
    });
    let cholesky = unit.llt(Side::Lower).ok()?;
    let lower = cholesky.L();
    let condition = triangular_condition(lower) * cancelled.sqrt();
    let r = Mat::from_fn(order.len(), order.len(), |i, j| if i <= j { lower[(j, i)] * length[j] } else { 0.0 });
    Some(GramFactor { r, condition, taken })
}

/// The upper triangle of the Gram matrix of all experiments, by blocks of all channels, beyond the known disturbances.
struct Gram {
    matrix: Mat<f64>,
    taken: usize,
    /// Largest ratio of a squared length before and after the known disturbances were taken out, at least 1.
    cancelled: f64,
}

fn gram(data: &Channels, blocks: usize) -> Gram {
    let q = data.inputs + data.outputs;
    let mut whole = Gram { matrix: Mat::zeros(q * blocks, q * blocks), taken: 0, cancelled: 1.0 };
    let mut before = vec![0.0; q * blocks];
    for signals in &data.experiments {
        let all = of_experiment(signals, signals.channels(), blocks);
        if signals.w.ncols() == 0 {
            whole.matrix += all;
        } else {
            let beyond = disturbance::beyond(all.as_ref(), q, signals.w.ncols(), blocks);
            before.iter_mut().zip(&beyond.before).for_each(|(sum, value)| *sum += value);
            whole.matrix += beyond.gram;
            whole.taken += beyond.taken;
        }
    }
    for (i, before) in before.iter().enumerate() {
        whole.cancelled = whole.cancelled.max(before / whole.matrix[(i, i)].max(f64::MIN_POSITIVE));
    }
    whole
}

/// The Gram matrix of the Hankel data of known disturbances alone.
pub(super) fn of_disturbance(signals: &Signals, blocks: usize) -> Mat<f64> {
    let alone =
        Signals { u: Mat::zeros(signals.w.nrows(), 0), y: Mat::zeros(signals.w.nrows(), 0), w: signals.w.clone() };
    of_experiment(&alone, alone.channels(), blocks)
}

fn of_experiment(signals: &Signals, q: usize, blocks: usize) -> Mat<f64> {
    let columns = signals.u.nrows() + 1 - blocks;
    let mut gram = Mat::zeros(q * blocks, q * blocks);
    gram.as_mut().subrows_mut(0, q).copy_from(lag_sums(signals, q, blocks, columns));
    let value = |t: usize, c: usize| signals.value(t, c);
    for i in 1..blocks {
        for j in i..blocks {
            for (a, b) in (0..q).flat_map(|a| (0..q).map(move |b| (a, b))) {
                let left = value(i - 1, a) * value(j - 1, b);
                let entered = value(columns + i - 1, a) * value(columns + j - 1, b);
                gram[(i * q + a, j * q + b)] = gram[((i - 1) * q + a, (j - 1) * q + b)] - left + entered;
            }
        }
    }
    gram
}

impl Signals {
    /// Number of channels of `[u; y; w]`.
    fn channels(&self) -> usize {
        self.u.ncols() + self.y.ncols() + self.w.ncols()
    }

    /// Channel c of `[u; y; w]`.
    fn value(&self, t: usize, c: usize) -> f64 {
        let (m, q) = (self.u.ncols(), self.u.ncols() + self.y.ncols());
        match c {
            c if c < m => self.u[(t, c)],
            c if c < q => self.y[(t, c - m)],
            c => self.w[(t, c - q)],
        }
    }

    /// Writes `z(t)` for `count` samples from `start` on, all channels of a sample together, zero from `end` on.
    fn interleave(&self, start: usize, count: usize, end: usize, z: &mut [f64]) {
        let q = self.channels();
        let filled = count.min(end.saturating_sub(start));
        z[filled * q..count * q].fill(0.0);
        for (c, channel) in self.u.col_iter().chain(self.y.col_iter()).chain(self.w.col_iter()).enumerate() {
            let values = channel.subrows(start.min(channel.nrows()), filled);
            z.iter_mut().skip(c).step_by(q).zip(values.iter()).for_each(|(z, value)| *z = *value);
        }
    }
}

/// `[L_0 L_1 ...]`, `L_j = sum_{t < columns} z(t) z(t + j)'`, q x q each.
///
/// Frames of B samples stand as columns of a matrix X, and with what they look ahead as columns of Y, which overlap in
/// memory; `X Y'` holds all products of samples up to b - 1 apart.
fn lag_sums(signals: &Signals, q: usize, blocks: usize, columns: usize) -> Mat<f64> {
    let frame = FRAME.div_ceil(q);
    let frames = columns.div_ceil(frame);
    let lanes = LANES.min(columns.div_ceil(CHUNK));
    let products: Vec<Mat<f64>> = (0..lanes)
        .into_par_iter()
        .map(|lane| {
            let range = lane * frames / lanes..(lane + 1) * frames / lanes;
            Lane { signals, q, frame, ahead: blocks - 1, columns }.products(range)
        })
        .collect();
    let mut sums = Mat::zeros(q, q * blocks);
    for product in &products {
        for (r, column) in (0..frame).flat_map(|r| (0..q * blocks).map(move |column| (r, column))) {
            for a in 0..q {
                sums[(a, column)] += product[(r * q + a, r * q + column)];
            }
        }
    }
    sums
}

/// Some frames of one experiment.
struct Lane<'a> {
    signals: &'a Signals,
    q: usize,
    /// Samples per frame.
    frame: usize,
    /// Samples that a frame looks ahead.
    ahead: usize,
    columns: usize,
}

impl Lane<'_> {
    /// `X Y'` over a range of frames.
    fn products(&self, frames: std::ops::Range<usize>) -> Mat<f64> {
        let (height, seen) = (self.q * self.frame, self.q * (self.frame + self.ahead));
        let at_once = CHUNK.div_ceil(self.frame);
        let mut x = vec![0.0; at_once * height];
        let mut z = vec![0.0; at_once * height + self.q * self.ahead];
        let mut products = Mat::zeros(height, seen);
        for first in frames.clone().step_by(at_once) {
            let count = at_once.min(frames.end - first);
            let (start, samples) = (first * self.frame, count * self.frame);
            self.signals.interleave(start, samples, self.columns, &mut x);
            self.signals.interleave(start, samples + self.ahead, self.signals.u.nrows(), &mut z);
            let x = MatRef::from_column_major_slice(&x[..count * height], height, count);
            let y = MatRef::from_column_major_slice_with_stride(&z, seen, count, height);
            matmul(products.as_mut(), Accum::Add, x, y.transpose(), 1.0, Par::Seq);
        }
        products
    }
}
