//! The rows of the transposed block-Hankel matrix, read from the records in pieces and accumulated by QR.

use crate::identify::subspace::records::view::View;
use crate::linalg::SequentialQr;
use faer::{Mat, MatMut};
use rayon::prelude::*;
use std::ops::Range;

/// Rows folded in at a time: large enough for blocked QR, small enough for the cache.
pub(crate) const PIECE: usize = 4000;
/// Lanes that may run at the same time.
const LANES: usize = 16;

/// The transposed Hankel matrix as a map: the row of each sample of each experiment, or of a part of it.
pub(crate) struct RowMap<'a> {
    views: Vec<View<'a>>,
    /// Combinations of the known disturbances (block row, signal) that come first.
    leading: Mat<f64>,
    places: &'a [usize],
    /// First row of each experiment.
    pub(crate) first: Vec<usize>,
    pub(crate) total: usize,
}

impl<'a> RowMap<'a> {
    pub(crate) fn new(views: Vec<View<'a>>, blocks: usize, places: &'a [usize]) -> Self {
        let mut total = 0;
        let mut first = Vec::new();
        for view in &views {
            first.push(total);
            total += (view.samples() + 1).saturating_sub(blocks);
        }
        RowMap { views, leading: Mat::zeros(0, 0), places, first, total }
    }

    /// The same with combinations of the known disturbances (block row, signal) before the rows.
    pub(crate) fn with_leading(self, leading: Mat<f64>) -> Self {
        RowMap { leading, ..self }
    }

    /// R of all rows, in lanes that are joined at the end.
    pub(crate) fn triangle(&self) -> Mat<f64> {
        let width = self.leading.ncols() + self.places.len();
        let lanes = self.total.div_ceil(PIECE).min(LANES);
        let triangle = |lane: usize| {
            let mut triangle = SequentialQr::new(width, 1);
            self.fold(lane * self.total / lanes..(lane + 1) * self.total / lanes, &mut triangle);
            triangle
        };
        let triangles: Vec<SequentialQr> = (0..lanes).into_par_iter().map(triangle).collect();
        let mut whole = SequentialQr::new(width, width);
        triangles.iter().for_each(|lane| whole.fold_rows(lane.r()));
        whole.r().to_owned()
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
    pub(crate) fn fill(&self, start: usize, mut piece: MatMut<'_, f64>) {
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
