//! The triangular factor R of block-Hankel data, from which every weight, order and shorter horizon starts.
//!
//! Only R is formed, from the Gram matrix or from pieces of a few thousand rows (one row per Hankel column), batch by batch.
//! The rows of a batch are dealt to lanes whose number depends on the data alone, so the result is the same on any number of
//! threads. R is found in the units of the record and scaled at the end: both ways give the same to rounding.

use super::batch::{Batch, Pass, Segment, each_batch};
use super::channels::{Channels, Statistics, check_blocks, check_ports};
use super::gram::{self, GramSums};
use super::{DataFactor, Factorisation, SubspaceOptions};
use crate::linalg::Triangle;
use crate::record::SampleStream;
use crate::{Error, Result};
use faer::{Mat, MatMut};
use rayon::prelude::*;
use std::ops::Range;

/// Rows folded in at a time: large enough for blocked QR, small enough for the cache.
const PIECE: usize = 4000;
/// Lanes that may run at the same time.
const LANES: usize = 8;

/// R of block-Hankel data.
pub(super) struct DataTriangle {
    r: Mat<f64>,
    arrangement: Arrangement,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// Block rows of the past and of the future.
    past: usize,
    horizon: usize,
    /// Columns of the Hankel matrix.
    pub(super) columns: usize,
    /// How R was found.
    pub(super) report: DataFactor,
}

/// In which order the rows of the block-Hankel matrix stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Arrangement {
    /// `[U_f U_p Y_p Y_f]`.
    InputsFirst,
    /// `[z(k-p) ... z(k) ... z(k+f-1)]`, `z = [u; y]`.
    Chronological,
}

impl Arrangement {
    /// The arrangement from which the method of the options starts.
    fn of(options: &SubspaceOptions) -> Self {
        match options.weight.is_for_closed_loops() {
            true => Arrangement::Chronological,
            false => Arrangement::InputsFirst,
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
            Arrangement::Chronological => (0..(past + horizon) * q).collect(),
            Arrangement::InputsFirst => block_rows(after.clone(), 0..m)
                .chain(block_rows(before.clone(), 0..m))
                .chain(block_rows(before, m..q))
                .chain(block_rows(after, m..q))
                .collect(),
        }
    }
}

impl DataTriangle {
    /// R of the records for the past and horizon of the options, by the way that they ask for, and what the same passes tell
    /// of the channels. `Auto` takes the Gram matrix where it is well enough conditioned, else QR by a second pass.
    pub(super) fn new(stream: &mut dyn SampleStream, options: &SubspaceOptions) -> Result<(Self, Channels)> {
        check_blocks(options)?;
        let (inputs, outputs) = (stream.inputs(), stream.outputs());
        check_ports(inputs, outputs)?;
        let (past, horizon) = (options.past(), options.horizon);
        let arrangement = Arrangement::of(options);
        let shape = Shape { places: arrangement.places(inputs, outputs, past, horizon), blocks: past + horizon };
        let mut statistics = Statistics::new(inputs, options);
        let by_qr = options.factorisation == Factorisation::Qr;
        let mut gram = GramSums::new(inputs + outputs, if by_qr { 1 } else { shape.blocks });
        let mut qr = QrLanes::new(&shape);
        let lengths = each_batch(stream, &shape.pass(None), |batch| {
            statistics.add(batch)?;
            if by_qr {
                qr.add(batch)
            } else {
                gram.add(batch)
            }
            Ok(())
        })?;
        let channels = Channels::new(inputs, statistics, lengths, options.scaling)?;
        let columns = shape.columns(&channels.lengths, options)?;
        let by_gram = if by_qr { None } else { gram.factor(&shape.places) };
        let (mut r, report) = match choose(by_gram, options.factorisation)? {
            Choice::Gram(r, report) => (r, report),
            Choice::Qr(report) => {
                if !by_qr {
                    each_batch(stream, &shape.pass(Some(&channels.lengths)), |batch| {
                        qr.add(batch);
                        Ok(())
                    })?;
                }
                (qr.whole(), report)
            }
        };
        for (column, place) in shape.places.iter().enumerate() {
            let scale = channels.scale[place % (inputs + outputs)];
            r.col_mut(column).iter_mut().for_each(|value| *value /= scale);
        }
        Ok((DataTriangle { r, arrangement, inputs, outputs, past, horizon, columns, report }, channels))
    }

    /// R of the rows that a past and a future no longer than those of the data take, in the given order; the Hankel columns
    /// stay those of the data.
    pub(super) fn arranged(&self, arrangement: Arrangement, past: usize, horizon: usize) -> Result<Mat<f64>> {
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
            |arrangement: Arrangement, past, horizon| arrangement.places(self.inputs, self.outputs, past, horizon);
        let held = places(self.arrangement, self.past, self.horizon);
        let mut column_of = vec![0; held.len()];
        held.iter().enumerate().for_each(|(column, place)| column_of[*place] = column);
        let oldest = (self.past - past) * (self.inputs + self.outputs);
        let wanted: Vec<usize> =
            places(arrangement, past, horizon).iter().map(|place| column_of[place + oldest]).collect();
        let mut triangle = Triangle::new(wanted.len(), self.r.nrows());
        triangle.fold(self.r.nrows(), |mut rows| {
            wanted.iter().enumerate().for_each(|(j, column)| rows.as_mut().col_mut(j).copy_from(self.r.col(*column)));
        });
        Ok(triangle.r().to_owned())
    }
}

/// How R is to be had.
enum Choice {
    Gram(Mat<f64>, DataFactor),
    Qr(DataFactor),
}

fn choose(by_gram: Option<gram::GramFactor>, factorisation: Factorisation) -> Result<Choice> {
    let condition = by_gram.as_ref().map_or(f64::INFINITY, |found| found.condition);
    match by_gram {
        Some(found) if factorisation == Factorisation::Gram || condition <= gram::LIMIT => {
            Ok(Choice::Gram(found.r, DataFactor { by: Factorisation::Gram, condition: Some(condition) }))
        }
        None if factorisation == Factorisation::Gram => {
            let what = "the Gram matrix of the block-Hankel data (take factorisation = \"qr\")".into();
            Err(Error::Singular { what, rcond: 0.0 })
        }
        found => Ok(Choice::Qr(DataFactor { by: Factorisation::Qr, condition: found.map(|found| found.condition) })),
    }
}

/// Which samples stand in a row of the transposed Hankel matrix.
struct Shape {
    places: Vec<usize>,
    blocks: usize,
}

impl Shape {
    fn pass<'a>(&self, lengths: Option<&'a [usize]>) -> Pass<'a> {
        Pass { overlap: self.blocks - 1, scale: None, lengths }
    }

    /// Hankel columns of all experiments; refuses fewer than the rows.
    fn columns(&self, lengths: &[usize], options: &SubspaceOptions) -> Result<usize> {
        let (columns, width) = (lengths.iter().map(|n| n + 1 - self.blocks).sum(), self.places.len());
        if columns < width {
            let (horizon, past) = (options.horizon, options.past());
            let what = format!("all experiments together, with a horizon of {horizon} and a past of {past} block rows");
            let found: usize = lengths.iter().sum();
            return Err(Error::TooFewSamples { what, found, needed: found + width - columns });
        }
        Ok(columns)
    }
}

/// Accumulates R by QR, in lanes that are joined at the end.
struct QrLanes<'a> {
    shape: &'a Shape,
    lanes: Vec<Triangle>,
}

impl<'a> QrLanes<'a> {
    fn new(shape: &'a Shape) -> Self {
        QrLanes { shape, lanes: Vec::new() }
    }

    fn add(&mut self, batch: &Batch) {
        let rows = RowMap::new(batch, self.shape);
        let lanes = rows.total.div_ceil(PIECE).min(LANES);
        let width = self.shape.places.len();
        self.lanes.resize_with(lanes.max(self.lanes.len()), || Triangle::new(width, 1));
        self.lanes[..lanes].par_iter_mut().enumerate().for_each(|(lane, triangle)| {
            rows.fold(lane * rows.total / lanes..(lane + 1) * rows.total / lanes, triangle);
        });
    }

    fn whole(&self) -> Mat<f64> {
        let width = self.shape.places.len();
        let mut whole = Triangle::new(width, width);
        self.lanes.iter().for_each(|lane| whole.fold_rows(lane.r()));
        whole.r().to_owned()
    }
}

/// The transposed Hankel matrix of a batch as a map: which samples of which segment stand in which row.
struct RowMap<'a> {
    batch: &'a Batch,
    shape: &'a Shape,
    /// First row of each segment.
    first: Vec<usize>,
    total: usize,
}

impl<'a> RowMap<'a> {
    fn new(batch: &'a Batch, shape: &'a Shape) -> Self {
        let mut total = 0;
        let mut first = Vec::new();
        for segment in &batch.segments {
            first.push(total);
            total += (segment.samples() + 1).saturating_sub(shape.blocks);
        }
        RowMap { batch, shape, first, total }
    }

    /// Folds a range of rows into a factor, which has room for them only meanwhile.
    fn fold(&self, range: Range<usize>, triangle: &mut Triangle) {
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
        for (e, segment) in self.batch.segments.iter().enumerate() {
            let from = self.first[e].max(start);
            let to = self.first.get(e + 1).copied().unwrap_or(self.total).min(end);
            if from < to {
                let part = piece.as_mut().subrows_mut(from - start, to - from);
                self.fill_from(segment, from - self.first[e], part);
            }
        }
    }

    /// Writes the places of Hankel columns that begin at sample `time` of a segment.
    fn fill_from(&self, segment: &Segment, time: usize, mut part: MatMut<'_, f64>) {
        let (count, channels) = (part.nrows(), self.batch.channels);
        // By channels, so that the columns are copied without gaps.
        let samples = self.batch.rows(segment).subrows(time, count + self.shape.blocks - 1).to_owned();
        for (column, place) in self.shape.places.iter().enumerate() {
            let (block, channel) = (place / channels, place % channels);
            part.as_mut().col_mut(column).copy_from(samples.col(channel).subrows(block, count));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::subspace::{Experiment, ExperimentStream};

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

    fn factors(noise: f64, horizon: usize, by: Factorisation) -> Result<DataTriangle> {
        let records = experiments(noise);
        let experiments: Vec<_> = records.iter().map(|(u, y)| Experiment { u: u.as_ref(), y: y.as_ref() }).collect();
        let options = SubspaceOptions { horizon, factorisation: by, ..Default::default() };
        Ok(DataTriangle::new(&mut ExperimentStream::new(&experiments)?, &options)?.0)
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
        let options = SubspaceOptions { horizon: 9, factorisation: Factorisation::Qr, ..Default::default() };
        let stream = &mut ExperimentStream::new(&experiments).unwrap();
        let (whole, channels) = DataTriangle::new(stream, &options).unwrap();
        let r = whole.arranged(Arrangement::Chronological, 4, 3).unwrap();
        // The Gram matrix of the same rows over the same columns.
        let places = Arrangement::Chronological.places(2, 1, 4, 3);
        let hankel = records.iter().flat_map(|(u, y)| (0..u.nrows() - 17).map(move |t| (u, y, t)));
        let mut gram = Mat::zeros(places.len(), places.len());
        for (u, y, t) in hankel {
            let row = Mat::from_fn(places.len(), 1, |j, _| {
                let (time, c) = (t + 5 + places[j] / 3, places[j] % 3);
                (if c < 2 { u[(time, c)] } else { y[(time, 0)] }) / channels.scale[c]
            });
            gram += &row * row.transpose();
        }
        let error = (r.transpose() * &r - &gram).norm_max() / gram.norm_max();
        assert!(error < 1e-13, "{error:.1e}");
        assert!(whole.arranged(Arrangement::Chronological, 10, 3).is_err());
    }
}
