//! What is neither linear nor constant: does a function of the input, of the velocity that it causes, or of time explain what the model
//! leaves?
//!
//! ```text
//! y - G u = G f theta + b beta + x G u delta + e,     f = u^3, u |u|, u^2, u beyond a limit, tanh(velocity / small)
//! ```
//! Dry friction is a function at the input of a velocity: of the output or of its difference. Backlash is one at the output,
//! b = tanh(velocity / small). A drift of the gain has x from -1 to 1 over the records. theta, beta and delta are estimated together with the
//! parameters of the model, to which the linear and constant parts belong.

use super::functions::{EARLIER, FINE_LIMITS, FRICTIONS, LIMITS, Motion, Shape, Shaped, columns, lines_of_motion};
use super::limits::{
    BAND_LINES, BAND_RATIO, BEYOND_CHANCE, FRICTION_ELSEWHERE, LARGEST_CHANGE_OF_GAIN, LARGEST_NONLINEAR,
    LARGEST_OF_INPUT, LARGEST_PLAY, LASTING,
};
use crate::identify::likelihood::Evidence;
use crate::identify::likelihood::choose::problem::Solution;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::by_output::{Ends, Normal};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::linearise::{Extra, Filter, linearise_with};
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::point::energy;
use crate::identify::likelihood::search::separable::separable;
use crate::identify::likelihood::search::unstable::{self, with_slope_of_growth};
use crate::linalg::TINY;
use crate::statistics::chi_square_deviations;
use faer::{Mat, c64};
use rustfft::FftPlanner;

/// A channel of the plant.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
enum Channel {
    Input(usize),
    Output(usize),
}

impl Channel {
    /// Its place among the inputs or among the outputs.
    fn place(self) -> usize {
        match self {
            Channel::Input(place) | Channel::Output(place) => place,
        }
    }
}

/// What acts at an input, or at an output, and is no linear function of it, over frequency.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct NonlinearPart {
    channel: Channel,
    /// What of it no response to the channel gives, beside the channel.
    rest: Bands,
    /// Of friction and play, what a response to the motion gives.
    linear: Option<Equivalent>,
}

/// The linear function of a motion v that stands for friction or play, `c f = k v`: the model has it as if it belonged to the linear plant, and at
/// another amplitude it is another.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Equivalent {
    motion: Motion,
    /// k^2 v^2, beside v^2.
    bands: Bands,
}

/// Middles of bands of 40 lines as shares of the sample rate, with the power of two signals in each.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Bands(Vec<[f64; 3]>);

impl Bands {
    /// Powers of what `of` makes of the power of f, its product with x and the power of x, beside that of x. `pairs` holds the lines of both for each
    /// record, those of x among several channels.
    fn new(pairs: &[(&[c64], &[c64])], (place, channels): (usize, usize), of: impl Fn(f64, c64, f64) -> f64) -> Self {
        let lines = pairs.iter().map(|(f, _)| f.len()).min().unwrap_or(0);
        let count = (lines / BAND_LINES).max(1);
        let mut sums = vec![(0.0, c64::ZERO, 0.0); count];
        for (f, x) in pairs {
            let total = f.len();
            for (k, f) in f.iter().enumerate() {
                let (sum, x) = (&mut sums[(k * count / total).min(count - 1)], x[k * channels + place]);
                *sum = (sum.0 + f.norm_sqr(), sum.1 + f * x.conj(), sum.2 + x.norm_sqr());
            }
        }
        let band = |(k, (f, fx, x)): (usize, (f64, c64, f64))| [0.5 * (k as f64 + 0.5) / count as f64, of(f, fx, x), x];
        Bands(sums.into_iter().enumerate().map(band).collect())
    }

    /// The first power over the second, over a third of an octave.
    fn ratio(&self, share: f64) -> f64 {
        let (from, to) = (share / BAND_RATIO, share * BAND_RATIO);
        let first = self.0.partition_point(|b| b[0] < from).min(self.0.len() - 1);
        let end = self.0.partition_point(|b| b[0] <= to).max(first + 1);
        let sum = |k: usize| self.0[first..end].iter().map(|b| b[k]).sum::<f64>();
        sum(1) / sum(2).max(TINY)
    }
}

impl NonlinearPart {
    /// Whether it is that of a plant with so many outputs and inputs.
    #[cfg(feature = "serde")]
    pub(crate) fn is_of(&self, (outputs, inputs): (usize, usize)) -> bool {
        let channels = match self.channel {
            Channel::Input(_) => inputs,
            Channel::Output(_) => outputs,
        };
        let of_motion = |of: &Equivalent| of.motion.output < outputs && !of.bands.0.is_empty();
        self.channel.place() < channels && !self.rest.0.is_empty() && self.linear.as_ref().is_none_or(of_motion)
    }

    /// Adds the mean square of the error of the response that stays of it at a frequency, a share of the sample rate, to those of the entries
    /// (p x m) of the response g.
    pub(crate) fn add(&self, share: f64, errors: &mut [f64], inputs: usize, g: &[c64]) {
        self.add_relative(LASTING * self.rest.ratio(share), errors, inputs, g);
    }

    /// The same of what a linear function of the motion gives, which the model has as if it belonged to the plant without friction or play. Friction at
    /// another mass reaches the output by other signs of the modes: where these cancel in g it does not fall with g, so that it counts by the
    /// sum of their magnitudes, which comes with g.
    pub(crate) fn add_linear(&self, share: f64, errors: &mut [f64], inputs: usize, (g, modes): (&[c64], &[f64])) {
        let Some(of) = &self.linear else { return };
        let per_channel = match self.channel {
            Channel::Input(input) => {
                let entry = of.motion.output * inputs + input;
                let shown = g[entry].norm_sqr();
                (shown + FRICTION_ELSEWHERE * modes[entry].powi(2)).powi(2) / shown.max(TINY)
            }
            Channel::Output(_) => 1.0,
        };
        let relative = of.bands.ratio(share) * per_channel * of.motion.gain(share).powi(2);
        self.add_relative(relative, errors, inputs, g);
    }

    /// Adds a mean square of the error relative to the response to the entries of the channel.
    fn add_relative(&self, relative: f64, errors: &mut [f64], inputs: usize, g: &[c64]) {
        let of_channel = |entry: usize| match self.channel {
            Channel::Input(input) => entry % inputs == input,
            Channel::Output(output) => entry / inputs == output,
        };
        let moved = errors.iter_mut().enumerate().filter(|(entry, _)| of_channel(*entry));
        moved.for_each(|(entry, error)| *error += g[entry].norm_sqr() * relative);
    }
}

/// Which nonlinear function of the input, or of the velocity, acts at the input, and how large is it against the input? Beyond chance it comes
/// with its power over frequency. Where one of a few functions explains too much of the output, its limit is searched, and what counts as
/// unknown is what it leaves. Where all records together show such a function, the record with most of it counts: a command that was cut in one
/// of four records bends the model as much, and is a quarter of the figure.
pub(crate) fn nonlinear(spectra: &Spectra, solution: &Solution) -> (Vec<Evidence>, Vec<NonlinearPart>) {
    let (mut evidence, parts) = of_all(spectra, solution);
    let significant = evidence[..OF_RECORDS].iter().any(|e| e.significance.is_some_and(|s| s > BEYOND_CHANCE));
    if spectra.records.len() > 1 && significant {
        let Solution { chosen, samples, .. } = solution;
        let mut alone = Solution { chosen: chosen.clone(), rivals: Vec::new(), unseen: None, samples: *samples };
        for (k, lines) in spectra.records.iter().enumerate() {
            alone.chosen.found.point.ends = vec![solution.chosen.found.point.ends[k].clone()];
            let of_record =
                of_all(&Spectra { records: vec![lines.clone()], delays: spectra.delays.clone(), ..*spectra }, &alone).0;
            for (worst, here) in evidence[..OF_RECORDS].iter_mut().zip(of_record) {
                if here.figure > worst.figure && !here.holds() {
                    let place = format!("in record {} of {}", k + 1, spectra.records.len());
                    let note = if here.note.is_empty() { place } else { format!("{}, {place}", here.note) };
                    *worst = here.noted(note);
                }
            }
        }
    }
    (evidence, parts)
}

/// The figures that count record by record: the nonlinear part, and the output that is a function of the inputs.
const OF_RECORDS: usize = 2;

/// The same of all records together.
fn of_all(spectra: &Spectra, solution: &Solution) -> (Vec<Evidence>, Vec<NonlinearPart>) {
    let beside = Beside::new(spectra, solution, Shape::all(&LIMITS));
    let unknown = beside.unknown(None);
    if unknown.holds() {
        return beside.evidence(unknown);
    }
    let beside = Beside::new(spectra, solution, Shape::all(&FINE_LIMITS));
    let unknown = beside.unknown(Some(beside.most_significant()));
    beside.evidence(unknown)
}

/// The functions beside the parameters of the model.
struct Beside<'a> {
    spectra: &'a Spectra,
    model: &'a Model,
    shapes: Vec<Shape>,
    records: Vec<Shaped>,
    /// Lines of the outputs of each record without what the model leaves, lines x p.
    clean: Vec<Vec<c64>>,
    /// Energy of what the model explains, in standard deviations of the noise.
    explained: f64,
    /// `[R r]` of the functions, those of a shape for each input together, then the drift of the gain.
    factor: Mat<f64>,
    /// Squared lengths of their columns before the parameters are taken out.
    lengths: Vec<f64>,
}

impl<'a> Beside<'a> {
    fn new(spectra: &'a Spectra, solution: &'a Solution, shapes: Vec<Shape>) -> Self {
        let found = &solution.chosen.found;
        let model = &found.point.model;
        let residuals = found.point.residuals(spectra);
        let pairs = spectra.records.iter().zip(&residuals);
        let clean: Vec<Vec<c64>> =
            pairs.map(|(lines, v)| lines.y.iter().zip(v).map(|(y, v)| y - v).collect()).collect();
        let mut planner = FftPlanner::new();
        let total: usize = spectra.records.iter().map(|lines| lines.samples).sum();
        let mut first = 0;
        let pairs = spectra.records.iter().zip(&clean);
        let mut records: Vec<Shaped> = pairs
            .map(|(lines, clean)| {
                let time = |t: usize| 2.0 * (first + t) as f64 / total as f64 - 1.0;
                let found =
                    columns(spectra, (model, &solution.chosen.delays, &shapes), lines, (clean, &time), &mut planner);
                first += lines.samples;
                found
            })
            .collect();
        let values: Vec<Vec<c64>> = records.iter_mut().map(|s| std::mem::take(&mut s.columns)).collect();
        let chart = Chart::new(model, found.feedthrough);
        let count = shapes.len() * spectra.inputs + 1;
        let extra = Extra { count, values: &values, quick: false, filter: Filter::Held };
        let (factor, lengths) = beside_parameters(spectra, solution, &chart, &extra);
        let explained = energy(spectra, &clean, &found.noise).max(TINY);
        Beside { spectra, model, shapes, records, clean, explained, factor, lengths }
    }

    fn drift(&self) -> usize {
        self.shapes.len() * self.spectra.inputs
    }

    /// Functions of inputs and velocities; backlash is at the output.
    fn at_inputs(&self) -> std::ops::Range<usize> {
        0..self.drift() - self.spectra.inputs
    }

    /// A function alone: its coefficient beside the parameters, with its deviations beyond chance.
    fn single(&self, f: usize) -> (f64, f64) {
        self.along(f, 0).map_or((0.0, 0.0), |(along, own)| (along / own, along.abs() / own.sqrt()))
    }

    /// Products of a function with the residuals and with itself, without their parts along the parameters and the functions before `first`; `None`
    /// where these leave nothing of it.
    fn along(&self, f: usize, first: usize) -> Option<(f64, f64)> {
        let rows = first..self.factor.nrows();
        let residual = self.drift() + 1;
        let along = rows.clone().map(|i| self.factor[(i, f)] * self.factor[(i, residual)]).sum();
        let own: f64 = rows.map(|i| self.factor[(i, f)].powi(2)).sum();
        (own > DISTINCT * self.lengths[f]).then_some((along, own))
    }

    fn most(&self, among: impl Iterator<Item = usize>) -> usize {
        among.max_by(|a, b| self.single(*a).1.total_cmp(&self.single(*b).1)).unwrap_or(0)
    }

    /// The function at an input that is farthest beyond chance.
    fn most_significant(&self) -> usize {
        self.most(self.at_inputs())
    }

    /// What the functions of the inputs explain of the output beyond friction and a known one.
    fn unknown(&self, known: Option<usize>) -> Evidence {
        let (first, last) = (FRICTIONS * self.spectra.inputs, self.at_inputs().end - EARLIER * self.spectra.inputs);
        let distinct = |i: &usize| self.factor[(*i, *i)].powi(2) > DISTINCT * self.lengths[*i];
        let behind: Vec<usize> = (first..last.min(self.factor.nrows())).filter(distinct).collect();
        let residual = self.drift() + 1;
        let all: f64 = behind.iter().map(|i| self.factor[(*i, residual)].powi(2)).sum();
        let of_known = known.filter(|f| *f >= first).and_then(|f| self.along(f, first));
        let of_known = of_known.map_or(0.0, |(along, own)| along * along / own);
        let (statistic, count) = (all - of_known, behind.len() as f64 - f64::from(u8::from(of_known > 0.0)));
        let share = ((statistic - count).max(0.0) / self.explained).sqrt();
        let question = "Output that a nonlinear function of the inputs explains beyond friction, over what the model explains (saturation)";
        Evidence::new(question, share, LARGEST_OF_INPUT).beyond_chance(chi_square_deviations(statistic, count))
    }

    fn evidence(&self, unknown: Evidence) -> (Vec<Evidence>, Vec<NonlinearPart>) {
        let inputs = self.spectra.inputs;
        let f = self.most_significant();
        let (c, significance) = self.single(f);
        let size = c * self.records.iter().map(|s| s.sizes[f]).sum::<f64>() / self.records.len().max(1) as f64;
        let found = significance > BEYOND_CHANCE;
        let mut parts: Vec<NonlinearPart> = found.then(|| self.part(f, c)).into_iter().collect();
        let question = "Nonlinear part of what acts at the inputs, over the inputs (nonlinearity)";
        let mut of_size = Evidence::new(question, size.abs(), LARGEST_NONLINEAR).beyond_chance(significance);
        if found {
            let note = format!("most likely {} at input {}", self.shapes[f / inputs].name(), f % inputs + 1);
            of_size = of_size.noted(note).unless_near_the_limit(significance);
        }
        let at_output = self.most(self.at_inputs().end..self.drift());
        let (c, of_backlash) = self.single(at_output);
        let loose = of_backlash > BEYOND_CHANCE.max(significance) && !runs_away(self.model);
        parts.extend(loose.then(|| self.part(at_output, c)));
        let of_play = play(self.model, (c, of_backlash), loose);
        let (c, significance) = self.single(self.drift());
        let question = "Change of the gain from the first sample to the last, over the gain (drift of the gain)";
        let of_drift =
            Evidence::new(question, 2.0 * c.abs(), LARGEST_CHANGE_OF_GAIN).beyond_chance(significance).reported();
        (vec![of_size, unknown, of_play, of_drift], parts)
    }

    /// What a function with its coefficient adds to its channel.
    fn part(&self, f: usize, c: f64) -> NonlinearPart {
        let (m, p) = (self.spectra.inputs, self.spectra.outputs);
        let seen = self.records.first().map_or(0, |shaped| shaped.moved_most[f % m]);
        let (channel, channels) = match self.at_inputs().contains(&f) {
            false => (Channel::Output(seen), p),
            true => (Channel::Input(f % m), m),
        };
        let all = self.spectra.records.iter().zip(&self.clean).map(|(lines, clean)| match channel {
            Channel::Input(_) => &lines.u[..],
            Channel::Output(_) => &clean[..],
        });
        let plain = || self.records.iter().map(|shaped| &shaped.plain[f][..]);
        let pairs: Vec<(&[c64], &[c64])> = plain().zip(all).collect();
        let rest = Bands::new(&pairs, (channel.place(), channels), |f, fx, x| {
            c * c * (f - fx.norm_sqr() / x.max(TINY)).max(0.0)
        });
        let linear = self.shapes[f / m].motion(seen).map(|motion| {
            let pairs = self.spectra.records.iter().zip(&self.clean);
            let lines: Vec<Vec<c64>> = pairs.map(|of| lines_of_motion(of, (self.model, p), motion)).collect();
            let pairs: Vec<(&[c64], &[c64])> = plain().zip(lines.iter().map(Vec::as_slice)).collect();
            let bands = Bands::new(&pairs, (0, 1), |_, fx, x| c * c * fx.norm_sqr() / x.max(TINY));
            Equivalent { motion, bands }
        });
        NonlinearPart { channel, rest, linear }
    }
}

/// Play by its coefficient, with its deviations beyond chance; `loose` where friction is not more so, which moves the output where its velocity
/// changes sign, too.
fn play(model: &Model, (c, significance): (f64, f64), loose: bool) -> Evidence {
    let question = "Play of an output where its velocity changes sign, over the output (backlash)";
    if runs_away(model) {
        let why = "the plant is unstable, and its motion without noise is not known";
        return Evidence::untested(question, LARGEST_PLAY, why).reported();
    }
    // tanh goes from -1 to 1: the play is twice its coefficient.
    let of_play = Evidence::new(question, 2.0 * c.abs(), LARGEST_PLAY).beyond_chance(significance).reported();
    match loose {
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
