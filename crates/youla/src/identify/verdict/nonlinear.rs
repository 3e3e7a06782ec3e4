//! Nonlinear functions at the inputs: does a function of the input, or of the velocity that it causes, explain what the model
//! leaves?
//!
//! ```text
//! y - G u = G f theta + e,     f = u^3, u |u|, u^2, u beyond a limit, tanh(velocity / small)
//! ```
//! theta is estimated together with the parameters of the model, to which the linear part of f belongs.

use super::limits::{LARGEST_NONLINEAR, LARGEST_OF_INPUT};
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

/// Functions of the input in units of its standard deviation: smooth ones, and what saturation takes away.
const OF_INPUT: [fn(f64) -> f64; 5] =
    [|u| u.powi(3), |u| u * u.abs(), |u| u * u, |u| u - u.clamp(-1.0, 1.0), |u| u - u.clamp(-1.5, 1.5)];
/// Velocity of which friction changes its sign, in standard deviations.
const SMALL_VELOCITY: f64 = 0.1;
/// Functions for each input: friction first, so that what stands behind it is what friction does not explain.
const FUNCTIONS: usize = OF_INPUT.len() + 1;

/// Names of the functions of the input.
const NAMES: [&str; FUNCTIONS] =
    ["dry friction", "u^3", "u |u|", "u^2", "saturation at one deviation", "saturation at 1.5 deviations"];

/// The functions of one record: what they do to the outputs, and how large they are without their linear parts.
struct Shaped {
    /// Lines x p x functions.
    columns: Vec<c64>,
    /// Root mean square of each function without its part along the input or the velocity.
    sizes: Vec<f64>,
}

/// Which nonlinear function of the input, or of the velocity, acts at the input, and how large is it against the input?
pub(crate) fn nonlinear(spectra: &Spectra, solution: &Solution) -> Vec<Evidence> {
    let found = &solution.chosen.found;
    let residuals = found.point.residuals(spectra);
    let pairs = spectra.records.iter().zip(&residuals);
    let clean: Vec<Vec<c64>> = pairs.map(|(lines, v)| lines.y.iter().zip(v).map(|(y, v)| y - v).collect()).collect();
    let mut planner = FftPlanner::new();
    let pairs = spectra.records.iter().zip(&clean);
    let shaped: Vec<Shaped> =
        pairs.map(|(lines, clean)| columns(spectra, solution, lines, clean, &mut planner)).collect();
    let sizes: Vec<f64> = (0..FUNCTIONS * spectra.inputs)
        .map(|f| shaped.iter().map(|s| s.sizes[f]).sum::<f64>() / shaped.len().max(1) as f64)
        .collect();
    let values: Vec<Vec<c64>> = shaped.into_iter().map(|s| s.columns).collect();
    let chart = Chart::new(&found.point.model, found.feedthrough);
    let count = FUNCTIONS * spectra.inputs;
    let extra = Extra { count, values: &values, quick: false };
    let factor = linearise_with(spectra, &found.point, &chart, &found.noise, &extra).factor;
    let factor = with_slope_of_unstable(factor, spectra, &found.point.model, &chart);
    let parameters = chart.parameters();
    let rows = parameters..(parameters + count).min(factor.nrows());
    let length = |c: usize| (0..factor.nrows()).map(|i| factor[(i, c)].powi(2)).sum::<f64>();
    // Each function alone: its coefficient beside the parameters, with its deviation.
    let single = |f: usize| {
        let along: f64 = rows.clone().map(|i| factor[(i, parameters + f)] * factor[(i, parameters + count)]).sum();
        let own: f64 = rows.clone().map(|i| factor[(i, parameters + f)].powi(2)).sum();
        if own > DISTINCT * length(parameters + f) {
            (along / own * sizes[f], along.abs() / own.sqrt())
        } else {
            (0.0, 0.0)
        }
    };
    let telling = (0..count).map(|f| (f, single(f))).max_by(|a, b| a.1.1.total_cmp(&b.1.1));
    let (f, (size, significance)) = telling.unwrap_or((0, (0.0, 0.0)));
    let question = "Nonlinear part of what acts at the inputs, over the inputs (nonlinearity)";
    let note = format!("most likely {} at input {}", NAMES[f / spectra.inputs], f % spectra.inputs + 1);
    let of_size = Evidence::new(question, size.abs(), LARGEST_NONLINEAR).noted(note).beyond_chance(significance);
    // Functions of the input behind friction.
    let behind: Vec<usize> = rows
        .filter(|i| *i >= parameters + spectra.inputs && factor[(*i, *i)].powi(2) > DISTINCT * length(*i))
        .collect();
    let statistic: f64 = behind.iter().map(|i| factor[(*i, parameters + count)].powi(2)).sum();
    let moved = energy(spectra, &clean, &found.noise).max(TINY);
    let share = ((statistic - behind.len() as f64).max(0.0) / moved).sqrt();
    let question = "Output that a nonlinear function of the inputs explains beyond friction, over what the model explains (saturation)";
    let significance = chi_square_deviations(statistic, behind.len() as f64);
    vec![of_size, Evidence::new(question, share, LARGEST_OF_INPUT).beyond_chance(significance)]
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
) -> Shaped {
    let (m, p, half) = (spectra.inputs, spectra.outputs, lines.z.len());
    let count = FUNCTIONS * m;
    let model = &solution.chosen.found.point.model;
    let responses: Vec<Vec<c64>> = lines.z.iter().map(|z| model.response(*z)).collect();
    let mut columns = vec![c64::ZERO; half * p * count];
    let mut sizes = vec![0.0; count];
    for j in 0..m {
        let u = in_time(lines, planner, |k| lines.u[k * m + j]);
        // velocity of the output that this input moves most
        let power = |i: usize| responses.iter().map(|g| g[i * m + j].norm_sqr()).sum::<f64>();
        let seen = (0..p).max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(0);
        // What the model of an unstable plant makes of u rests on later samples too, which depend on the noise.
        let moved = if model.unstable() > 0.0 { &lines.y } else { clean };
        let velocity = in_time(lines, planner, |k| moved[k * p + seen] * (c64::ONE - lines.z[k].conj()));
        for f in 0..FUNCTIONS {
            let shaped = |t: usize| {
                f.checked_sub(1).map_or_else(|| (velocity[t] / SMALL_VELOCITY).tanh(), |f| OF_INPUT[f](u[t]))
            };
            sizes[f * m + j] = beside((0..lines.samples).map(|t| (shaped(t), if f > 0 { u[t] } else { velocity[t] })));
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
    Shaped { columns, sizes }
}

/// Root mean square of a signal without its mean and its part along another one of mean zero and unit size.
fn beside(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut count, mut mean, mut square, mut along) = (0.0, 0.0, 0.0, 0.0);
    for (value, base) in pairs {
        (count, mean, square, along) = (count + 1.0, mean + value, square + value * value, along + value * base);
    }
    let count = f64::max(count, 1.0);
    (square / count - (mean / count).powi(2) - (along / count).powi(2)).max(0.0).sqrt()
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
