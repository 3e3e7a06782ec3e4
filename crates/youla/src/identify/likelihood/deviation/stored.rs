//! A region as it is kept in files: its model with the directions in which it moves, exactly.

use super::Directions;
use super::interpolation::Interpolated;
use super::region::Region;
use super::root::Root;
use crate::identify::likelihood::data::spectra::Sizes;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::identify::verdict::{Excess, NonlinearPart};
use crate::lti::Discrete;
use faer::Mat;
use serde::{Deserialize, Serialize};

/// A region in a file; its deviations follow from it.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredRegion {
    ts: f64,
    sizes: Sizes,
    shares: Vec<f64>,
    model: Model,
    delays: Vec<usize>,
    chart: Vec<StoredMatrix>,
    /// Of many outputs the entries that move, in place of directions, and the errors of each output alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    units: Vec<Vec<usize>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    own: Vec<StoredMatrix>,
    feedthrough: bool,
    root: StoredMatrix,
    rivals: Vec<(Model, Vec<usize>, f64)>,
    scatter: f64,
    seen: Option<[Excess; 3]>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    nonlinear: Vec<NonlinearPart>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    interpolated: Vec<Interpolated>,
}

/// A matrix, column by column.
#[derive(Serialize, Deserialize)]
struct StoredMatrix {
    rows: usize,
    columns: usize,
    entries: Vec<f64>,
}

impl From<&Mat<f64>> for StoredMatrix {
    fn from(m: &Mat<f64>) -> Self {
        let entries = (0..m.ncols()).flat_map(|j| (0..m.nrows()).map(move |i| m[(i, j)])).collect();
        StoredMatrix { rows: m.nrows(), columns: m.ncols(), entries }
    }
}

impl StoredMatrix {
    /// The matrix, where it has so many rows.
    fn of_rows(&self, rows: usize) -> Option<Mat<f64>> {
        let fits = self.rows == rows && self.rows.checked_mul(self.columns) == Some(self.entries.len());
        fits.then(|| Mat::from_fn(rows, self.columns, |i, j| self.entries[j * rows + i]))
    }
}

impl From<Region> for StoredRegion {
    fn from(region: Region) -> Self {
        let d = region.directions;
        StoredRegion {
            ts: region.time.ts(),
            sizes: region.sizes,
            shares: region.shares,
            chart: d.chart.directions.iter().map(StoredMatrix::from).collect(),
            feedthrough: d.chart.feedthrough,
            units: d.chart.units,
            own: d.root.own.iter().map(StoredMatrix::from).collect(),
            root: StoredMatrix::from(&d.root.shared),
            model: d.model,
            delays: d.delays,
            rivals: d.rivals,
            scatter: d.scatter,
            seen: d.seen,
            nonlinear: d.nonlinear,
            interpolated: d.interpolated,
        }
    }
}

impl TryFrom<StoredRegion> for Region {
    type Error = &'static str;

    fn try_from(stored: StoredRegion) -> Result<Self, Self::Error> {
        let refused = "the sizes in this region do not fit each other; identify the run again";
        let (m, p) = (stored.sizes.u.len(), stored.sizes.y.len());
        let is_of_loop = |model: &Model, delays: &[usize]| {
            let blocks = model.blocks.iter().all(|b| {
                let s = b.states;
                s > 0 && [b.a.len(), b.b.len(), b.c.len()] == [s * s, s * m, s * p]
            });
            blocks && (model.inputs, model.outputs, model.d.len(), delays.len()) == (m, p, m * p, m)
        };
        let seen = stored.seen.iter().flatten().all(|seen| seen.is_of(m * p));
        let positive = |values: &[f64]| !values.is_empty() && values.iter().all(|v| *v > 0.0 && v.is_finite());
        let lists = [&stored.sizes.u, &stored.sizes.y, &stored.shares];
        let fits = stored.chart.len() + stored.units.len() == stored.model.blocks.len()
            && (stored.chart.is_empty() || stored.units.is_empty())
            && seen
            && stored.nonlinear.iter().all(|part| part.is_of((p, m)))
            && stored.interpolated.iter().all(|of| of.is_of(p))
            && lists.into_iter().all(|list| positive(list))
            && is_of_loop(&stored.model, &stored.delays)
            && stored.rivals.iter().all(|(model, delays, _)| is_of_loop(model, delays));
        if !fits {
            return Err(refused);
        }
        let blocks = stored.chart.iter().zip(&stored.model.blocks);
        let directions = blocks.map(|(of, b)| of.of_rows(b.states.checked_mul(b.states + m + p)?));
        let directions: Vec<Mat<f64>> = directions.collect::<Option<_>>().ok_or(refused)?;
        let within = |(units, b): (&Vec<usize>, &Block)| units.iter().all(|e| *e < b.states * (b.states + m + p));
        if !stored.units.iter().zip(&stored.model.blocks).all(within) {
            return Err(refused);
        }
        let chart = Chart::of(&stored.model, (directions, stored.units), stored.feedthrough);
        let shared = stored.root.of_rows(chart.parameters()).ok_or(refused)?;
        let own = stored.own.iter().map(|of| of.of_rows(of.rows)).collect::<Option<_>>().ok_or(refused)?;
        let root = Root::of_parts(shared, own, &chart, &stored.model).ok_or(refused)?;
        let time = Discrete::new(stored.ts).map_err(|_| "this region has no sample time; identify the run again")?;
        let directions = Directions {
            model: stored.model,
            delays: stored.delays,
            chart,
            root,
            rivals: stored.rivals,
            scatter: stored.scatter,
            seen: None,
            of_another_form: Vec::new(),
            nonlinear: stored.nonlinear,
            interpolated: stored.interpolated,
        };
        let directions = directions.with_seen(stored.seen);
        Ok(Region::new(stored.sizes, time, &stored.shares, directions))
    }
}
