//! The triangular factor of block-Hankel data from their Gram matrix, which lag sums give.
//!
//! With `z(t) = [u(t); y(t); w(t)]` (w: known disturbances, projected out in the end), q channels, b block rows and T Hankel
//! columns, block (i, j) of the Gram matrix is
//! ```text
//! G(i, j) = sum_{t < T} z(t + i) z(t + j)',    G(i + 1, j + 1) = G(i, j) - z(i) z(j)' + z(T + i) z(T + j)'
//! ```
//! so the first block row gives all others: about b times less work than the product of the Hankel matrix with itself
//! (V. Sima, SLICOT working note 2000-4). The Cholesky factor squares the condition number k of the data: its relative error
//! is about `1e-16 k^2`, and beyond [`LIMIT`] the data are factored directly.

use crate::identify::subspace::records::disturbance::{self, Beyond};
use crate::identify::subspace::records::view::View;
use crate::linalg::triangular_condition;
use crate::{Mat, MatRef};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::matmul;
use faer::{Accum, Par};
use rayon::prelude::*;

/// Largest condition number of the data, columns of unit length, with which the factor of the Gram matrix is taken.
pub(crate) const LIMIT: f64 = 1e4;

/// Samples of one channel in a frame times the channels: the rows of a product that fill the registers well.
const FRAME: usize = 64;
/// Samples copied at a time: frames and what they look ahead stay in the second-level cache.
const CHUNK: usize = 2048;
/// Lanes that may run at the same time; fixed, so that the result does not depend on the threads.
const LANES: usize = 16;

/// R and the condition number of the data behind it.
pub(crate) struct GramFactor {
    pub(crate) r: Mat<f64>,
    /// Known disturbances that were much larger than what they left count in it, by what their removal costs in digits.
    pub(crate) condition: f64,
    /// Directions of all Hankel columns that known disturbances took.
    pub(crate) taken: usize,
}

/// The upper triangle of the Gram matrix of all experiments, by blocks of all channels, beyond the known disturbances.
pub(crate) struct Gram {
    /// Without rows before the first experiment.
    matrix: Mat<f64>,
    /// The diagonal before disturbances were taken out.
    before: Vec<f64>,
    taken: usize,
}

impl Gram {
    /// That of nothing yet, for `channels` channels of `[u; y]`.
    pub(crate) fn new(channels: usize, blocks: usize) -> Self {
        let width = channels * blocks;
        Gram { matrix: Mat::zeros(0, 0), before: vec![0.0; width], taken: 0 }
    }

    /// Adds a whole experiment.
    pub(crate) fn add(&mut self, view: View<'_>, blocks: usize) {
        let (q, h) = (view.u.ncols() + view.y.ncols(), view.w.ncols());
        let gram = of_experiment(view, blocks);
        let Beyond { gram, before, taken } = match h {
            0 => Beyond { before: (0..gram.nrows()).map(|i| gram[(i, i)]).collect(), gram, taken: 0 },
            _ => disturbance::beyond(gram.as_ref(), q, h, blocks),
        };
        self.before.iter_mut().zip(&before).for_each(|(sum, value)| *sum += value);
        match self.matrix.nrows() {
            0 => self.matrix = gram,
            _ => self.matrix += gram,
        }
        self.taken += taken;
    }

    /// R by Cholesky for the columns at `order`, (block row, channel) in one number; `None` where the Gram matrix is not
    /// positive definite to working precision.
    pub(crate) fn factor(&self, order: &[usize]) -> Option<GramFactor> {
        let gram = &self.matrix;
        let length: Vec<f64> = order.iter().map(|&c| gram[(c, c)].sqrt()).collect();
        if length.iter().any(|l| !l.is_normal()) {
            return None;
        }
        let mut unit = Mat::zeros(order.len(), order.len());
        for (j, &b) in order.iter().enumerate() {
            for (i, &a) in order.iter().enumerate().skip(j) {
                unit[(i, j)] = gram[(a.min(b), a.max(b))] / (length[i] * length[j]);
            }
        }
        let lower = cholesky(unit)?;
        let lower = lower.as_ref();
        let cancelled = |i: usize| self.before[i] / gram[(i, i)].max(f64::MIN_POSITIVE);
        let cancelled = (0..self.before.len()).map(cancelled).fold(1.0, f64::max);
        let upper = |i: usize, j: usize| if i <= j { lower[(j, i)] * length[j] } else { 0.0 };
        let (condition, r) =
            rayon::join(|| triangular_condition(lower), || Mat::from_fn(order.len(), order.len(), upper));
        Some(GramFactor { r, condition: condition * cancelled.sqrt(), taken: self.taken })
    }
}

/// L of a positive definite matrix given by its lower triangle, in its place; what is above the diagonal has no meaning.
fn cholesky(mut a: Mat<f64>) -> Option<Mat<f64>> {
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(a.nrows(), Par::Seq, Default::default()));
    let stack = MemStack::new(&mut memory);
    cholesky_in_place(a.as_mut(), Default::default(), Par::Seq, stack, Default::default()).ok()?;
    Some(a)
}

/// The Gram matrix of the Hankel data of known disturbances alone.
pub(crate) fn of_disturbance(view: View<'_>, blocks: usize) -> Mat<f64> {
    of_experiment(View { u: view.w.subcols(0, 0), y: view.w.subcols(0, 0), w: view.w }, blocks)
}

fn of_experiment(view: View<'_>, blocks: usize) -> Mat<f64> {
    let columns = view.samples() + 1 - blocks;
    let edge = |start: usize| interleaved(view.part(start, blocks - 1));
    from_lags(lag_sums(view, blocks, columns), &edge(0), &edge(columns), blocks)
}

/// The samples with all channels of each together.
fn interleaved(view: View<'_>) -> Vec<f64> {
    let mut values = vec![0.0; view.channels() * view.samples()];
    view.interleave(0, view.samples(), view.samples(), &mut values);
    values
}

/// The upper triangle of the Gram matrix from `[L_0 L_1 ...]` and the first and last b - 1 samples.
fn from_lags(lags: Mat<f64>, head: &[f64], tail: &[f64], blocks: usize) -> Mat<f64> {
    let q = lags.nrows();
    let mut gram = Mat::zeros(q * blocks, q * blocks);
    gram.as_mut().subrows_mut(0, q).copy_from(lags);
    for column in q..q * blocks {
        let (left, entered) = (head[column - q], tail[column - q]);
        let (before, mut here) = gram.as_mut().split_at_col_mut(column);
        let before = before.col(column - q);
        let mut here = here.as_mut().col_mut(0);
        for row in q..(column / q + 1) * q {
            here[row] = before[row - q] - head[row - q] * left + tail[row - q] * entered;
        }
    }
    gram
}

impl View<'_> {
    /// Number of channels of `[u; y; w]`.
    fn channels(&self) -> usize {
        self.u.ncols() + self.y.ncols() + self.w.ncols()
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
/// Frames of B samples are as columns of a matrix X, and with what they look ahead as columns of Y, which overlap in
/// memory; `X Y'` holds all products of samples up to b - 1 apart.
fn lag_sums(view: View<'_>, blocks: usize, columns: usize) -> Mat<f64> {
    let q = view.channels();
    let frame = FRAME.div_ceil(q);
    let frames = columns.div_ceil(frame);
    let lanes = LANES.min(columns.div_ceil(CHUNK));
    let products: Vec<Mat<f64>> = (0..lanes)
        .into_par_iter()
        .map(|lane| {
            let range = lane * frames / lanes..(lane + 1) * frames / lanes;
            Lane { view, q, frame, ahead: blocks - 1, columns }.products(range)
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

/// Some frames of one experiment, or of a part of it.
struct Lane<'a> {
    view: View<'a>,
    q: usize,
    /// Samples per frame.
    frame: usize,
    /// Samples that a frame looks ahead.
    ahead: usize,
    columns: usize,
}

impl Lane<'_> {
    /// `X Y'` over a range of frames, all but the last of which end within the columns.
    fn products(&self, frames: std::ops::Range<usize>) -> Mat<f64> {
        let (height, seen) = (self.q * self.frame, self.q * (self.frame + self.ahead));
        let at_once = CHUNK.div_ceil(self.frame);
        let mut z = vec![0.0; at_once * height + self.q * self.ahead];
        let mut products = Mat::zeros(height, seen);
        let mut add = |x: &[f64], z: &[f64], count: usize| {
            if count > 0 {
                let x = MatRef::from_column_major_slice(&x[..count * height], height, count);
                let y = MatRef::from_column_major_slice_with_stride(z, seen, count, height);
                matmul(products.as_mut(), Accum::Add, x, y.transpose(), 1.0, Par::Seq);
            }
        };
        for first in frames.clone().step_by(at_once) {
            let count = at_once.min(frames.end - first);
            let (start, samples) = (first * self.frame, count * self.frame);
            self.view.interleave(start, samples + self.ahead, self.view.samples(), &mut z);
            let whole = count.min(self.columns / self.frame - first);
            add(&z, &z, whole);
            if whole < count {
                let rest = &z[whole * height..];
                let mut last = rest[..height].to_vec();
                last[(self.columns % self.frame) * self.q..].fill(0.0);
                add(&last, rest, 1);
            }
        }
        products
    }
}
