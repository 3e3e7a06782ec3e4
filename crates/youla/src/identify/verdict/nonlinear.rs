//! Nonlinear functions at the inputs: does a function of the input, or of the velocity that it causes, explain what the model
//! leaves?
//!
//! ```text
//! y - G u = G f theta + e,     f = u^3, u |u|, u^2, u beyond a limit, tanh(velocity / small)
//! ```
//! theta is estimated together with the parameters of the model, to which the linear part of f belongs.

use crate::identify::likelihood::Evidence;
use crate::identify::likelihood::choose::problem::Solution;
use crate::identify::likelihood::data::spectra::{Lines, Spectra};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::linearise::{Extra, linearise_with};
use crate::identify::likelihood::search::point::energy;
use crate::identify::likelihood::search::with_slope_of_unstable;
use crate::linalg::TINY;
use crate::statistics::chi_square_deviations;
use faer::c64;
use rustfft::FftPlanner;

/// Largest share of a nonlinear function, both weighted by the inverse of the noise. The linear model takes up most of what a
/// function does, so that little is left of much: dry friction of half the input's size left 0.7 % in a drive of two masses.
const LARGEST_SHARE: f64 = 0.005;
/// Functions of the input in units of its standard deviation: smooth ones, and what saturation takes away.
const OF_INPUT: [fn(f64) -> f64; 5] =
    [|u| u.powi(3), |u| u * u.abs(), |u| u * u, |u| u - u.clamp(-1.0, 1.0), |u| u - u.clamp(-1.5, 1.5)];
/// Velocity of which friction changes its sign, in standard deviations.
const SMALL_VELOCITY: f64 = 0.1;
/// Functions for each input.
const FUNCTIONS: usize = OF_INPUT.len() + 1;

/// Does a nonlinear function of the input, or of the velocity, act at the input?
pub(crate) fn nonlinear(spectra: &Spectra, solution: &Solution) -> Evidence {
    let found = &solution.chosen.found;
    let residuals = found.point.residuals(spectra);
    let pairs = spectra.records.iter().zip(&residuals);
    let clean: Vec<Vec<c64>> = pairs.map(|(lines, v)| lines.y.iter().zip(v).map(|(y, v)| y - v).collect()).collect();
    let mut planner = FftPlanner::new();
    let pairs = spectra.records.iter().zip(&clean);
    let values: Vec<Vec<c64>> =
        pairs.map(|(lines, clean)| columns(spectra, solution, lines, clean, &mut planner)).collect();
    let chart = Chart::new(&found.point.model, found.feedthrough);
    let count = FUNCTIONS * spectra.inputs;
    let extra = Extra { count, values: &values, quick: false };
    let factor = linearise_with(spectra, &found.point, &chart, &found.noise, &extra).factor;
    let factor = with_slope_of_unstable(factor, spectra, &found.point.model, &chart);
    let parameters = chart.parameters();
    let rows = parameters..(parameters + count).min(factor.nrows());
    let length = |c: usize| (0..factor.nrows()).map(|i| factor[(i, c)].powi(2)).sum::<f64>();
    let distinct: Vec<usize> = rows.clone().filter(|i| factor[(*i, *i)].powi(2) > DISTINCT * length(*i)).collect();
    let statistic: f64 = distinct.iter().map(|i| factor[(*i, parameters + count)].powi(2)).sum();
    // the most telling single function
    let single = |f: usize| {
        let along: f64 = rows.clone().map(|i| factor[(i, parameters + f)] * factor[(i, parameters + count)]).sum();
        let own: f64 = rows.clone().map(|i| factor[(i, parameters + f)].powi(2)).sum();
        if own > DISTINCT * length(parameters + f) { along.abs() / own.sqrt() } else { 0.0 }
    };
    let telling = (0..count).map(single).fold(0.0, f64::max);
    let moved = energy(spectra, &clean, &found.noise).max(TINY);
    Evidence::new(
        "Output that a nonlinear function at the inputs explains, over what the model explains, beyond chance (nonlinearity)",
        ((statistic - distinct.len() as f64).max(0.0) / moved).sqrt(),
        LARGEST_SHARE,
    )
    .beyond_chance(chi_square_deviations(statistic, distinct.len() as f64).max(telling))
}

/// Share of a function that must be left beside the parameters of the model: of an input with two values every function is linear.
const DISTINCT: f64 = 1e-8;

/// The functions of one record seen through the model, lines x p x functions.
fn columns(
    spectra: &Spectra,
    solution: &Solution,
    lines: &Lines,
    clean: &[c64],
    planner: &mut FftPlanner<f64>,
) -> Vec<c64> {
    let (m, p, half) = (spectra.inputs, spectra.outputs, lines.z.len());
    let count = FUNCTIONS * m;
    let model = &solution.chosen.found.point.model;
    let responses: Vec<Vec<c64>> = lines.z.iter().map(|z| model.response(*z)).collect();
    let mut columns = vec![c64::ZERO; half * p * count];
    for j in 0..m {
        let u = in_time(lines, planner, |k| lines.u[k * m + j]);
        // velocity of the output that this input moves most
        let power = |i: usize| responses.iter().map(|g| g[i * m + j].norm_sqr()).sum::<f64>();
        let seen = (0..p).max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(0);
        // What the model of an unstable plant makes of u rests on later samples too, which depend on the noise.
        let moved = if model.unstable() > 0.0 { &lines.y } else { clean };
        let velocity = in_time(lines, planner, |k| moved[k * p + seen] * (c64::ONE - lines.z[k].conj()));
        for f in 0..FUNCTIONS {
            let shaped =
                |t: usize| OF_INPUT.get(f).map_or_else(|| (velocity[t] / SMALL_VELOCITY).tanh(), |of| of(u[t]));
            let root = (lines.samples as f64).sqrt();
            let mut work: Vec<c64> = (0..lines.samples).map(|t| c64::new(shaped(t) / root, 0.0)).collect();
            planner.plan_fft_forward(lines.samples).process(&mut work);
            for k in 0..half {
                for i in 0..p {
                    columns[(k * p + i) * count + f * m + j] = responses[k][i * m + j] * work[k + 1];
                }
            }
        }
    }
    columns
}

/// A signal in time from its lines, without its mean and of unit size.
fn in_time(lines: &Lines, planner: &mut FftPlanner<f64>, pick: impl Fn(usize) -> c64) -> Vec<f64> {
    let samples = lines.samples;
    let mut work = vec![c64::ZERO; samples];
    for k in 0..lines.z.len() {
        let v = pick(k);
        work[k + 1] = v;
        work[samples - 1 - k] = v.conj();
    }
    planner.plan_fft_inverse(samples).process(&mut work);
    let size = (work.iter().map(|v| v.re * v.re).sum::<f64>() / samples.max(1) as f64).sqrt().max(TINY);
    work.iter().map(|v| v.re / size).collect()
}
