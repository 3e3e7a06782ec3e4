//! The triangular factor of the block-Hankel data, `[U_f; U_p; Y_p; Y_f]' = Q R`.
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
    /// How R was found.
    pub(super) report: DataFactor,
}

impl HankelFactor {
    pub(super) fn new(data: &Channels, horizon: usize, factorisation: Factorisation) -> Result<Self> {
        let rows = RowMap::new(data, horizon);
        let width = 2 * horizon * (data.inputs + data.outputs);
        if rows.total < width {
            let found = data.experiments.iter().map(|e| e.u.nrows()).sum();
            let needed = found + width - rows.total;
            let what = format!("all experiments together, with a horizon of {horizon} block rows");
            return Err(Error::TooFewSamples { what, found, needed });
        }
        let (r, report) = factor(data, &rows, width, factorisation)?;
        let (inputs, outputs) = (data.inputs, data.outputs);
        let past = horizon * (2 * inputs + outputs);
        let rank = |columns| leading_rank(r.as_ref(), columns);
        let (input_rank, past_rank, present_rank) = (rank(2 * horizon * inputs), rank(past), rank(past + outputs));
        Ok(HankelFactor {
            inputs,
            outputs,
            horizon,
            columns: rows.total,
            input_rank,
            past_rank,
            present_rank,
            r,
            report,
        })
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

/// R by the way that was asked for; `Auto` takes the Gram matrix where it is well enough conditioned.
fn factor(
    data: &Channels,
    rows: &RowMap<'_>,
    width: usize,
    factorisation: Factorisation,
) -> Result<(Mat<f64>, DataFactor)> {
    let by_gram = match factorisation {
        Factorisation::Qr => None,
        _ => gram::factor(data, rows.horizon),
    };
    let condition = by_gram.as_ref().map_or(f64::INFINITY, |found| found.condition);
    match by_gram {
        Some(found) if factorisation == Factorisation::Gram || condition <= gram::LIMIT => {
            Ok((found.r, DataFactor { by: Factorisation::Gram, condition: Some(condition) }))
        }
        None if factorisation == Factorisation::Gram => {
            let what = "the Gram matrix of the block-Hankel data (take factorisation = \"qr\")".into();
            Err(Error::Singular { what, rcond: 0.0 })
        }
        found => Ok((
            triangular_factor(rows, width),
            DataFactor { by: Factorisation::Qr, condition: found.map(|found| found.condition) },
        )),
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
        HankelFactor::new(&data, horizon, by)
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
