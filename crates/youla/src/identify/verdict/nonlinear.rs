//! What is neither linear nor constant: does a function of the input, of the velocity that it causes, or of time explain what the model
//! leaves?
//!
//! ```text
//! y - G u = G f theta + b beta + x G u delta + e,     f = u^3, u |u|, u^2, u beyond a limit, tanh(velocity / small)
//! ```
//! Dry friction is a function of the velocity at the input, backlash one at the output, b = tanh(velocity / small), and a drift of the gain
//! has x from -1 to 1 over the records. theta, beta and delta are estimated together with the parameters of the model, to which the
//! linear and constant parts belong.

use super::limits::{
    BAND_LINES, BAND_RATIO, BEYOND_CHANCE, LARGEST_CHANGE_OF_GAIN, LARGEST_NONLINEAR, LARGEST_OF_INPUT, LARGEST_PLAY,
    LASTING,
};
use crate::identify::likelihood::Evidence;
use crate::identify::likelihood::choose::problem::Solution;
use crate::identify::likelihood::data::spectra::{Lines, Spectra};
use crate::identify::likelihood::search::by_output::{Ends, Normal};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::linearise::{Extra, linearise_with};
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::point::energy;
use crate::identify::likelihood::search::separable::separable;
use crate::identify::likelihood::search::unstable::{self, with_slope_of_growth};
use crate::linalg::TINY;
use crate::signal::of_two_real;
use crate::statistics::chi_square_deviations;
use faer::{Mat, c64};
use rayon::prelude::*;
use rustfft::{Fft, FftPlanner};

/// Functions of the input in units of its standard deviation: smooth ones, and what saturation takes away.
const OF_INPUT: [fn(f64) -> f64; 5] =
    [|u| u.powi(3), |u| u * u.abs(), |u| u * u, |u| u - u.clamp(-1.0, 1.0), |u| u - u.clamp(-1.5, 1.5)];
/// Velocity of which friction changes its sign, in standard deviations.
const SMALL_VELOCITY: f64 = 0.1;
/// Place of backlash among the functions for each input: friction first, so that what stands behind it is what friction does not explain,
/// and backlash last.
const BACKLASH: usize = 1 + OF_INPUT.len();
/// Functions for each input.
const FUNCTIONS: usize = BACKLASH + 1;

/// Names of the functions.
const NAMES: [&str; FUNCTIONS] =
    ["dry friction", "u^3", "u |u|", "u^2", "saturation at one deviation", "saturation at 1.5 deviations", "backlash"];

/// The functions of one record: what they do to the outputs, and how large they are without their linear parts.
struct Shaped {
    /// Lines x p x functions.
    columns: Vec<c64>,
    /// Root mean square of each function without its part along the input or the velocity.
    sizes: Vec<f64>,
    /// Lines of the functions, those of one after the other.
    plain: Vec<Vec<c64>>,
}

/// What acts at an input and is no linear function of it, over frequency.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct NonlinearPart {
    /// The input.
    pub(crate) input: usize,
    /// Middles of bands as shares of the sample rate, power of this part, and of the input.
    bands: Vec<[f64; 3]>,
}

impl NonlinearPart {
    /// Bands of 40 lines: of `c f` what no response to the input gives.
    fn new(spectra: &Spectra, shaped: &[Shaped], input: usize, of: usize, c: f64) -> Self {
        let m = spectra.inputs;
        let lines = spectra.records.iter().map(|lines| lines.z.len()).min().unwrap_or(0);
        let count = (lines / BAND_LINES).max(1);
        let mut sums = vec![(0.0, c64::ZERO, 0.0); count];
        for (lines, shaped) in spectra.records.iter().zip(shaped) {
            let total = lines.z.len();
            for (k, f) in shaped.plain[of].iter().enumerate() {
                let (sum, u) = (&mut sums[(k * count / total).min(count - 1)], lines.u[k * m + input]);
                *sum = (sum.0 + f.norm_sqr(), sum.1 + f * u.conj(), sum.2 + u.norm_sqr());
            }
        }
        let band = |(k, (f, fu, u)): (usize, (f64, c64, f64))| {
            [0.5 * (k as f64 + 0.5) / count as f64, c * c * (f - fu.norm_sqr() / u.max(TINY)).max(0.0), u]
        };
        NonlinearPart { input, bands: sums.into_iter().enumerate().map(band).collect() }
    }

    /// Whether it is that of a plant with so many inputs.
    #[cfg(feature = "serde")]
    pub(crate) fn is_of(&self, inputs: usize) -> bool {
        self.input < inputs && !self.bands.is_empty()
    }

    /// Mean square of the error of the response that stays of it, relative to the response, over a third of an octave.
    pub(crate) fn near(&self, share: f64) -> f64 {
        let (from, to) = (share / BAND_RATIO, share * BAND_RATIO);
        let first = self.bands.partition_point(|b| b[0] < from).min(self.bands.len() - 1);
        let end = self.bands.partition_point(|b| b[0] <= to).max(first + 1);
        let sum = |k: usize| self.bands[first..end].iter().map(|b| b[k]).sum::<f64>();
        LASTING * sum(1) / sum(2).max(TINY)
    }
}

/// Which nonlinear function of the input, or of the velocity, acts at the input, and how large is it against the input? Beyond chance it comes
/// with its power over frequency.
pub(crate) fn nonlinear(spectra: &Spectra, solution: &Solution) -> (Vec<Evidence>, Option<NonlinearPart>) {
    let found = &solution.chosen.found;
    let residuals = found.point.residuals(spectra);
    let pairs = spectra.records.iter().zip(&residuals);
    let clean: Vec<Vec<c64>> = pairs.map(|(lines, v)| lines.y.iter().zip(v).map(|(y, v)| y - v).collect()).collect();
    let mut planner = FftPlanner::new();
    let pairs = spectra.records.iter().zip(&clean);
    let total: usize = spectra.records.iter().map(|lines| lines.samples).sum();
    let mut first = 0;
    let mut shaped: Vec<Shaped> = pairs
        .map(|(lines, clean)| {
            let time = |t: usize| 2.0 * (first + t) as f64 / total as f64 - 1.0;
            let found = columns(spectra, solution, lines, (clean, &time), &mut planner);
            first += lines.samples;
            found
        })
        .collect();
    let sizes: Vec<f64> = (0..FUNCTIONS * spectra.inputs)
        .map(|f| shaped.iter().map(|s| s.sizes[f]).sum::<f64>() / shaped.len().max(1) as f64)
        .collect();
    let values: Vec<Vec<c64>> = shaped.iter_mut().map(|s| std::mem::take(&mut s.columns)).collect();
    let chart = Chart::new(&found.point.model, found.feedthrough);
    let drift = FUNCTIONS * spectra.inputs;
    let count = drift + 1;
    let extra = Extra { count, values: &values, quick: false };
    let (factor, lengths) = beside_parameters(spectra, solution, &chart, &extra);
    let rows = 0..factor.nrows();
    // Each function alone: its coefficient beside the parameters, with its deviation.
    let single = |f: usize| {
        let along: f64 = rows.clone().map(|i| factor[(i, f)] * factor[(i, count)]).sum();
        let own: f64 = rows.clone().map(|i| factor[(i, f)].powi(2)).sum();
        if own > DISTINCT * lengths[f] { (along / own, along.abs() / own.sqrt()) } else { (0.0, 0.0) }
    };
    let telling = |backlash: bool| {
        let these = (0..drift).filter(|f| (f / spectra.inputs == BACKLASH) == backlash);
        let telling = these.map(|f| (f, single(f))).max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        telling.unwrap_or((0, (0.0, 0.0)))
    };
    let (f, (c, significance)) = telling(false);
    let size = c * sizes[f];
    let nonlinear_part =
        (significance > BEYOND_CHANCE).then(|| NonlinearPart::new(spectra, &shaped, f % spectra.inputs, f, c));
    let question = "Nonlinear part of what acts at the inputs, over the inputs (nonlinearity)";
    let of_size = Evidence::new(question, size.abs(), LARGEST_NONLINEAR).beyond_chance(significance);
    let of_size = match significance > BEYOND_CHANCE {
        true => of_size.noted(format!("most likely {} at input {}", NAMES[f / spectra.inputs], f % spectra.inputs + 1)),
        false => of_size,
    };
    let of_play = play(&found.point.model, telling(true).1, significance);
    let (c, significance) = single(drift);
    let question = "Change of the gain from the first sample to the last, over the gain (drift of the gain)";
    let of_drift =
        Evidence::new(question, 2.0 * c.abs(), LARGEST_CHANGE_OF_GAIN).beyond_chance(significance).reported();
    // Functions of the input behind friction.
    let behind: Vec<usize> = rows
        .filter(|i| {
            (spectra.inputs..BACKLASH * spectra.inputs).contains(i) && factor[(*i, *i)].powi(2) > DISTINCT * lengths[*i]
        })
        .collect();
    let statistic: f64 = behind.iter().map(|i| factor[(*i, count)].powi(2)).sum();
    let moved = energy(spectra, &clean, &found.noise).max(TINY);
    let share = ((statistic - behind.len() as f64).max(0.0) / moved).sqrt();
    let question = "Output that a nonlinear function of the inputs explains beyond friction, over what the model explains (saturation)";
    let significance = chi_square_deviations(statistic, behind.len() as f64);
    let of_input = Evidence::new(question, share, LARGEST_OF_INPUT).beyond_chance(significance);
    (vec![of_size, of_input, of_play, of_drift], nonlinear_part)
}

/// Play by its coefficient, with its deviations beyond chance: friction that is more so moves the output where its velocity changes sign, too.
fn play(model: &Model, (c, significance): (f64, f64), friction: f64) -> Evidence {
    let question = "Play of an output where its velocity changes sign, over the output (backlash)";
    if runs_away(model) {
        let why = "the plant is unstable, and its motion without noise is not known";
        return Evidence::untested(question, LARGEST_PLAY, why).reported();
    }
    // tanh goes from -1 to 1: the play is twice its coefficient.
    let of_play = Evidence::new(question, 2.0 * c.abs(), LARGEST_PLAY).beyond_chance(significance).reported();
    match significance > BEYOND_CHANCE.max(friction) {
        true => of_play.noted("beyond chance, and more so than dry friction"),
        false => of_play,
    }
}

/// The triangle `[R r]` of further columns beside the parameters, and the squared lengths of these columns.
fn beside_parameters(spectra: &Spectra, solution: &Solution, chart: &Chart, extra: &Extra<'_>) -> (Mat<f64>, Vec<f64>) {
    let found = &solution.chosen.found;
    if separable(spectra.outputs) {
        let normal = Normal::with(spectra, &found.point, chart, &found.noise, (Ends::Shared, extra));
        return normal.with_slope(unstable::slope(unstable::growth, spectra, &found.point.model, chart)).extra();
    }
    let factor = linearise_with(spectra, &found.point, chart, &found.noise, extra).factor;
    let factor = with_slope_of_growth(factor, spectra, &found.point.model, chart);
    let (first, count) = (chart.parameters(), extra.count);
    let length = |c: usize| (0..factor.nrows()).map(|i| factor[(i, first + c)].powi(2)).sum::<f64>();
    let rows = factor.nrows().saturating_sub(first).min(count);
    let triangle = Mat::from_fn(rows, count + 1, |i, j| factor[(first + i, first + j)]);
    (triangle, (0..count).map(length).collect())
}

/// Share of a function that must be left beside the parameters of the model: of an input with two values every function is linear.
const DISTINCT: f64 = 1e-8;

/// Growth of a pole from which the motion without noise is not known: what the model makes of u rests on later samples, and so on the noise
/// that the feedback brings to them, over `1 / ln` of it, 200 samples. Chosen, not measured.
const SLOW_GROWTH: f64 = 1.005;

fn runs_away(model: &Model) -> bool {
    model.poles().iter().any(|p| p.norm() > SLOW_GROWTH)
}

/// The functions of one record seen through the model, lines x p x functions.
fn columns(
    spectra: &Spectra,
    solution: &Solution,
    lines: &Lines,
    (clean, time): (&[c64], &dyn Fn(usize) -> f64),
    planner: &mut FftPlanner<f64>,
) -> Shaped {
    let (m, p, half) = (spectra.inputs, spectra.outputs, lines.z.len());
    let (drift, count) = (FUNCTIONS * m, FUNCTIONS * m + 1);
    let model = &solution.chosen.found.point.model;
    let responses: Vec<Vec<c64>> = lines.z.iter().map(|z| model.response(*z)).collect();
    let mut columns = vec![c64::ZERO; half * p * count];
    let (mut sizes, mut plain) = (vec![0.0; drift], vec![Vec::new(); drift]);
    // What the model of an unstable plant makes of u rests on later samples too, which depend on the noise.
    let grows = model.poles().iter().any(|p| p.norm() > 1.0);
    let moved = if grows { &lines.y } else { clean };
    let root = (lines.samples as f64).sqrt();
    let fft = planner.plan_fft_forward(lines.samples);
    for i in 0..p {
        let (size, y) = in_time(lines, planner, |k| moved[k * p + i]);
        let [drifted, _] = lines_of_two(&*fft, lines.samples, |t| c64::new(time(t) * size * y[t] / root, 0.0));
        (0..half).for_each(|k| columns[(k * p + i) * count + drift] = drifted[k]);
    }
    for j in 0..m {
        let (_, u) = in_time(lines, planner, |k| lines.u[k * m + j]);
        // velocity of the output that this input moves most
        let power = |i: usize| responses.iter().map(|g| g[i * m + j].norm_sqr()).sum::<f64>();
        let seen = (0..p).max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap_or(0);
        let mut velocity_of =
            |y: &[c64]| in_time(lines, planner, |k| y[k * p + seen] * (c64::ONE - lines.z[k].conj())).1;
        let without_noise = velocity_of(clean);
        let measured = grows.then(|| velocity_of(moved));
        let velocity = measured.as_ref().unwrap_or(&without_noise);
        let base = |f: usize| match f {
            0 => velocity,
            BACKLASH => &without_noise,
            _ => &u,
        };
        let shaped = |f: usize, t: usize| match f {
            0 | BACKLASH => (base(f)[t] / SMALL_VELOCITY).tanh(),
            _ => OF_INPUT[f - 1](base(f)[t]),
        };
        let pairs = (0..FUNCTIONS).into_par_iter().step_by(2).map(|f| {
            let second = |t: usize| if f + 1 < FUNCTIONS { shaped(f + 1, t) } else { 0.0 };
            lines_of_two(&*fft, lines.samples, |t| c64::new(shaped(f, t), second(t)))
        });
        let pairs: Vec<[Vec<c64>; 2]> = pairs.collect();
        for (f, of_function) in pairs.into_iter().flatten().take(FUNCTIONS).enumerate() {
            sizes[f * m + j] = beside((0..lines.samples).map(|t| (shaped(f, t), base(f)[t])));
            for k in 0..half {
                let column = |i: usize| (k * p + i) * count + f * m + j;
                match f {
                    BACKLASH => columns[column(seen)] = of_function[k],
                    _ => (0..p).for_each(|i| columns[column(i)] = responses[k][i * m + j] * of_function[k]),
                }
            }
            plain[f * m + j] = of_function;
        }
    }
    Shaped { columns, sizes, plain }
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

/// Lines of two signals, the real and the imaginary parts of `both`, from the first above zero, over the root of their number of samples.
fn lines_of_two(fft: &dyn Fft<f64>, samples: usize, both: impl Fn(usize) -> c64) -> [Vec<c64>; 2] {
    let mut work: Vec<c64> = (0..samples).map(both).collect();
    fft.process(&mut work);
    let half = 0.5 / (samples as f64).sqrt();
    (1..=samples / 2).map(|k| <(c64, c64)>::from(of_two_real(&work, k, half))).unzip().into()
}

/// Size of a signal and the signal in time from its lines, without its mean and of unit size.
fn in_time(lines: &Lines, planner: &mut FftPlanner<f64>, pick: impl Fn(usize) -> c64) -> (f64, Vec<f64>) {
    let samples = lines.samples;
    let mut work = vec![c64::ZERO; samples];
    for k in 0..lines.z.len() {
        let v = pick(k);
        work[k + 1] = v;
        work[samples - 1 - k] = v.conj();
    }
    planner.plan_fft_inverse(samples).process(&mut work);
    let size = (work.iter().map(|v| v.re * v.re).sum::<f64>() / samples.max(1) as f64).sqrt().max(TINY);
    (size, work.iter().map(|v| v.re / size).collect())
}
