//! Standard deviations of the response, from the information of the record and from the scatter over models that the record
//! does not distinguish.
//!
//! ```text
//! var G = slopes (J'J)^-1 slopes^* + sum of w_c |G_c - G|^2,     w_c ~ exp(-criterion / 2)
//! ```
//! The weights are those of Schwarz's criterion, which approximates the posterior probability of a model.

pub(crate) mod innovation;
pub(crate) mod missed;
pub(crate) mod mode_estimates;
pub(crate) mod physical;
pub(crate) mod region;

use crate::identify::likelihood::choose::problem::{Choice, Solution};
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::linearise::linearise;
use crate::identify::likelihood::search::model::Model;
use crate::linalg::TINY;
use faer::{Mat, c64};
use missed::Missed;

/// Rivals of less weight are left out.
const LEAST_WEIGHT: f64 = 1e-12;

/// Inverse of the leading triangle of `[R r; 0 *]` with columns of unit length, and these lengths; directions that the record
/// does not determine are left large.
pub(crate) fn inverse_root(factor: &Mat<f64>, parameters: usize) -> Mat<f64> {
    let rows = parameters.min(factor.nrows());
    let lengths: Vec<f64> = (0..parameters).map(|j| factor.col(j).norm_l2().max(TINY)).collect();
    let unit = Mat::from_fn(rows, parameters, |i, j| factor[(i, j)] / lengths[j]);
    let Ok(svd) = unit.svd() else { return Mat::zeros(parameters, parameters) };
    let (s, v) = (svd.S().column_vector(), svd.V());
    Mat::from_fn(parameters, rows, |i, j| v[(i, j)] / s[j].max(1e-10 * s[0]) / lengths[i])
}

/// Frequencies as shares of the sample rate over which the evidence is averaged: from that of 20 periods in the records.
pub(crate) fn grid(samples: usize) -> Vec<f64> {
    geometric((20.0 / samples.max(40) as f64).clamp(1e-4, 1e-2), 0.495, 150)
}

/// Frequencies below those, from that of one period in the records: deviations are stated there too.
pub(crate) fn slow(samples: usize) -> Vec<f64> {
    let to = grid(samples)[0];
    let from = (1.0 / samples.max(40) as f64).min(0.9 * to);
    let points = (10.0 * (to / from).ln()) as usize + 1;
    geometric(from, to, points + 1).into_iter().take(points).collect()
}

fn geometric(from: f64, to: f64, points: usize) -> Vec<f64> {
    (0..points).map(|k| from * (to / from).powf(k as f64 / (points - 1) as f64)).collect()
}

/// Response of a choice with its dead times, scaled channels.
pub(crate) fn response(choice: &Choice, share: f64) -> Vec<c64> {
    delayed(&choice.found.point.model, &choice.delays, share)
}

/// Response of a model with its dead times, scaled channels.
pub(crate) fn delayed(model: &Model, delays: &[usize], share: f64) -> Vec<c64> {
    let z = c64::cis(std::f64::consts::TAU * share);
    let phases = phases(delays, z);
    model.response(z).into_iter().enumerate().map(|(k, g)| g * phases[k % delays.len()]).collect()
}

/// Factor of each input by its dead time.
fn phases(delays: &[usize], z: c64) -> Vec<c64> {
    delays.iter().map(|delay| z.conj().powu(*delay as u32)).collect()
}

/// The error of the response in independent directions, scaled channels.
#[derive(Debug, Clone)]
pub(crate) struct Directions {
    model: Model,
    delays: Vec<usize>,
    chart: Chart,
    /// Columns are independent errors of the parameters.
    root: Mat<f64>,
    /// Models that the record does not distinguish, with the roots of their weights.
    rivals: Vec<(Model, Vec<usize>, f64)>,
    /// The error that the excitation shows.
    missed: Option<Missed>,
}

impl Directions {
    /// `scatter` is the factor of the variance of the parameters by their scatter over pieces of the records.
    pub(crate) fn new(spectra: &Spectra, solution: &Solution, scatter: f64, missed: Option<Missed>) -> Self {
        let found = &solution.chosen.found;
        let chart = Chart::new(&found.point.model, found.feedthrough);
        let linearised = linearise(spectra, &found.point, &chart, &found.noise);
        let root = inverse_root(&linearised.factor, chart.parameters()) * faer::Scale(scatter.sqrt());
        let model = (found.point.model.clone(), solution.chosen.delays.clone());
        let rivals = solution.rivals.iter().map(|c| (c.found.point.model.clone(), c.delays.clone(), c.criterion));
        Directions { missed, ..Directions::of_parts(model, chart, root, rivals.collect()) }
    }

    /// A model with its delays, the roots of the covariance of its parameters, and rivals with their criteria.
    pub(crate) fn of_parts(
        (model, delays): (Model, Vec<usize>),
        chart: Chart,
        root: Mat<f64>,
        rivals: Vec<(Model, Vec<usize>, f64)>,
    ) -> Self {
        let least = rivals.iter().map(|(.., criterion)| *criterion).fold(f64::INFINITY, f64::min);
        let weighed =
            |(model, delays, criterion): (Model, Vec<usize>, f64)| (model, delays, (-0.5 * (criterion - least)).exp());
        let rivals: Vec<(Model, Vec<usize>, f64)> = rivals.into_iter().map(weighed).collect();
        let total: f64 = rivals.iter().map(|(.., weight)| weight).sum::<f64>().max(TINY);
        let kept = rivals.into_iter().filter(|(.., weight)| *weight > LEAST_WEIGHT * total);
        let rivals = kept.map(|(model, delays, weight)| (model, delays, (weight / total).sqrt())).collect();
        Directions { model, delays, chart, root, rivals, missed: None }
    }

    /// Independent errors of the parameters.
    pub(crate) fn errors(&self) -> usize {
        self.root.ncols()
    }

    /// The model with independent errors of its parameters, in standard deviations, and its dead times.
    pub(crate) fn moved(&self, errors: &[f64]) -> (Model, &[usize]) {
        let along = |j: usize| (0..self.root.ncols()).map(|k| self.root[(j, k)] * errors[k]).sum();
        let step: Vec<f64> = (0..self.root.nrows()).map(along).collect();
        (self.chart.moved(&self.model, &step), &self.delays)
    }

    /// Models of another structure that the record does not distinguish, with their dead times and weights.
    pub(crate) fn rivals(&self) -> impl Iterator<Item = (&Model, &[usize], f64)> {
        let others = |(model, delays, _): &&(Model, Vec<usize>, f64)| {
            model.order() != self.model.order() || *delays != self.delays
        };
        self.rivals.iter().filter(others).map(|(model, delays, root)| (model, delays.as_slice(), root * root))
    }

    /// The rival that a number between 0 and 1 picks, with the frequency of its weight; `None` for the model itself.
    pub(crate) fn rival_at(&self, chance: f64) -> Option<(&Model, &[usize])> {
        let mut passed = 0.0;
        self.rivals().find_map(|(model, delays, weight)| {
            passed += weight;
            (chance < passed).then_some((model, delays))
        })
    }

    /// The error that the excitation shows.
    pub(crate) fn missed(&self) -> Option<&Missed> {
        self.missed.as_ref()
    }

    /// Errors of the entries of G, row by row, in independent directions of unit variance, column by column.
    pub(crate) fn at(&self, share: f64) -> Mat<c64> {
        let z = c64::cis(std::f64::consts::TAU * share);
        let (entries, m) = (self.model.inputs * self.model.outputs, self.model.inputs);
        let (slopes, phases) = (self.chart.response_slopes(&self.model, z), phases(&self.delays, z));
        let g = delayed(&self.model, &self.delays, share);
        let parameters = self.root.ncols();
        let others: Vec<_> = self.rivals.iter().map(|(model, delays, _)| delayed(model, delays, share)).collect();
        let missed = self.missed.as_ref().map_or_else(Vec::new, |missed| missed.at_most(share, entries));
        let of_rivals = parameters + others.len();
        Mat::from_fn(entries, of_rivals + 2 * missed.len(), |i, k| match k {
            k if k < parameters => {
                let along = |sum: c64, j: usize| sum + slopes[(i, j)] * self.root[(j, k)];
                (0..self.root.nrows()).fold(c64::ZERO, along) * phases[i % m]
            }
            k if k < of_rivals => (others[k - parameters][i] - g[i]) * self.rivals[k - parameters].2,
            // What the excitation shows of the error is its size, not its phase.
            k if (k - of_rivals) / 2 == i => {
                let size = (0.5 * missed[i]).max(0.0).sqrt();
                if (k - of_rivals).is_multiple_of(2) { c64::new(size, 0.0) } else { c64::new(0.0, size) }
            }
            _ => c64::ZERO,
        })
    }

    /// Mean square of the error of each entry.
    pub(crate) fn variances(&self, share: f64) -> Vec<f64> {
        let errors = self.at(share);
        (0..errors.nrows()).map(|i| (0..errors.ncols()).map(|k| errors[(i, k)].norm_sqr()).sum()).collect()
    }
}
