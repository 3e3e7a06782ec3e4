//! The root of the covariance of the parameters: its columns are independent errors.
//!
//! Where each output has its row of C for itself, the errors of that row alone touch no other output; only the errors of what all outputs share
//! touch every parameter. Time and memory are linear in the outputs then.

use super::inverse_root;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::by_output::{Arrow, Ends, Normal, inverse};
use crate::identify::likelihood::search::chart::{Chart, Places};
use crate::identify::likelihood::search::linearise::linearise;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::Point;
use faer::{Mat, Scale, c64};

/// The root, in parts.
#[derive(Debug, Clone)]
pub(crate) struct Root {
    /// Errors of all parameters, parameters x errors.
    pub(super) shared: Mat<f64>,
    /// Errors of the parameters of each output alone; none where they are not told apart.
    pub(super) own: Vec<Mat<f64>>,
    places: Places,
}

impl Root {
    /// All errors in one matrix.
    pub(crate) fn dense(shared: Mat<f64>) -> Self {
        Root { shared, own: Vec::new(), places: Places { plant: Vec::new(), own: Vec::new() } }
    }

    /// From parts, in the coordinates of a model.
    #[cfg(feature = "serde")]
    pub(super) fn of_parts(shared: Mat<f64>, own: Vec<Mat<f64>>, chart: &Chart, model: &Model) -> Option<Self> {
        if own.is_empty() {
            return Some(Root::dense(shared));
        }
        let places = chart.places(model);
        let fits = own.len() == places.own.len() && own.iter().zip(&places.own).all(|(m, of)| m.nrows() == of.len());
        fits.then_some(Root { shared, own, places })
    }

    /// Of a point of records.
    pub(crate) fn new(spectra: &Spectra, point: &Point, chart: &Chart, noise: &Noise) -> Self {
        if chart.units.is_empty() {
            return Root::dense(inverse_root(&linearise(spectra, point, chart, noise).factor, chart.parameters()));
        }
        let normal = Normal::new(spectra, point, chart, noise, Ends::Shared).reduced();
        Root::of_arrow(&normal.factor(0.0), chart, &point.model)
    }

    /// Of the factor of normal equations without nuisance.
    pub(crate) fn of_arrow(arrow: &Arrow, chart: &Chart, model: &Model) -> Self {
        let places = chart.places(model);
        let count = arrow.shared.nrows();
        let of_shared = inverse(&arrow.shared.subcols(0, count).to_owned());
        let mut shared = Mat::<f64>::zeros(chart.parameters(), count);
        for (i, entry) in places.plant.iter().enumerate() {
            (0..count).for_each(|k| shared[(entry.place, k)] = of_shared[(i, k)]);
        }
        let mut own = Vec::with_capacity(places.own.len());
        for (rows, of) in arrow.own.iter().zip(&places.own) {
            let n = rows.nrows();
            let alone = inverse(&rows.subcols(0, n).to_owned());
            let along = &alone * rows.subcols(n, count) * &of_shared;
            for (i, place) in of.iter().enumerate() {
                (0..count).for_each(|k| shared[(*place, k)] = -along[(i, k)]);
            }
            own.push(alone);
        }
        Root { shared, own, places }
    }

    /// With all errors larger.
    pub(crate) fn scaled(self, by: f64) -> Self {
        let own = self.own.into_iter().map(|m| m * Scale(by)).collect();
        Root { shared: self.shared * Scale(by), own, places: self.places }
    }

    /// Number of errors.
    pub(crate) fn errors(&self) -> usize {
        self.own.iter().map(Mat::ncols).sum::<usize>() + self.shared.ncols()
    }

    /// The change of the parameters for errors: those of each output alone, then those of all.
    pub(crate) fn step(&self, errors: &[f64]) -> Vec<f64> {
        let first = self.errors() - self.shared.ncols();
        let along = |j: usize| (0..self.shared.ncols()).map(|k| self.shared[(j, k)] * errors[first + k]).sum();
        let mut step: Vec<f64> = (0..self.shared.nrows()).map(along).collect();
        let mut at = 0;
        for (own, of) in self.own.iter().zip(&self.places.own) {
            for (i, place) in of.iter().enumerate() {
                step[*place] += (0..own.ncols()).map(|k| own[(i, k)] * errors[at + k]).sum::<f64>();
            }
            at += own.ncols();
        }
        step
    }

    /// `slopes root`: errors of the entries of G, row by row of the outputs.
    pub(crate) fn seen(&self, slopes: &Mat<c64>) -> Mat<c64> {
        if self.own.is_empty() {
            let all: Vec<usize> = (0..slopes.ncols()).collect();
            let mut out = Mat::<c64>::zeros(slopes.nrows(), self.shared.ncols());
            put(&mut out, (0, 0), &(real(slopes, 0..slopes.nrows(), &all) * &self.shared));
            return out;
        }
        let m = slopes.nrows() / self.own.len();
        let mut out = Mat::<c64>::zeros(slopes.nrows(), self.errors());
        let mut at = 0;
        let plant: Vec<usize> = self.places.plant.iter().map(|e| e.place).collect();
        let first = self.errors() - self.shared.ncols();
        for (o, (own, of)) in self.own.iter().zip(&self.places.own).enumerate() {
            put(&mut out, (o * m, at), &(real(slopes, o * m..(o + 1) * m, of) * own));
            at += own.ncols();
            let all = [of.as_slice(), &plant].concat();
            let root = Mat::from_fn(all.len(), self.shared.ncols(), |i, k| self.shared[(all[i], k)]);
            put(&mut out, (o * m, first), &(real(slopes, o * m..(o + 1) * m, &all) * root));
        }
        out
    }
}

/// Some entries of some rows, real parts above imaginary parts.
fn real(slopes: &Mat<c64>, rows: std::ops::Range<usize>, places: &[usize]) -> Mat<f64> {
    let m = rows.len();
    Mat::from_fn(2 * m, places.len(), |i, k| {
        let value = slopes[(rows.start + i % m, places[k])];
        if i < m { value.re } else { value.im }
    })
}

fn put(out: &mut Mat<c64>, (row, column): (usize, usize), parts: &Mat<f64>) {
    let m = parts.nrows() / 2;
    for k in 0..parts.ncols() {
        (0..m).for_each(|i| out[(row + i, column + k)] = c64::new(parts[(i, k)], parts[(m + i, k)]));
    }
}
