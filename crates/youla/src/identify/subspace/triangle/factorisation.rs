//! The triangular factor R of block-Hankel data, from which every weight, order and shorter horizon starts.
//!
//! Only R is formed, from the Gram matrix or from pieces of a few thousand rows (one row per Hankel column). The rows are
//! dealt to a fixed number of lanes that depends on the data alone, so the result is the same on any number of threads.

use crate::identify::subspace::records::channels::Channels;
use crate::identify::subspace::records::disturbance;
use crate::identify::subspace::records::view::View;
use crate::identify::subspace::triangle::gram::{self, Gram, GramFactor};
use crate::identify::subspace::triangle::hankel_layout::HankelLayout;
use crate::identify::subspace::triangle::row_map::RowMap;
use crate::identify::subspace::{DataFactor, Factorisation};
use crate::linalg::{SequentialQr, leading_rank};
use crate::{Error, Result};
use faer::Mat;

/// R of block-Hankel data.
pub(crate) struct HankelLq {
    r: Mat<f64>,
    arrangement: HankelLayout,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    /// Block rows of the past and of the future.
    past: usize,
    horizon: usize,
    /// Columns of the Hankel matrix, less the directions that known disturbances take.
    pub(crate) columns: usize,
    /// How R was found.
    pub(crate) report: DataFactor,
}

/// The entries of a column of the block-Hankel matrix.
struct Frame {
    arrangement: HankelLayout,
    inputs: usize,
    outputs: usize,
    past: usize,
    horizon: usize,
    places: Vec<usize>,
}

impl Frame {
    fn new((inputs, outputs): (usize, usize), (past, horizon): (usize, usize), arrangement: HankelLayout) -> Self {
        let places = arrangement.places(inputs, outputs, past, horizon);
        Frame { arrangement, inputs, outputs, past, horizon, places }
    }

    /// Block rows.
    fn blocks(&self) -> usize {
        self.past + self.horizon
    }

    /// Refuses fewer Hankel columns than rows.
    fn require(&self, samples: usize, columns: usize) -> Result<()> {
        let (horizon, past, width) = (self.horizon, self.past, self.places.len());
        if columns >= width {
            return Ok(());
        }
        let what = format!("all experiments together, with a horizon of {horizon} and a past of {past} block rows");
        Err(Error::TooFewSamples { what, found: samples, needed: samples + width - columns })
    }

    /// R with the channels of `[u; y]` divided by `scale`.
    fn triangle(self, mut r: Mat<f64>, scale: &[f64], columns: usize, report: DataFactor) -> HankelLq {
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
    pub(crate) fn new(
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

    /// R of the rows that a past and a future no longer than those of the data take, in the given order; the Hankel columns
    /// stay those of the data.
    pub(crate) fn arranged(&self, arrangement: HankelLayout, past: usize, horizon: usize) -> Result<Mat<f64>> {
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
            Ok((rows.triangle(), report, 0))
        }
        Choice::Qr(report) => {
            let (r, taken) = factor_beyond_disturbances(views, frame);
            Ok((r, report, taken))
        }
    }
}

/// How R is to be had.
enum Choice {
    Gram(GramFactor, DataFactor),
    Qr(DataFactor),
}

/// The Gram matrix where its condition allows it, or what was asked for.
fn choose(by_gram: Option<GramFactor>, factorisation: Factorisation) -> Result<Choice> {
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
        let leading = span.basis.ncols();
        let r = RowMap::new(vec![*view], blocks, &frame.places).with_leading(span.basis).triangle();
        let rank = leading_rank(r.as_ref(), leading);
        whole.fold_rows(r.as_ref().submatrix(rank, leading, r.nrows() - rank, width));
        taken += rank;
    }
    (whole.r().to_owned(), taken)
}

#[cfg(test)]
#[path = "factorisation_tests.rs"]
mod tests;
