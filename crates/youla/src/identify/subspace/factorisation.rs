//! The triangular factor R of block-Hankel data, from which every weight, order and shorter horizon starts.
//!
//! Only R is formed, from the Gram matrix or from pieces of a few thousand rows (one row per Hankel column). The rows are
//! dealt to a fixed number of lanes that depends on the data alone, so the result is the same on any number of threads.

use super::channels::{Channels, Signals, View};
use super::disturbance;
use super::gram::{self, Gram, GramFactor};
use super::{DataFactor, Factorisation, SubspaceOptions};
use crate::linalg::{SequentialQr, leading_rank};
use crate::{Error, Result};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, Par, Side};
use rayon::prelude::*;
use std::ops::Range;

/// Rows folded in at a time: large enough for blocked QR, small enough for the cache.
const PIECE: usize = 4000;
/// Lanes that may run at the same time.
const LANES: usize = 16;

/// R of block-Hankel data.
pub(super) struct HankelLq {
    r: Mat<f64>,
    arrangement: HankelLayout,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// Block rows of the past and of the future.
    past: usize,
    horizon: usize,
    /// Columns of the Hankel matrix, less the directions that known disturbances take.
    pub(super) columns: usize,
    /// How R was found.
    pub(super) report: DataFactor,
}

/// In which order the rows of the block-Hankel matrix stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HankelLayout {
    /// `[U_f U_p Y_p Y_f]`.
    InputsFirst,
    /// `[z(k-p) ... z(k) ... z(k+f-1)]`, `z = [u; y]`.
    Chronological,
    /// `[z(k-1) ... z(k-p) y(k) u(k)]` for a future of one block row; with feedthrough u(k) first.
    NewestFirst {
        /// Whether u(k) is a regressor.
        feedthrough: bool,
    },
}

impl HankelLayout {
    /// From which the method of the options starts.
    pub(super) fn of(options: &SubspaceOptions) -> Self {
        match options.method.is_for_closed_loops() {
            true => HankelLayout::Chronological,
            false => HankelLayout::InputsFirst,
        }
    }

    /// Places of all rows, counted from the oldest sample: (block row, channel of `[u; y]`) in one number.
    fn places(self, inputs: usize, outputs: usize, past: usize, horizon: usize) -> Vec<usize> {
        let (m, q) = (inputs, inputs + outputs);
        let block_rows = |rows: Range<usize>, channels: Range<usize>| {
            rows.flat_map(move |i| channels.clone().map(move |c| i * q + c))
        };
        let (before, after) = (0..past, past..past + horizon);
        match self {
            HankelLayout::Chronological => (0..(past + horizon) * q).collect(),
            HankelLayout::NewestFirst { feedthrough } => {
                let lags = before.rev().flat_map(|i| block_rows(i..i + 1, 0..q));
                let (u, y) = (block_rows(after.clone(), 0..m), block_rows(after, m..q));
                match feedthrough {
                    true => u.chain(lags).chain(y).collect(),
                    false => lags.chain(y).chain(u).collect(),
                }
            }
            HankelLayout::InputsFirst => block_rows(after.clone(), 0..m)
                .chain(block_rows(before.clone(), 0..m))
                .chain(block_rows(before, m..q))
                .chain(block_rows(after, m..q))
                .collect(),
        }
    }
}

/// What stands in a column of the block-Hankel matrix.
pub(super) struct Frame {
    arrangement: HankelLayout,
    inputs: usize,
    outputs: usize,
    past: usize,
    horizon: usize,
    pub(super) places: Vec<usize>,
}

impl Frame {
    pub(super) fn new(
        (inputs, outputs): (usize, usize),
        (past, horizon): (usize, usize),
        arrangement: HankelLayout,
    ) -> Self {
        let places = arrangement.places(inputs, outputs, past, horizon);
        Frame { arrangement, inputs, outputs, past, horizon, places }
    }

    /// Block rows.
    pub(super) fn blocks(&self) -> usize {
        self.past + self.horizon
    }

    /// Refuses fewer Hankel columns than rows.
    pub(super) fn require(&self, samples: usize, columns: usize) -> Result<()> {
        let (horizon, past, width) = (self.horizon, self.past, self.places.len());
        if columns >= width {
            return Ok(());
        }
        let what = format!("all experiments together, with a horizon of {horizon} and a past of {past} block rows");
        Err(Error::TooFewSamples { what, found: samples, needed: samples + width - columns })
    }

    /// R with the channels of `[u; y]` divided by `scale`.
    pub(super) fn triangle(self, mut r: Mat<f64>, scale: &[f64], columns: usize, report: DataFactor) -> HankelLq {
        let Frame { arrangement, inputs, outputs, past, horizon, places } = self;
        for (column, place) in places.iter().enumerate() {
            let inverse = 1.0 / scale[place % (inputs + outputs)];
            r.col_mut(column).iter_mut().for_each(|value| *value *= inverse);
        }
        HankelLq { r, arrangement, inputs, outputs, past, horizon, columns, report }
    }
}

impl HankelLq {
    /// R of the data with so many block rows of past and future, by the way that was asked for; `Auto` takes the Gram matrix
    /// where it is well enough conditioned.
    pub(super) fn new(
        data: &Channels<'_>,
        blocks: (usize, usize),
        arrangement: HankelLayout,
        factorisation: Factorisation,
    ) -> Result<Self> {
        let frame = Frame::new((data.inputs, data.outputs), blocks, arrangement);
        let views = data.views();
        let samples = views.iter().map(View::samples).sum();
        let total = views.iter().map(|v| v.samples() + 1 - frame.blocks()).sum();
        frame.require(samples, total)?;
        let (r, report, taken) = factor(&views, &frame, factorisation)?;
        frame.require(samples, total - taken)?;
        Ok(frame.triangle(r, &data.scale_of_views(), total - taken, report))
    }

    /// In which order the rows stand.
    pub(super) fn arrangement(&self) -> HankelLayout {
        self.arrangement
    }

    /// R of the rows that a past and a future no longer than those of the data take, in the given order; the Hankel columns
    /// stay those of the data.
    pub(super) fn arranged(&self, arrangement: HankelLayout, past: usize, horizon: usize) -> Result<Mat<f64>> {
        for (what, asked, held) in [("the past", past, self.past), ("the horizon", horizon, self.horizon)] {
            if asked > held {
                let must = "at most that with which the data were factored";
                return Err(Error::OutOfRange { what: what.into(), value: asked as f64, must });
            }
        }
        if (arrangement, past, horizon) == (self.arrangement, self.past, self.horizon) {
            return Ok(self.r.clone());
        }
        let places =
            |arrangement: HankelLayout, past, horizon| arrangement.places(self.inputs, self.outputs, past, horizon);
        let held = places(self.arrangement, self.past, self.horizon);
        let mut column_of = vec![0; held.len()];
        held.iter().enumerate().for_each(|(column, place)| column_of[*place] = column);
        let oldest = (self.past - past) * (self.inputs + self.outputs);
        let wanted: Vec<usize> =
            places(arrangement, past, horizon).iter().map(|place| column_of[place + oldest]).collect();
        let mut triangle = SequentialQr::new(wanted.len(), self.r.nrows());
        triangle.fold(self.r.nrows(), |mut rows| {
            wanted.iter().enumerate().for_each(|(j, column)| rows.as_mut().col_mut(j).copy_from(self.r.col(*column)));
        });
        Ok(triangle.r().to_owned())
    }
}

/// The data with another weight on some of their Hankel columns.
pub(super) struct BlockWeights<'a> {
    data: &'a HankelLq,
    places: Vec<usize>,
    /// `R' R`, where R came from the Gram matrix.
    gram: Option<Mat<f64>>,
}

impl<'a> BlockWeights<'a> {
    pub(super) fn new(data: &'a HankelLq) -> Self {
        let places = data.arrangement.places(data.inputs, data.outputs, data.past, data.horizon);
        let gram = (data.report.by == Factorisation::Gram).then(|| data.r.transpose() * &data.r);
        BlockWeights { data, places, gram }
    }

    /// The factor of `R' R + step H' H` with the given Hankel columns H of one experiment.
    pub(super) fn raised(
        &self,
        experiments: &[Signals],
        experiment: usize,
        columns: Range<usize>,
        step: f64,
    ) -> Result<HankelLq> {
        let data = self.data;
        let rows = RowMap::new(experiments.iter().map(Signals::view).collect(), data.past + data.horizon, &self.places);
        let first = rows.first[experiment] + columns.start;
        let pieces = (0..columns.len()).step_by(PIECE).map(|start| {
            let mut piece = Mat::zeros(PIECE.min(columns.len() - start), self.places.len());
            rows.fill(first + start, piece.as_mut());
            piece
        });
        let r = match &self.gram {
            Some(gram) => {
                let mut gram = gram.clone();
                pieces.for_each(|h| matmul(gram.as_mut(), Accum::Add, h.transpose(), h.as_ref(), step, Par::Seq));
                let what = || "the Gram matrix of the block-Hankel data (take factorisation = \"qr\")".into();
                let cholesky = gram.llt(Side::Lower).map_err(|_| Error::Singular { what: what(), rcond: 0.0 })?;
                cholesky.L().transpose().to_owned()
            }
            None => {
                let mut triangle = SequentialQr::new(self.places.len(), PIECE.min(columns.len()).max(data.r.nrows()));
                triangle.fold_rows(data.r.as_ref());
                pieces.for_each(|h| triangle.fold_rows((h * faer::Scale(step.sqrt())).as_ref()));
                triangle.r().to_owned()
            }
        };
        Ok(HankelLq { r, ..*data })
    }
}

/// R, how it was found, and the directions that known disturbances took.
fn factor(views: &[View<'_>], frame: &Frame, factorisation: Factorisation) -> Result<(Mat<f64>, DataFactor, usize)> {
    let by_gram = match factorisation {
        Factorisation::Qr => None,
        _ => {
            let mut gram = Gram::new(frame.inputs + frame.outputs, frame.blocks());
            views.iter().for_each(|view| gram.add(*view, frame.blocks()));
            gram.factor(&frame.places)
        }
    };
    match choose(by_gram, factorisation)? {
        Choice::Gram(found, report) => Ok((found.r, report, found.taken)),
        Choice::Qr(report) if views.iter().all(|view| view.w.ncols() == 0) => {
            let rows = RowMap::new(views.to_vec(), frame.blocks(), &frame.places);
            let mut lanes = QrLanes::new(frame.places.len());
            lanes.add(&rows);
            Ok((lanes.whole(), report, 0))
        }
        Choice::Qr(report) => {
            let (r, taken) = factor_beyond_disturbances(views, frame);
            Ok((r, report, taken))
        }
    }
}

/// How R is to be had.
pub(super) enum Choice {
    Gram(GramFactor, DataFactor),
    Qr(DataFactor),
}

/// The Gram matrix where its condition allows it, or what was asked for.
pub(super) fn choose(by_gram: Option<GramFactor>, factorisation: Factorisation) -> Result<Choice> {
    let condition = by_gram.as_ref().map_or(f64::INFINITY, |found| found.condition);
    match by_gram {
        Some(found) if factorisation == Factorisation::Gram || condition <= gram::LIMIT => {
            Ok(Choice::Gram(found, DataFactor { by: Factorisation::Gram, condition: Some(condition) }))
        }
        None if factorisation == Factorisation::Gram => {
            let what = "the Gram matrix of the block-Hankel data (take factorisation = \"qr\")".into();
            Err(Error::Singular { what, rcond: 0.0 })
        }
        found => Ok(Choice::Qr(DataFactor { by: Factorisation::Qr, condition: found.map(|found| found.condition) })),
    }
}

/// R of what the known disturbances leave, experiment by experiment because each has its own amplitudes; and the directions
/// that they took.
fn factor_beyond_disturbances(views: &[View<'_>], frame: &Frame) -> (Mat<f64>, usize) {
    let (blocks, width) = (frame.blocks(), frame.places.len());
    let mut whole = SequentialQr::new(width, width);
    let mut taken = 0;
    for view in views {
        let span = disturbance::span(gram::of_disturbance(*view, blocks).as_ref());
        let rows = RowMap { leading: span.basis, ..RowMap::new(vec![*view], blocks, &frame.places) };
        let leading = rows.leading.ncols();
        let mut lanes = QrLanes::new(leading + width);
        lanes.add(&rows);
        let r = lanes.whole();
        let rank = leading_rank(r.as_ref(), leading);
        whole.fold_rows(r.as_ref().submatrix(rank, leading, r.nrows() - rank, width));
        taken += rank;
    }
    (whole.r().to_owned(), taken)
}

/// Accumulates R by QR, in lanes that are joined at the end.
pub(super) struct QrLanes {
    width: usize,
    lanes: Vec<SequentialQr>,
}

impl QrLanes {
    pub(super) fn new(width: usize) -> Self {
        QrLanes { width, lanes: Vec::new() }
    }

    pub(super) fn add(&mut self, rows: &RowMap<'_>) {
        let lanes = rows.total.div_ceil(PIECE).min(LANES);
        self.lanes.resize_with(lanes.max(self.lanes.len()), || SequentialQr::new(self.width, 1));
        self.lanes[..lanes].par_iter_mut().enumerate().for_each(|(lane, triangle)| {
            rows.fold(lane * rows.total / lanes..(lane + 1) * rows.total / lanes, triangle);
        });
    }

    pub(super) fn whole(&self) -> Mat<f64> {
        let mut whole = SequentialQr::new(self.width, self.width);
        self.lanes.iter().for_each(|lane| whole.fold_rows(lane.r()));
        whole.r().to_owned()
    }
}

/// The transposed Hankel matrix as a map: which samples of which experiment, or part of it, stand in which row.
pub(super) struct RowMap<'a> {
    views: Vec<View<'a>>,
    /// Combinations of the known disturbances (block row, signal) that stand first.
    leading: Mat<f64>,
    places: &'a [usize],
    /// First row of each experiment.
    first: Vec<usize>,
    total: usize,
}

impl<'a> RowMap<'a> {
    pub(super) fn new(views: Vec<View<'a>>, blocks: usize, places: &'a [usize]) -> Self {
        let mut total = 0;
        let mut first = Vec::new();
        for view in &views {
            first.push(total);
            total += (view.samples() + 1).saturating_sub(blocks);
        }
        RowMap { views, leading: Mat::zeros(0, 0), places, first, total }
    }

    /// Folds a range of rows into a factor, which has room for them only meanwhile.
    fn fold(&self, range: Range<usize>, triangle: &mut SequentialQr) {
        let pieces = range.len().div_ceil(PIECE);
        let cut = |k: usize| range.start + k * range.len() / pieces;
        triangle.make_room(range.len().div_ceil(pieces));
        for k in 0..pieces {
            triangle.fold(cut(k + 1) - cut(k), |piece| self.fill(cut(k), piece));
        }
        triangle.make_room(1);
    }

    /// Writes the rows `start ..` into `piece`.
    fn fill(&self, start: usize, mut piece: MatMut<'_, f64>) {
        let end = start + piece.nrows();
        for (e, view) in self.views.iter().enumerate() {
            let from = self.first[e].max(start);
            let to = self.first.get(e + 1).copied().unwrap_or(self.total).min(end);
            if from < to {
                let part = piece.as_mut().subrows_mut(from - start, to - from);
                self.fill_from(*view, from - self.first[e], part);
            }
        }
    }

    /// Writes the places of Hankel columns that begin at sample `time` of one experiment.
    fn fill_from(&self, view: View<'_>, time: usize, mut part: MatMut<'_, f64>) {
        let View { u, y, w } = view;
        let (count, inputs, channels) = (part.nrows(), u.ncols(), u.ncols() + y.ncols());
        if self.leading.ncols() > 0 {
            let h = w.ncols();
            let known = Mat::from_fn(count, self.leading.nrows(), |k, j| w[(time + k + j / h, j % h)]);
            part.as_mut().subcols_mut(0, self.leading.ncols()).copy_from(known * &self.leading);
        }
        let mut part = part.subcols_mut(self.leading.ncols(), self.places.len());
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
    use crate::identify::subspace::Experiment;

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

    fn factors(noise: f64, horizon: usize, by: Factorisation) -> Result<HankelLq> {
        let records = experiments(noise);
        let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment { u: u.as_ref(), y: y.as_ref() }).collect();
        let data = Channels::new(&experiments, &[], &SubspaceOptions { horizon, ..Default::default() })?;
        HankelLq::new(&data, (horizon, horizon), HankelLayout::InputsFirst, by)
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

    #[test]
    fn a_shorter_horizon_comes_from_the_same_factor() {
        let records = experiments(0.3);
        let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment { u: u.as_ref(), y: y.as_ref() }).collect();
        let data = Channels::new(&experiments, &[], &SubspaceOptions { horizon: 9, ..Default::default() }).unwrap();
        let whole = HankelLq::new(&data, (9, 9), HankelLayout::InputsFirst, Factorisation::Qr).unwrap();
        let r = whole.arranged(HankelLayout::Chronological, 4, 3).unwrap();
        // The Gram matrix of the same rows over the same columns.
        let places = HankelLayout::Chronological.places(2, 1, 4, 3);
        let shifted: Vec<usize> = places.iter().map(|place| place + 5 * 3).collect();
        let scaled = data.scaled();
        let rows = RowMap::new(scaled.iter().map(Signals::view).collect(), 18, &shifted);
        let mut hankel = Mat::zeros(rows.total, shifted.len());
        rows.fill(0, hankel.as_mut());
        let gram = hankel.transpose() * &hankel;
        let error = (r.transpose() * &r - &gram).norm_max() / gram.norm_max();
        assert!(error < 1e-13, "{error:.1e}");
        assert!(whole.arranged(HankelLayout::Chronological, 10, 3).is_err());
    }
}
