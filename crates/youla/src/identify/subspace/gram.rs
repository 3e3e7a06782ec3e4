//! The triangular factor of block-Hankel data from their Gram matrix, which lag sums give.
//!
//! With `z(t) = [u(t); y(t)]`, q channels, b block rows and T Hankel columns, block (i, j) of the Gram matrix is
//! ```text
//! G(i, j) = sum_{t < T} z(t + i) z(t + j)',    G(i + 1, j + 1) = G(i, j) - z(i) z(j)' + z(T + i) z(T + j)'
//! ```
//! so the first block row gives all others: about b times less work than the product of the Hankel matrix with itself
//! (V. Sima, SLICOT working note 2000-4). The Cholesky factor squares the condition number k of the data: its relative error
//! is about `1e-16 k^2`, and beyond [`LIMIT`] the data are factored directly.

use super::batch::{Batch, Segment};
use crate::{Mat, MatRef};
use faer::linalg::matmul::matmul;
use faer::{Accum, Par, Side};
use rayon::prelude::*;
use std::ops::Range;

/// Largest condition number of the data, columns of unit length, with which the factor of the Gram matrix is taken.
pub(super) const LIMIT: f64 = 1e4;

/// Steps of the inverse iteration for the condition number; each costs two triangular solutions.
const STEPS: usize = 6;

/// Samples of one channel in a frame times the channels: the rows of a product that fill the registers well.
const FRAME: usize = 64;
/// Samples of a piece: its products stay in the second-level cache.
const PIECE: usize = 1 << 14;

/// R and the condition number of the data behind it.
pub(super) struct GramFactor {
    pub(super) r: Mat<f64>,
    pub(super) condition: f64,
}

/// Accumulates the Gram matrix of all experiments; of the samples it keeps the first of the current experiment alone.
pub(super) struct GramSums {
    channels: usize,
    blocks: usize,
    /// `[L_0 L_1 ...]` of the current experiment, `L_j = sum_{t < T} z(t) z(t + j)'`, q x q each.
    lags: Mat<f64>,
    /// The first b - 1 samples of the current experiment.
    head: Vec<f64>,
    /// Upper triangle by blocks, of the experiments that have ended.
    whole: Mat<f64>,
}

impl GramSums {
    pub(super) fn new(channels: usize, blocks: usize) -> Self {
        let width = channels * blocks;
        GramSums {
            channels,
            blocks,
            lags: Mat::zeros(channels, width),
            head: Vec::new(),
            whole: Mat::zeros(width, width),
        }
    }

    /// Takes in a batch, whose segments share b - 1 samples with the batch before.
    pub(super) fn add(&mut self, batch: &Batch) {
        let pieces: Vec<(usize, Range<usize>)> = batch
            .segments
            .iter()
            .enumerate()
            .flat_map(|(k, segment)| self.pieces(segment).map(move |r| (k, r)))
            .collect();
        let (q, blocks) = (self.channels, self.blocks);
        let products: Vec<Mat<f64>> = pieces
            .par_iter()
            .map(|(k, range)| lag_sums(batch.values(&batch.segments[*k]), q, blocks, range.clone()))
            .collect();
        let mut products = pieces.iter().zip(&products).peekable();
        for (k, segment) in batch.segments.iter().enumerate() {
            let values = batch.values(segment);
            if segment.begins {
                self.lags.fill(0.0);
                self.head = values[..values.len().min(q * (blocks - 1))].to_vec();
            }
            while let Some((_, product)) = products.next_if(|((owner, _), _)| *owner == k) {
                self.lags += product;
            }
            if segment.ends {
                self.end(&values[values.len() - self.head.len()..]);
            }
        }
    }

    /// The columns of a segment, piece by piece, all but the last of whole frames.
    fn pieces(&self, segment: &Segment) -> impl Iterator<Item = Range<usize>> + use<> {
        let columns = (segment.samples() + 1).saturating_sub(self.blocks);
        let frame = FRAME.div_ceil(self.channels);
        let (pieces, frames) = (columns.div_ceil(PIECE), columns.div_ceil(frame));
        let cut = move |k: usize| (k * frames / pieces * frame).min(columns);
        (0..pieces).map(move |k| cut(k)..cut(k + 1))
    }

    /// Adds the experiment that ends with the b - 1 samples `tail`.
    fn end(&mut self, tail: &[f64]) {
        let (q, blocks, head) = (self.channels, self.blocks, &self.head);
        let mut gram: Mat<f64> = Mat::zeros(q * blocks, q * blocks);
        gram.as_mut().subrows_mut(0, q).copy_from(&self.lags);
        for i in 1..blocks {
            for j in i..blocks {
                for (a, b) in (0..q).flat_map(|a| (0..q).map(move |b| (a, b))) {
                    let (row, column) = ((i - 1) * q + a, (j - 1) * q + b);
                    let (left, entered) = (head[row] * head[column], tail[row] * tail[column]);
                    gram[(i * q + a, j * q + b)] = gram[(row, column)] - left + entered;
                }
            }
        }
        self.whole += gram;
    }

    /// R by Cholesky for the columns at `order`, (block row, channel) in one number; `None` where the Gram matrix is not
    /// positive definite to working precision.
    pub(super) fn factor(&self, order: &[usize]) -> Option<GramFactor> {
        let gram = &self.whole;
        let length: Vec<f64> = order.iter().map(|&c| gram[(c, c)].sqrt()).collect();
        if length.iter().any(|l| !l.is_normal()) {
            return None;
        }
        let unit = Mat::from_fn(order.len(), order.len(), |i, j| {
            let (a, b) = (order[i], order[j]);
            gram[(a.min(b), a.max(b))] / (length[i] * length[j])
        });
        let cholesky = unit.llt(Side::Lower).ok()?;
        let lower = cholesky.L();
        let condition = condition(lower);
        let r = Mat::from_fn(order.len(), order.len(), |i, j| if i <= j { lower[(j, i)] * length[j] } else { 0.0 });
        Some(GramFactor { r, condition })
    }
}

/// `[L_0 L_1 ...]` of the samples t in `range`; `values` holds them and those after them.
///
/// Frames of B samples stand as columns of a matrix X, and with what they look ahead as columns of Y. Both are views of the
/// samples, those of Y overlap; `X Y'` holds all products of samples up to b - 1 apart.
fn lag_sums(values: &[f64], q: usize, blocks: usize, range: Range<usize>) -> Mat<f64> {
    let frame = FRAME.div_ceil(q);
    let (height, seen) = (q * frame, q * (frame + blocks - 1));
    let whole = range.len() / frame;
    let values = &values[range.start * q..];
    let mut products = Mat::zeros(height, seen);
    if whole > 0 {
        let x = MatRef::from_column_major_slice(&values[..whole * height], height, whole);
        let y = MatRef::from_column_major_slice_with_stride(values, seen, whole, height);
        matmul(products.as_mut(), Accum::Add, x, y.transpose(), 1.0, Par::Seq);
    }
    let mut sums = Mat::zeros(q, q * blocks);
    for (r, column) in (0..frame).flat_map(|r| (0..q * blocks).map(move |column| (r, column))) {
        for a in 0..q {
            sums[(a, column)] += products[(r * q + a, r * q + column)];
        }
    }
    for t in whole * frame..range.len() {
        let now = MatRef::from_column_major_slice(&values[t * q..(t + 1) * q], q, 1);
        let ahead = MatRef::from_row_major_slice(&values[t * q..(t + blocks) * q], 1, q * blocks);
        matmul(sums.as_mut(), Accum::Add, now, ahead, 1.0, Par::Seq);
    }
    sums
}

/// Ratio of the largest to the smallest singular value of a lower triangular matrix whose rows have unit length, by inverse
/// iteration: at most the true one, and close to it.
fn condition(lower: MatRef<'_, f64>) -> f64 {
    let n = lower.nrows();
    let largest = largest_singular(n, |v| lower.transpose() * (lower * v));
    let smallest = largest_singular(n, |mut v| {
        lower.solve_lower_triangular_in_place(v.as_mut());
        lower.transpose().solve_upper_triangular_in_place(v.as_mut());
        v
    });
    largest * smallest
}

/// Square root of the largest eigenvalue of a symmetric positive definite map, by the power method from a fixed vector
/// without structure.
fn largest_singular(n: usize, map: impl Fn(Mat<f64>) -> Mat<f64>) -> f64 {
    let mut v = Mat::from_fn(n, 1, |i, _| 1.0 + 0.5 * (1.7 * i as f64 + 0.3 * (i * i % 7) as f64).sin());
    let mut value = 0.0;
    for _ in 0..STEPS {
        let length = v.norm_l2();
        v = map(faer::Scale(1.0 / length) * v);
        value = v.norm_l2();
    }
    value.sqrt()
}
