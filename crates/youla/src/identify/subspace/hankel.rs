//! The triangular factor of the block-Hankel data, `[U_f; U_p; Y_p; Y_f]' = Q R`.
//!
//! Only R is formed, from pieces of a few thousand rows (one row per Hankel column). The rows are dealt to a fixed number
//! of lanes that depends on the data alone, so the result is the same on any number of threads.

use super::channels::Channels;
use crate::linalg::{Triangle, leading_rank};
use crate::{Error, Result};
use faer::{Mat, MatMut, MatRef};
use rayon::prelude::*;

/// Rows folded in at a time: large enough for blocked QR, small enough for the cache.
const PIECE: usize = 4000;
/// Lanes that may run at the same time.
const LANES: usize = 16;

/// The factor R and where its blocks are.
pub(super) struct HankelFactor {
    r: Mat<f64>,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    pub(super) horizon: usize,
    /// Columns of the Hankel matrices.
    pub(super) columns: usize,
    /// Directions spanned by `[U_f; U_p]`, and with `Y_p`, and with the first block row of `Y_f`.
    input_rank: usize,
    past_rank: usize,
    present_rank: usize,
}

impl HankelFactor {
    pub(super) fn new(data: &Channels, horizon: usize) -> Result<Self> {
        let rows = RowMap::new(data, horizon);
        let width = 2 * horizon * (data.inputs + data.outputs);
        if rows.total < width {
            let found = data.experiments.iter().map(|e| e.u.nrows()).sum();
            let needed = found + width - rows.total;
            let what = format!("all experiments together, with a horizon of {horizon} block rows");
            return Err(Error::TooFewSamples { what, found, needed });
        }
        let r = triangular_factor(&rows, width);
        let (inputs, outputs) = (data.inputs, data.outputs);
        let past = horizon * (2 * inputs + outputs);
        let rank = |columns| leading_rank(r.as_ref(), columns);
        let (input_rank, past_rank, present_rank) = (rank(2 * horizon * inputs), rank(past), rank(past + outputs));
        Ok(HankelFactor { inputs, outputs, horizon, columns: rows.total, input_rank, past_rank, present_rank, r })
    }

    /// Reciprocal condition number of the inputs' Hankel matrix with rows of unit length.
    pub(super) fn require_excitation(&self) -> Result<f64> {
        let needed = 2 * self.horizon * self.inputs;
        let inputs = self.r.as_ref().submatrix(0, 0, needed.min(self.r.nrows()), needed);
        let unit = Mat::from_fn(inputs.nrows(), needed, |i, j| {
            inputs[(i, j)] / inputs.col(j).norm_l2().max(f64::MIN_POSITIVE)
        });
        let sigma = unit.singular_values().map_err(|_| Error::NoConvergence {
            what: "the singular values of the input Hankel matrix".into(),
            iterations: 0,
        })?;
        let rank = sigma.iter().filter(|s| **s > 1e-12 * sigma[0]).count();
        if rank < needed {
            return Err(Error::NotExciting { rank, needed, horizon: self.horizon });
        }
        Ok(sigma[needed - 1] / sigma[0])
    }

    /// `R32`: what the past inputs and outputs tell about the future outputs beyond the future inputs, transposed.
    pub(super) fn future_by_past(&self) -> MatRef<'_, f64> {
        self.future_outputs().subrows(self.input_start(), self.past_rank - self.input_start())
    }

    /// The future outputs without what the future inputs explain, transposed: `[R32; R33]`.
    pub(super) fn future_beyond_inputs(&self) -> MatRef<'_, f64> {
        self.future_outputs().subrows(self.input_start(), self.r.nrows() - self.input_start())
    }

    /// Projection of the future outputs onto past and inputs, transposed.
    pub(super) fn future_projected(&self) -> MatRef<'_, f64> {
        self.future_outputs().subrows(0, self.past_rank)
    }

    /// Projection of the future outputs but for their first block row onto past, inputs and that block row, transposed.
    pub(super) fn later_future_projected(&self) -> MatRef<'_, f64> {
        let future = self.future_outputs();
        future.submatrix(0, self.outputs, self.present_rank, future.ncols() - self.outputs)
    }

    /// First block row of the future outputs, transposed.
    pub(super) fn present_outputs(&self) -> MatRef<'_, f64> {
        self.future_outputs().submatrix(0, 0, self.present_rank, self.outputs)
    }

    /// The future inputs, transposed.
    pub(super) fn future_inputs(&self) -> MatRef<'_, f64> {
        self.r.as_ref().submatrix(0, 0, self.present_rank, self.horizon * self.inputs)
    }

    fn future_outputs(&self) -> MatRef<'_, f64> {
        let count = self.horizon * self.outputs;
        self.r.as_ref().subcols(self.r.ncols() - count, count)
    }

    /// First direction beyond the future inputs.
    fn input_start(&self) -> usize {
        (self.horizon * self.inputs).min(self.input_rank)
    }
}

/// R of all Hankel columns, by lanes and then over the lanes. A factorisation that uses the displacement structure
/// can take the place of this function.
fn triangular_factor(rows: &RowMap<'_>, width: usize) -> Mat<f64> {
    let lanes = rows.total.div_ceil(PIECE).min(LANES);
    let parts: Vec<Mat<f64>> = (0..lanes)
        .into_par_iter()
        .map(|lane| lane_factor(rows, width, lane * rows.total / lanes, (lane + 1) * rows.total / lanes))
        .collect();
    let mut whole = Triangle::new(width, width);
    parts.iter().for_each(|part| whole.fold_rows(part.as_ref()));
    whole.r().to_owned()
}

fn lane_factor(rows: &RowMap<'_>, width: usize, start: usize, end: usize) -> Mat<f64> {
    let pieces = (end - start).div_ceil(PIECE);
    let cut = |k: usize| start + k * (end - start) / pieces;
    let mut triangle = Triangle::new(width, (end - start).div_ceil(pieces));
    for k in 0..pieces {
        triangle.fold(cut(k + 1) - cut(k), |piece| rows.fill(cut(k), piece));
    }
    triangle.r().to_owned()
}

/// The transposed Hankel matrix as a map: which samples of which experiment stand in which row.
struct RowMap<'a> {
    data: &'a Channels,
    horizon: usize,
    /// First row of each experiment.
    first: Vec<usize>,
    total: usize,
}

impl<'a> RowMap<'a> {
    fn new(data: &'a Channels, horizon: usize) -> Self {
        let mut total = 0;
        let mut first = Vec::new();
        for experiment in &data.experiments {
            first.push(total);
            total += experiment.u.nrows() + 1 - 2 * horizon;
        }
        RowMap { data, horizon, first, total }
    }

    /// Writes the rows `start ..` into `piece`.
    fn fill(&self, start: usize, mut piece: MatMut<'_, f64>) {
        let end = start + piece.nrows();
        for (e, signals) in self.data.experiments.iter().enumerate() {
            let from = self.first[e].max(start);
            let to = self.first.get(e + 1).copied().unwrap_or(self.total).min(end);
            if from < to {
                let part = piece.as_mut().subrows_mut(from - start, to - from);
                self.fill_from(signals.u.as_ref(), signals.y.as_ref(), from - self.first[e], part);
            }
        }
    }

    /// Writes `[U_f U_p Y_p Y_f]` for Hankel columns that begin at sample `time` of one experiment.
    fn fill_from(&self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, time: usize, mut part: MatMut<'_, f64>) {
        let (s, count) = (self.horizon, part.nrows());
        let mut column = 0;
        for (record, lag) in [(u, s), (u, 0), (y, 0), (y, s)] {
            for i in lag..lag + s {
                for q in 0..record.ncols() {
                    part.as_mut().col_mut(column).copy_from(record.col(q).subrows(time + i, count));
                    column += 1;
                }
            }
        }
    }
}
