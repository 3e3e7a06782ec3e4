//! What steps of load and spikes of the outputs would explain of a record, wherever they begin.
//!
//! ```text
//! W(k) = theta z^-tau / (1 - z^-1),      T(tau) = <e, P W>^2 / |P W|^2
//! ```
//! e are the whitened residuals of a model and P leaves out what its parameters, the ends of the record and a constant input explain. T is what
//! a step at tau takes off -2 log likelihood (the generalised likelihood ratio of Willsky and Jones, IEEE Transactions on Automatic Control
//! 21 (1976), 108), for all tau at once by Fourier transforms.

use super::problem::{Choice, NOISE_ORDER};
use crate::identify::likelihood::data::lanes::LANES;
use crate::identify::likelihood::data::spectra::{Lines, Spectra};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::rows::{Place, Rows};
use crate::identify::likelihood::search::{deviance, with_best_ends};
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, c64};
use rustfft::FftPlanner;
use std::f64::consts::TAU;
use std::ops::Range;

/// Decrease of -2 log likelihood that a step must show, in log N: two for its two parameters (Schwarz), one more since it is the best of N
/// places, by chance in one record of some hundred.
const CLEAR: f64 = 3.0;
/// Squared length of a step beside what the ends explain, over that of the step, below which the record does not show it.
const SHOWN: f64 = 1e-6;
/// Samples on each side of a step within which a spike of an output may stand for it.
const NEAR: usize = 20;
/// Samples on each side of a step within which another one corrects its place.
const BESIDE: usize = 2;

/// Lines x p with the weights of the lines, whitened.
type Column = Vec<c64>;

/// What one kind of signal does to the whitened outputs wherever it begins.
struct Kind {
    /// From the first sample on.
    column: Column,
    /// Squared length beside the basis, for each place.
    left: Vec<f64>,
}

/// Steps at the inputs and spikes of the outputs at all places of a record.
pub(super) struct Places<'a> {
    lines: &'a Lines,
    inputs: usize,
    outputs: usize,
    /// Steps at each input, then spikes at each output.
    kinds: Vec<Kind>,
    /// Orthonormal: what the model, a constant input and the found steps explain.
    basis: Vec<Column>,
    /// The residual beside it.
    rest: Column,
    planner: FftPlanner<f64>,
}

impl<'a> Places<'a> {
    /// Beside the ends and the parameters of a model.
    pub(super) fn new(spectra: &'a Spectra, choice: &Choice) -> Option<Self> {
        let lines = spectra.records.first()?;
        let (m, p, noise) = (spectra.inputs, spectra.outputs, &choice.found.noise);
        let point = with_best_ends(spectra, choice.found.point.model.clone(), noise);
        // Few large steps have a colour as well, of which they would be what is expected.
        let plain = noise.has_a_colour().then(|| deviance(spectra, &point, NOISE_ORDER).1);
        let noise = plain.as_ref().unwrap_or(noise);
        let model = &point.model;
        let unit = 1.0 / (lines.samples as f64).sqrt();
        let begins = |k: usize, kind: usize, i: usize, response: &[c64]| match kind.checked_sub(m) {
            None => response[i * m + kind] * unit / (c64::ONE - lines.z[k].conj()),
            Some(o) => c64::new(if i == o { unit } else { 0.0 }, 0.0),
        };
        let signals = |k: usize| {
            let response = model.response(lines.z[k]);
            (0..p * (m + p)).map(move |x| begins(k, x % (m + p), x / (m + p), &response)).collect::<Vec<c64>>()
        };
        let signals: Vec<c64> = (0..lines.z.len()).flat_map(signals).collect();
        let chart = Chart::new(model, choice.found.feedthrough);
        let of_model = model.end_count() + chart.parameters();
        let place = Place {
            lines,
            t: &point.ends[0],
            model,
            chart: &chart,
            noise,
            entering: None,
            ends: &[],
            coefficients: false,
            more: (&signals, m + p),
        };
        let columns = whitened(place, of_model + m + p + 1);
        let kind = |column: &Column| Kind { left: vec![square(column); lines.samples], column: column.clone() };
        let kinds: Vec<Kind> = columns[of_model..of_model + m + p].iter().map(kind).collect();
        let rest = columns.last()?.clone();
        let mut found =
            Places { lines, inputs: m, outputs: p, kinds, basis: Vec::new(), rest, planner: FftPlanner::new() };
        // A constant input is what a step at the first sample is.
        columns.into_iter().take(of_model + m).for_each(|column| found.explain(column));
        Some(found)
    }

    /// Adds what a column has beside the basis to it.
    fn explain(&mut self, mut column: Column) {
        let before = square(&column);
        // Twice is enough (Giraud, Langou and Rozloznik 2005).
        for known in self.basis.iter().chain(&self.basis) {
            leave_out(&mut column, known);
        }
        let square = square(&column);
        if square.is_nan() || square <= SHOWN * SHOWN * before {
            return;
        }
        let scale = 1.0 / square.sqrt();
        column.iter_mut().for_each(|v| *v *= scale);
        leave_out(&mut self.rest, &column);
        for k in 0..self.kinds.len() {
            let along = self.along(k, &column);
            self.kinds[k].left.iter_mut().zip(along).for_each(|(left, along)| *left -= along * along);
        }
        self.basis.push(column);
    }

    /// Products of a column with a kind of signal at all places: Re sum of conj(W z^-tau) v.
    fn along(&mut self, kind: usize, column: &Column) -> Vec<f64> {
        let (samples, p) = (self.lines.samples, self.outputs);
        let mut work = vec![c64::ZERO; samples];
        for (k, (w, v)) in self.kinds[kind].column.chunks_exact(p).zip(column.chunks_exact(p)).enumerate() {
            work[k + 1] = w.iter().zip(v).map(|(w, v)| w.conj() * v).sum();
        }
        self.planner.plan_fft_inverse(samples).process(&mut work);
        work.into_iter().map(|v| v.re).collect()
    }

    /// What a kind of signal takes off -2 log likelihood at each place.
    fn gains(&mut self, kind: usize) -> Vec<f64> {
        let rest = std::mem::take(&mut self.rest);
        let along = self.along(kind, &rest);
        self.rest = rest;
        let Kind { column, left } = &self.kinds[kind];
        let least = SHOWN * square(column);
        along.iter().zip(left).map(|(a, left)| if *left > least { a * a / left } else { 0.0 }).collect()
    }

    /// A kind of signal from a place on.
    fn column(&self, kind: usize, place: usize) -> Column {
        let samples = self.lines.samples;
        let whole = self.kinds[kind].column.iter().enumerate();
        whole.map(|(x, v)| v * turned(x / self.outputs + 1, place, samples)).collect()
    }

    /// Place, input and size of the steps; `None` where there are more than `most`.
    pub(super) fn steps(mut self, most: usize) -> Option<Vec<(usize, usize, f64)>> {
        let clear = CLEAR * (self.lines.samples as f64).ln();
        let (known, residual) = (self.basis.len(), self.rest.clone());
        let found = self.found(most, clear)?;
        let columns = found.iter().map(|found| self.beside(*found, known)).collect();
        Some(sized(found, columns, &residual, clear))
    }

    /// What least squares add to the sizes of steps at places of inputs; `None` where the record does not tell them apart.
    pub(super) fn changes(&self, found: Vec<(usize, usize)>) -> Option<Vec<f64>> {
        let columns: Vec<Column> = found.iter().map(|found| self.beside(*found, self.basis.len())).collect();
        let sizes = sizes(&columns, &self.rest).0;
        let changes: Vec<f64> = (0..found.len()).map(|i| sizes[(i, 0)]).collect();
        changes.iter().all(|change| change.is_finite()).then_some(changes)
    }

    /// A step at a place of an input beside the first columns of the basis.
    fn beside(&self, (place, input): (usize, usize), known: usize) -> Column {
        let mut column = self.column(input, place);
        self.basis[..known].iter().for_each(|known| leave_out(&mut column, known));
        column
    }

    /// Places and inputs of the steps, the clearest first.
    fn found(&mut self, most: usize, clear: f64) -> Option<Vec<(usize, usize)>> {
        let mut found: Vec<(usize, usize)> = Vec::new();
        let mut others = 0;
        while let Some((kind, place)) = self.clearest(clear) {
            let corrects = |(at, of): &(usize, usize)| *of == kind && at.abs_diff(place) <= BESIDE;
            if kind < self.inputs && !found.iter().any(corrects) {
                found.push((place, kind));
            } else {
                others += 1;
            }
            if found.len() > most || others > most {
                return None;
            }
            self.explain(self.column(kind, place));
        }
        Some(found)
    }

    /// The kind and place of the clearest step, or of a spike near it that explains as much.
    fn clearest(&mut self, clear: f64) -> Option<(usize, usize)> {
        let gains: Vec<Vec<f64>> = (0..self.kinds.len()).map(|kind| self.gains(kind)).collect();
        let largest = |kinds: Range<usize>, places: Range<usize>| {
            let all = kinds.flat_map(|kind| places.clone().map(move |place| (kind, place)));
            all.max_by(|a, b| gains[a.0][a.1].total_cmp(&gains[b.0][b.1]))
        };
        let samples = self.lines.samples;
        let step = largest(0..self.inputs, 0..samples).filter(|(kind, place)| gains[*kind][*place] >= clear)?;
        let near = step.1.saturating_sub(NEAR)..(step.1 + NEAR + 1).min(samples);
        let spike = largest(self.inputs..gains.len(), near)?;
        Some(if gains[spike.0][spike.1] >= gains[step.0][step.1] { spike } else { step })
    }
}

/// Least squares, and the inverse of the normal matrix.
fn sizes(columns: &[Column], residual: &Column) -> (Mat<f64>, Mat<f64>) {
    let q = columns.len();
    let normal = Mat::from_fn(q, q, |i, j| product(&columns[i], &columns[j]));
    let right = Mat::from_fn(q, 1, |i, _| product(&columns[i], residual));
    let inverse = normal.partial_piv_lu().inverse();
    (&inverse * right, inverse)
}

/// Places and inputs of steps with their sizes by least squares. What was found before a larger step was known may explain nothing beside it,
/// and is left out.
fn sized(
    mut found: Vec<(usize, usize)>,
    mut columns: Vec<Column>,
    residual: &Column,
    clear: f64,
) -> Vec<(usize, usize, f64)> {
    while !found.is_empty() {
        let (sizes, inverse) = sizes(&columns, residual);
        let gain = |i: usize| sizes[(i, 0)].powi(2) / inverse[(i, i)];
        let least = (0..found.len()).min_by(|a, b| gain(*a).total_cmp(&gain(*b))).unwrap_or(0);
        if gain(least) >= clear {
            return found.into_iter().enumerate().map(|(i, (place, input))| (place, input, sizes[(i, 0)])).collect();
        }
        found.remove(least);
        columns.remove(least);
    }
    Vec::new()
}

/// The columns of the ends and parameters of a model, of further signals, and the residual, whitened.
fn whitened(place: Place<'_>, count: usize) -> Vec<Column> {
    let (lines, p) = (place.lines.z.len(), place.model.outputs);
    let mut work = Mat::<f64>::zeros(2 * lines * p, count);
    Rows::new(&place, count).write(place, 0..lines, (&mut work, 0));
    // Rows of LANES lines stand together, by outputs, real parts above imaginary parts.
    let entry = |column: usize, k: usize, i: usize| {
        let (first, within) = (k / LANES * LANES, k % LANES);
        let count = LANES.min(lines - first);
        let at = 2 * p * first + 2 * count * i + within;
        c64::new(work[(at, column)], work[(at + count, column)])
    };
    (0..count).map(|c| (0..lines * p).map(|x| entry(c, x / p, x % p)).collect()).collect()
}

fn product(a: &[c64], b: &[c64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.re * b.re + a.im * b.im).sum()
}

fn square(a: &[c64]) -> f64 {
    product(a, a)
}

/// Takes from a column what it has along one of unit length.
fn leave_out(from: &mut [c64], column: &[c64]) {
    let size = product(column, from);
    from.iter_mut().zip(column).for_each(|(v, c)| *v -= c * size);
}

/// z^-place of a line.
pub(super) fn turned(line: usize, place: usize, samples: usize) -> c64 {
    c64::cis(-TAU * (line * place % samples) as f64 / samples as f64)
}
