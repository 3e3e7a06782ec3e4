//! Standard deviations of the response, from the information of the record and from the scatter over models that the record
//! does not distinguish.
//!
//! ```text
//! var G = slopes (J'J)^-1 slopes^* + sum of w_c |G_c - G|^2,     w_c ~ exp(-criterion / 2)
//! ```
//! The weights are those of Schwarz's criterion, which approximates the posterior probability of a model.

use super::chart::Chart;
use super::linearise::linearise;
use super::missed::Missed;
use super::problem::{Choice, Solution};
use super::spectra::Spectra;
use faer::{Mat, c64};

/// Inverse of the leading triangle of `[R r; 0 *]` with columns of unit length, and these lengths; directions that the record
/// does not determine are left large.
pub(crate) fn inverse_root(factor: &Mat<f64>, parameters: usize) -> Mat<f64> {
    let rows = parameters.min(factor.nrows());
    let lengths: Vec<f64> = (0..parameters).map(|j| factor.col(j).norm_l2().max(1e-300)).collect();
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
    let z = c64::cis(std::f64::consts::TAU * share);
    let mut g = choice.found.point.model.response(z);
    let m = choice.delays.len();
    for (k, g) in g.iter_mut().enumerate() {
        *g *= z.conj().powu(choice.delays[k % m] as u32);
    }
    g
}

/// What the records say beyond their information.
pub(crate) struct More<'a> {
    /// Factor of the variance of the parameters: their scatter over pieces of the records.
    pub(crate) scatter: f64,
    /// The error that the excitation shows.
    pub(crate) missed: Option<&'a Missed>,
}

/// Second moments of the error e of an entry of G: `E |e|^2` and `E e^2`.
#[derive(Clone, Copy)]
pub(crate) struct Moments {
    pub(crate) variance: f64,
    pub(crate) pseudo_variance: c64,
}

impl Moments {
    const ZERO: Self = Moments { variance: 0.0, pseudo_variance: c64::ZERO };

    fn add(&mut self, error: c64, weight: f64) {
        self.variance += weight * error.norm_sqr();
        self.pseudo_variance += error * error * weight;
    }
}

/// Moments of the error of each entry of G (row by row) at each frequency, scaled channels.
pub(crate) fn deviations(spectra: &Spectra, solution: &Solution, shares: &[f64], more: &More<'_>) -> Vec<Vec<Moments>> {
    let found = &solution.chosen.found;
    let chart = Chart::new(&found.point.model, found.feedthrough);
    let linearised = linearise(spectra, &found.point, &chart, &found.noise);
    let root = inverse_root(&linearised.factor, chart.parameters());
    let least = solution.rivals.iter().map(|c| c.criterion).fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = solution.rivals.iter().map(|c| (-0.5 * (c.criterion - least)).exp()).collect();
    let total: f64 = weights.iter().sum::<f64>().max(1e-300);
    let at = |share: &f64| {
        let z = c64::cis(std::f64::consts::TAU * share);
        let slopes = chart.response_slopes(&found.point.model, z);
        let g = response(&solution.chosen, *share);
        let along =
            |i: usize, k: usize| (0..root.nrows()).fold(c64::ZERO, |sum, j| sum + slopes[(i, j)] * root[(j, k)]);
        let mut moments = vec![Moments::ZERO; slopes.nrows()];
        for (i, of) in moments.iter_mut().enumerate() {
            (0..root.ncols()).for_each(|k| of.add(along(i, k), more.scatter));
        }
        for (rival, weight) in solution.rivals.iter().zip(&weights) {
            for ((of, other), g) in moments.iter_mut().zip(response(rival, *share)).zip(&g) {
                of.add(other - g, weight / total);
            }
        }
        // What the excitation shows of the error is its size, not its phase.
        let missed = more.missed.map_or_else(Vec::new, |missed| missed.at_most(*share, moments.len()));
        moments.iter_mut().zip(missed).for_each(|(of, m)| of.variance += m);
        moments
    };
    shares.iter().map(at).collect()
}
