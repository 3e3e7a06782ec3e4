//! Normal equations of many outputs, one output at a time: separable least squares.
//!
//! With innovations that count as independent the residual of output o is linear in its own row of C and D and its drift, and A, B and the
//! ends of the records are shared by all,
//! ```text
//! v_o = F_o (Y_o - C_o X - D_o U - d_o z / (z - 1)),     X = (z I - A)^-1 (B U + z t)
//! ```
//! so that the columns of a row of C are zero in all other outputs and the normal equations are an arrow. Eliminating the own columns output by
//! output leaves those of the shared ones (Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973), 413): time and memory are linear in the
//! outputs, where those of dense normal equations grow with their third power.

mod arrow;
mod rows;
#[cfg(test)]
mod tests;

pub(crate) use arrow::{Arrow, inverse};

use super::chart::{Chart, Entry, Places};
use super::linearise::{Extra, Filter};
use super::noise::Noise;
use super::point::Point;
use crate::identify::likelihood::data::spectra::Spectra;
use arrow::{RIDGES, eliminated, symmetric};
use faer::{Mat, Side};
use rayon::prelude::*;
use rows::Rows;

/// What the ends of a record are: of all outputs together, or of each output for itself, so that sums over records stay an arrow.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Ends {
    /// One vector t for all outputs.
    Shared,
    /// The motion that t causes is free at each output.
    Own,
}

/// The columns: own ones of an output are C (n), D (m) and drifts (records), shared ones are entries of A and B, ends (n each), further ones.
#[derive(Clone)]
pub(crate) struct Columns {
    plant: Vec<Entry>,
    /// Places of the parameters of the own columns of each output.
    own: Vec<Vec<usize>>,
    /// Whether C moves, and D.
    moving: [bool; 2],
    parameters: usize,
    states: usize,
    records: usize,
    extra: usize,
    ends: Ends,
}

impl Columns {
    fn new(point: &Point, chart: &Chart, extra: usize, ends: Ends) -> Self {
        let Places { plant, own } = chart.places(&point.model);
        let moving = [chart.units.iter().flatten().count() > plant.len(), chart.feedthrough];
        let (states, records, parameters) = (point.model.order(), point.ends.len(), chart.parameters());
        Columns { plant, own, moving, parameters, states, records, extra, ends }
    }

    /// Own columns that are no parameters: they stand first.
    fn nuisance(&self) -> usize {
        self.records * if self.ends == Ends::Own { 1 + self.states } else { 1 }
    }

    /// Own columns that are parameters.
    fn parameters_of_an_output(&self) -> usize {
        self.own.first().map_or(0, Vec::len)
    }

    fn shared(&self) -> usize {
        self.plant.len() + self.extra + if self.ends == Ends::Shared { self.records * self.states } else { 0 }
    }
}

/// The normal equations: per output those of `[own shared residual]`, lower triangle.
#[derive(Clone)]
pub(crate) struct Normal {
    grams: Vec<Mat<f64>>,
    columns: Columns,
    /// Own columns that are left.
    own: usize,
    /// Slope of what is no square, by parameters.
    slope: Vec<f64>,
}

impl Normal {
    /// At a point, in the coordinates of [`Chart::by_outputs`] or of a part of them.
    pub(crate) fn new(spectra: &Spectra, point: &Point, chart: &Chart, noise: &Noise, ends: Ends) -> Self {
        let extra = Extra { count: 0, values: &[], quick: true, filter: Filter::Held };
        Normal::with(spectra, point, chart, noise, (ends, &extra))
    }

    /// The same with further shared columns.
    pub(crate) fn with(
        spectra: &Spectra,
        point: &Point,
        chart: &Chart,
        noise: &Noise,
        (ends, extra): (Ends, &Extra<'_>),
    ) -> Self {
        let columns = Columns::new(point, chart, extra.count, ends);
        let own = columns.nuisance() + columns.parameters_of_an_output();
        let width = own + columns.shared() + 1;
        let mut grams = vec![Mat::<f64>::zeros(width, width); spectra.outputs];
        // Outputs of one thread share the states; the sums of an output are the same on any number of threads.
        let piece = spectra.outputs.div_ceil(rayon::current_num_threads()).max(1);
        grams.par_chunks_mut(piece).enumerate().for_each(|(k, sums)| {
            for (record, lines) in spectra.records.iter().enumerate() {
                let more = extra.values.get(record).map_or(&[][..], Vec::as_slice);
                Rows { lines, point, noise, columns: &columns, record, more }.add_to(k * piece, sums, own);
            }
        });
        Normal { grams, own, slope: vec![0.0; columns.parameters], columns }
    }

    /// With the slope of what is no square, by parameters.
    pub(crate) fn with_slope(self, slope: Vec<f64>) -> Self {
        Normal { slope, ..self }
    }

    /// Without the own columns that are no parameters, each taken for what is best.
    pub(crate) fn reduced(mut self) -> Self {
        let count = self.columns.nuisance();
        let reduced = |gram: &Mat<f64>| {
            let rows = eliminated(&mut symmetric(gram), count, 0.0);
            let rest = gram.nrows() - count;
            let (rows, all) = (rows.subcols(count, rest), gram.submatrix(count, count, rest, rest));
            all - rows.transpose() * rows
        };
        self.grams = self.grams.par_iter().map(reduced).collect();
        self.own -= count;
        self
    }

    /// The sum with further ones, of the same columns without nuisance.
    pub(crate) fn plus(mut self, other: &Normal) -> Self {
        self.grams.iter_mut().zip(&other.grams).for_each(|(a, b)| *a += b);
        self.slope.iter_mut().zip(&other.slope).for_each(|(a, b)| *a += b);
        self
    }

    /// Their factor, with a damping of the parameters relative to the squared lengths of their columns.
    pub(crate) fn factor(&self, damping: f64) -> Arrow {
        let (shared, nuisance) = (self.columns.shared(), self.own - self.columns.parameters_of_an_output());
        let of = |(gram, places): (&Mat<f64>, &Vec<usize>)| {
            let mut gram = symmetric(gram);
            let last = gram.ncols() - 1;
            for (k, place) in places.iter().enumerate() {
                let i = nuisance + k;
                gram[(i, last)] -= self.slope[*place];
                gram[(i, i)] *= 1.0 + damping;
            }
            let rows = eliminated(&mut gram, self.own, RIDGES[0]);
            let rest = gram.submatrix(self.own, self.own, shared + 1, shared + 1).to_owned();
            let right = rows.subcols(self.own, shared + 1).to_owned();
            let lengths: Vec<f64> = (0..shared).map(|i| rest[(i, i)]).collect();
            (rows, rest - right.transpose() * &right, lengths)
        };
        let parts: Vec<_> = self.grams.par_iter().zip(&self.columns.own).map(of).collect();
        let mut sum = Mat::<f64>::zeros(shared + 1, shared + 1);
        let (mut own, mut lengths) = (Vec::with_capacity(parts.len()), vec![0.0; shared]);
        for (rows, rest, length) in parts {
            sum += rest;
            own.push(rows);
            lengths.iter_mut().zip(length).for_each(|(a, b)| *a += b);
        }
        for (i, entry) in self.columns.plant.iter().enumerate() {
            sum[(i, shared)] -= self.slope[entry.place];
            sum[(i, i)] += damping * lengths[i];
        }
        let shared = eliminated(&mut sum, shared, RIDGES[0]);
        Arrow { own, shared, lengths, nuisance }
    }

    /// The change of the parameters, of t and of the drifts of each record, and the decrease of the sum of squares that it promises.
    pub(crate) fn step(&self, damping: f64) -> (Vec<f64>, Vec<Vec<f64>>, f64) {
        let Columns { plant, own, parameters, states, records, .. } = &self.columns;
        let arrow = self.factor(damping);
        let (by_output, shared) = arrow.solved();
        let mut step = vec![0.0; *parameters];
        let mut ends = vec![vec![0.0; states + own.len()]; *records];
        plant.iter().zip(&shared).for_each(|(entry, value)| step[entry.place] = *value);
        for (r, end) in ends.iter_mut().enumerate() {
            end[..*states].copy_from_slice(&shared[plant.len() + r * states..][..*states]);
            by_output.iter().enumerate().for_each(|(o, of)| end[states + o] = of[r]);
        }
        for (places, of) in own.iter().zip(&by_output) {
            places.iter().zip(&of[arrow.nuisance..]).for_each(|(place, value)| step[*place] = *value);
        }
        let along: f64 = self.slope.iter().zip(&step).map(|(a, b)| a * b).sum();
        let promised = self.promised(&by_output, &shared) - 2.0 * along;
        (step, ends, promised)
    }

    /// `2 g' s - s' H s` of a step.
    fn promised(&self, own: &[Vec<f64>], shared: &[f64]) -> f64 {
        let of = |(gram, own): (&Mat<f64>, &Vec<f64>)| {
            let step = Mat::from_fn(gram.nrows(), 1, |i, _| match i.checked_sub(own.len()) {
                None => own[i],
                Some(i) => shared.get(i).copied().unwrap_or(-1.0),
            });
            let whole = symmetric(gram);
            let last = whole.nrows() - 1;
            whole[(last, last)] - (step.transpose() * &whole * &step)[(0, 0)]
        };
        self.grams.par_iter().zip(own).map(of).collect::<Vec<_>>().iter().sum()
    }

    /// The triangle `[R r]` of the further columns beside all others, and the squared lengths of these columns.
    pub(crate) fn extra(&self) -> (Mat<f64>, Vec<f64>) {
        let arrow = self.factor(0.0);
        let (shared, count) = (self.columns.shared(), self.columns.extra);
        let first = shared - count;
        (arrow.shared.submatrix(first, first, count, count + 1).to_owned(), arrow.lengths[first..].to_vec())
    }

    /// `2 log` of how many times less likely the model is without each of its blocks, rows of C refitted and the rest as it is.
    pub(crate) fn weights(&self, point: &Point) -> Vec<f64> {
        let arrow = self.factor(0.0);
        let mut out = vec![0.0; point.model.blocks.len()];
        for (o, rows) in arrow.own.iter().enumerate() {
            let inverse = inverse(&rows.subcols(0, self.own).to_owned());
            let mut first = arrow.nuisance;
            for (block, out) in point.model.blocks.iter().zip(&mut out) {
                let s = block.states;
                let root = inverse.subrows(first, s);
                let covariance = root * root.transpose();
                let c = Mat::from_fn(s, 1, |i, _| block.c[o * s + i]);
                if let Ok(factor) = covariance.llt(Side::Lower) {
                    use faer::linalg::solvers::Solve;
                    *out += (c.transpose() * factor.solve(&c))[(0, 0)];
                }
                first += s;
            }
        }
        out
    }

    /// Number of parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.columns.parameters
    }
}
