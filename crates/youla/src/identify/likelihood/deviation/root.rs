//! The root of the covariance of the parameters: its columns are independent errors.
//!
//! Where each output has its row of C for itself, the errors of that row alone touch no other output; only the errors of what all outputs share
//! touch every parameter. Time and memory are linear in the outputs then.

use super::inverse_root;
use crate::identify::likelihood::choose::loads::Nuisance;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::by_output::{Arrow, Ends, Normal, inverse};
use crate::identify::likelihood::search::chart::{Chart, Places};
use crate::identify::likelihood::search::linearise::{Extra, Filter, linearise_with, without};
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::Point;
use faer::{Mat, Scale, c64};
use std::ops::AddAssign;

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

    /// Of a point of records, with what else was estimated from them.
    pub(crate) fn new(spectra: &Spectra, point: &Point, chart: &Chart, noise: &Noise, nuisance: &Nuisance) -> Self {
        if chart.units.is_empty() {
            // In a loop the coefficients of the noise are not independent of those of the plant.
            let (count, values) = (nuisance.count, &nuisance.values);
            let extra = Extra { count, values, quick: false, filter: Filter::Free };
            let factor = linearise_with(spectra, point, chart, noise, &extra).factor;
            let parameters = chart.parameters();
            return Root::dense(inverse_root(&without(factor, 0, parameters..parameters + count), parameters));
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

    /// Errors of the entries of G(z), slopes times root: those of each output alone, m x errors, and those of all, p m x errors.
    pub(crate) fn seen(&self, chart: &Chart, model: &Model, z: c64) -> (Vec<Mat<c64>>, Mat<c64>) {
        if self.own.is_empty() {
            return (Vec::new(), product(&chart.response_slopes(model, z), &self.shared));
        }
        let slopes = chart.slopes(model, z);
        let rows =
            |places: &[usize]| Mat::from_fn(places.len(), self.shared.ncols(), |i, k| self.shared[(places[i], k)]);
        let plant: Vec<usize> = self.places.plant.iter().map(|e| e.place).collect();
        let mut shared = product(&slopes.shared, &rows(&plant));
        for (o, (slopes, of)) in slopes.own.iter().zip(&self.places.own).enumerate() {
            let m = slopes.nrows();
            shared.subrows_mut(o * m, m).add_assign(product(slopes, &rows(of)));
        }
        let own = slopes.own.iter().zip(&self.own).map(|(slopes, root)| product(slopes, root));
        (own.collect(), shared)
    }
}

/// A product of a complex matrix and a real one: its real parts above its imaginary parts.
fn product(left: &Mat<c64>, right: &Mat<f64>) -> Mat<c64> {
    let rows = left.nrows();
    let parts = Mat::from_fn(2 * rows, left.ncols(), |i, k| match i.checked_sub(rows) {
        None => left[(i, k)].re,
        Some(i) => left[(i, k)].im,
    });
    let parts = parts * right;
    Mat::from_fn(rows, right.ncols(), |i, k| c64::new(parts[(i, k)], parts[(rows + i, k)]))
}
