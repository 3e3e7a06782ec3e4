//! The triangular factor R of block-Hankel data, and `[U_f; U_p; Y_p; Y_f]' = Q R` for the open-loop methods.
//!
//! Only R is formed, from pieces of a few thousand rows (one row per Hankel column). The rows are dealt to a fixed number
//! of lanes that depends on the data alone, so the result is the same on any number of threads.

use super::channels::Channels;
use super::gram;
use super::{DataFactor, Factorisation};
use crate::linalg::{Triangle, leading_rank};
use crate::{Error, Result};
use faer::{Mat, MatMut, MatRef};
use rayon::prelude::*;
use std::ops::Range;

/// Rows folded in at a time: large enough for blocked QR, small enough for the cache.
const PIECE: usize = 4000;
/// Lanes that may run at the same time.
const LANES: usize = 16;

/// The factor R and where its blocks are.
pub(super) struct HankelFactor {
    r: Mat<f64>,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// Block rows of the past and of the future.
    past: usize,
    pub(super) horizon: usize,
    /// Columns of the Hankel matrices.
    pub(super) columns: usize,
    /// Directions spanned by `[U_f; U_p]`, and with `Y_p`, and with the first block row of `Y_f`.
    input_rank: usize,
    past_rank: usize,
    present_rank: usize,
    /// How R was found.
    pub(super) report: DataFactor,
}

impl HankelFactor {
    pub(super) fn new(data: &Channels, past: usize, horizon: usize, factorisation: Factorisation) -> Result<Self> {
        let (inputs, outputs) = (data.inputs, data.outputs);
        let DataTriangle { r, columns, report } =
            factor(data, (past, horizon), &inputs_first(data, past, horizon), factorisation)?;
        let all_inputs = (past + horizon) * inputs;
        let before_future = all_inputs + past * outputs;
        let rank = |columns| leading_rank(r.as_ref(), columns);
        let (input_rank, past_rank, present_rank) =
            (rank(all_inputs), rank(before_future), rank(before_future + outputs));
        Ok(HankelFactor { inputs, outputs, past, horizon, columns, input_rank, past_rank, present_rank, r, report })
    }

    /// Reciprocal condition number of the inputs' Hankel matrix with rows of unit length.
    pub(super) fn require_excitation(&self) -> Result<f64> {
        let needed = (self.past + self.horizon) * self.inputs;
        let inputs = self.r.as_ref().submatrix(0, 0, needed.min(self.r.nrows()), needed);
        require_excitation(inputs, self.horizon)
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

/// Reciprocal condition number of the inputs' Hankel matrix with rows of unit length, from their columns of R.
pub(super) fn require_excitation(inputs: MatRef<'_, f64>, horizon: usize) -> Result<f64> {
    let needed = inputs.ncols();
    let unit =
        Mat::from_fn(inputs.nrows(), needed, |i, j| inputs[(i, j)] / inputs.col(j).norm_l2().max(f64::MIN_POSITIVE));
    let sigma = unit.singular_values().map_err(|_| Error::NoConvergence {
        what: "the singular values of the input Hankel matrix".into(),
        iterations: 0,
    })?;
    let rank = sigma.iter().filter(|s| **s > 1e-12 * sigma[0]).count();
    if rank < needed {
        return Err(Error::NotExciting { rank, needed, horizon });
    }
    Ok(sigma[needed - 1] / sigma[0])
}

/// Columns `[U_f U_p Y_p Y_f]`, as places: (block row, channel of `[u; y]`) in one number.
fn inputs_first(data: &Channels, past: usize, horizon: usize) -> Vec<usize> {
    let (m, p) = (data.inputs, data.outputs);
    let block_rows = |rows: Range<usize>, channels: Range<usize>| {
        rows.flat_map(move |i| channels.clone().map(move |c| i * (m + p) + c))
    };
    let (before, after) = (0..past, past..past + horizon);
    block_rows(after.clone(), 0..m)
        .chain(block_rows(before.clone(), 0..m))
        .chain(block_rows(before, m..m + p))
        .chain(block_rows(after, m..m + p))
        .collect()
}

/// R of block-Hankel data.
pub(super) struct DataTriangle {
    pub(super) r: Mat<f64>,
    /// Columns of the Hankel matrix.
    pub(super) columns: usize,
    /// How R was found.
    pub(super) report: DataFactor,
}

/// R of the Hankel data with so many block rows of past and future, its columns in the order of `places`, by the way that
/// was asked for; `Auto` takes the Gram matrix where it is well enough conditioned.
pub(super) fn factor(
    data: &Channels,
    (past, horizon): (usize, usize),
    places: &[usize],
    factorisation: Factorisation,
) -> Result<DataTriangle> {
    let blocks = past + horizon;
    let rows = RowMap::new(data, blocks, places);
    let (columns, width) = (rows.total, places.len());
    if columns < width {
        let found = data.experiments.iter().map(|e| e.u.nrows()).sum();
        let what = format!("all experiments together, with a horizon of {horizon} and a past of {past} block rows");
        return Err(Error::TooFewSamples { what, found, needed: found + width - columns });
    }
    let by_gram = match factorisation {
        Factorisation::Qr => None,
        _ => gram::factor(data, blocks, places),
    };
    let condition = by_gram.as_ref().map_or(f64::INFINITY, |found| found.condition);
    match by_gram {
        Some(found) if factorisation == Factorisation::Gram || condition <= gram::LIMIT => {
            let report = DataFactor { by: Factorisation::Gram, condition: Some(condition) };
            Ok(DataTriangle { r: found.r, columns, report })
        }
        None if factorisation == Factorisation::Gram => {
            let what = "the Gram matrix of the block-Hankel data (take factorisation = \"qr\")".into();
            Err(Error::Singular { what, rcond: 0.0 })
        }
        found => {
            let report = DataFactor { by: Factorisation::Qr, condition: found.map(|found| found.condition) };
            Ok(DataTriangle { r: triangular_factor(&rows, width), columns, report })
        }
    }
}

/// R of all Hankel columns, by lanes and then over the lanes.
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
    places: &'a [usize],
    /// First row of each experiment.
    first: Vec<usize>,
    total: usize,
}

impl<'a> RowMap<'a> {
    fn new(data: &'a Channels, blocks: usize, places: &'a [usize]) -> Self {
        let mut total = 0;
        let mut first = Vec::new();
        for experiment in &data.experiments {
            first.push(total);
            total += experiment.u.nrows() + 1 - blocks;
        }
        RowMap { data, places, first, total }
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

    /// Writes the places of Hankel columns that begin at sample `time` of one experiment.
    fn fill_from(&self, u: MatRef<'_, f64>, y: MatRef<'_, f64>, time: usize, mut part: MatMut<'_, f64>) {
        let (count, inputs, channels) = (part.nrows(), u.ncols(), u.ncols() + y.ncols());
        for (column, place) in self.places.iter().enumerate() {
            let (block, channel) = (place / channels, place % channels);
            let values = if channel < inputs { u.col(channel) } else { y.col(channel - inputs) };
            part.as_mut().col_mut(column).copy_from(values.subrows(time + block, count));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::subspace::{Experiment, SubspaceOptions};

    /// Two inputs and one output with noise, in experiments of unequal length.
    fn experiments(noise: f64) -> Vec<(Mat<f64>, Mat<f64>)> {
        let wave = |k: usize, seed: usize| ((k * k * (seed + 2) + 7 * k) as f64 * 0.37).sin();
        let experiment = |samples: usize, seed: usize| {
            let u = Mat::from_fn(samples, 2, |k, j| wave(k, seed + 3 * j));
            let mut y = Mat::zeros(samples, 1);
            for k in 2..samples {
                let clean = 1.6 * y[(k - 1, 0)] - 0.8 * y[(k - 2, 0)] + u[(k - 1, 0)] - 0.4 * u[(k - 2, 1)];
                y[(k, 0)] = clean + noise * wave(k, seed + 11);
            }
            (u, y)
        };
        vec![experiment(9000, 1), experiment(700, 2)]
    }

    fn factors(noise: f64, horizon: usize, by: Factorisation) -> Result<HankelFactor> {
        let records = experiments(noise);
        let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment { u: u.as_ref(), y: y.as_ref() }).collect();
        let data = Channels::new(&experiments, &SubspaceOptions { horizon, ..Default::default() })?;
        HankelFactor::new(&data, horizon, horizon, by)
    }

    /// Rows of R with a positive diagonal.
    fn normal(r: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] * r[(i, i)].signum())
    }

    #[test]
    fn gram_and_qr_give_the_same_factor() {
        for horizon in [2, 7, 20] {
            let [gram, qr] = [Factorisation::Auto, Factorisation::Qr].map(|by| factors(0.3, horizon, by).unwrap());
            assert_eq!((gram.report.by, qr.report.by), (Factorisation::Gram, Factorisation::Qr));
            let (one, other) = (normal(&gram.r), normal(&qr.r));
            let error = (&one - &other).norm_max() / other.norm_max();
            assert!(error < 1e-11, "horizon {horizon}: {error:.1e}");
            let sigma = Mat::from_fn(qr.r.ncols(), qr.r.ncols(), |i, j| qr.r[(i, j)] / qr.r.col(j).norm_l2());
            let sigma = sigma.singular_values().unwrap();
            let ratio = gram.report.condition.unwrap() / (sigma[0] / sigma[sigma.len() - 1]);
            assert!((0.5..1.0 + 1e-9).contains(&ratio), "horizon {horizon}: {ratio}");
        }
    }

    #[test]
    fn data_without_noise_are_left_to_qr() {
        let found = factors(0.0, 7, Factorisation::Auto).unwrap();
        assert_eq!(found.report.by, Factorisation::Qr);
        let refused = factors(0.0, 7, Factorisation::Gram);
        assert!(matches!(refused.err(), None | Some(Error::Singular { .. })));
        let nearly = factors(1e-6, 7, Factorisation::Auto).unwrap();
        assert_eq!(nearly.report.by, Factorisation::Qr);
        assert!(nearly.report.condition.is_some_and(|condition| condition > gram::LIMIT));
    }
}
