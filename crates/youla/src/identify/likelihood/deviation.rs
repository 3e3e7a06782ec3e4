//! Standard deviations of the response, from the information of the record and from the scatter over models that the record
//! does not tell apart.
//!
//! ```text
//! var G = slopes (J'J)^-1 slopes^* + sum of w_c |G_c - G|^2,     w_c ~ exp(-(deviance + 4 parameters) / 2)
//! ```

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

/// Frequencies as shares of the sample rate at which deviations are stated.
pub(crate) fn grid(samples: usize) -> Vec<f64> {
    let (from, to, points) = ((20.0 / samples.max(40) as f64).clamp(1e-4, 1e-2), 0.495_f64, 150);
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

/// Standard deviation of each entry of G (row by row) at each frequency, scaled channels.
pub(crate) fn deviations(spectra: &Spectra, solution: &Solution, shares: &[f64], more: &More<'_>) -> Vec<Vec<f64>> {
    let found = &solution.chosen.found;
    let chart = Chart::new(&found.point.model, found.feedthrough);
    let linearised = linearise(spectra, &found.point, &chart, &found.noise);
    let root = inverse_root(&linearised.factor, chart.parameters());
    let least = solution.rivals.iter().map(|c| c.found.lenient()).fold(f64::INFINITY, f64::min);
    let weights: Vec<f64> = solution.rivals.iter().map(|c| (-0.5 * (c.found.lenient() - least)).exp()).collect();
    let total: f64 = weights.iter().sum::<f64>().max(1e-300);
    let at = |share: &f64| {
        let z = c64::cis(std::f64::consts::TAU * share);
        let slopes = chart.response_slopes(&found.point.model, z);
        let g = response(&solution.chosen, *share);
        let mut variance: Vec<f64> = (0..slopes.nrows())
            .map(|i| {
                more.scatter
                    * (0..root.ncols())
                        .map(|k| {
                            (0..root.nrows()).fold(c64::ZERO, |sum, j| sum + slopes[(i, j)] * root[(j, k)]).norm_sqr()
                        })
                        .sum::<f64>()
            })
            .collect();
        for (rival, weight) in solution.rivals.iter().zip(&weights) {
            for ((v, other), g) in variance.iter_mut().zip(response(rival, *share)).zip(&g) {
                *v += weight / total * (other - g).norm_sqr();
            }
        }
        let missed = more.missed.map_or_else(Vec::new, |missed| missed.near(*share, variance.len()));
        variance.iter_mut().zip(missed).for_each(|(v, m)| *v += m);
        variance.into_iter().map(f64::sqrt).collect()
    };
    shares.iter().map(at).collect()
}
