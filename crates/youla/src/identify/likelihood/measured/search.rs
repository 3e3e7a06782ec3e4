//! Levenberg-Marquardt on weighed lines.

use super::lines::{WeighedLine, WeighedLines};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::point::{Point, reblocked};
use crate::identify::likelihood::search::{FIRST_DAMPING, damped};
use crate::linalg::{Damping, LEAST_DAMPING, Trial};
use faer::{Mat, c64};
use rayon::prelude::*;

/// Lines that are brought to triangular form together; fixed, so that the sum does not depend on the number of threads.
const CHUNK: usize = 64;
/// A search ends where a step promises to lower -2 log likelihood by less.
const TOLERANCE: f64 = 0.01;

/// Where a search ended.
pub(super) struct Found {
    pub(super) model: Model,
    pub(super) energy: f64,
    pub(super) steps: usize,
}

/// The triangular factor of `[J r]`, J the slopes of the whitened `G U`.
pub(super) fn linearise(lines: &WeighedLines, model: &Model, chart: &Chart) -> Mat<f64> {
    let columns = chart.parameters() + 1;
    let chunks: Vec<&[WeighedLine]> = lines.lines.chunks(CHUNK).collect();
    let parts: Vec<Mat<f64>> = chunks.into_par_iter().map(|chunk| triangle(rows(lines, chunk, model, chart))).collect();
    let mut all = Mat::zeros(parts.iter().map(Mat::nrows).sum::<usize>().max(columns), columns);
    let mut at = 0;
    for part in parts {
        all.subrows_mut(at, part.nrows()).copy_from(&part);
        at += part.nrows();
    }
    triangle(all)
}

fn triangle(rows: Mat<f64>) -> Mat<f64> {
    if rows.nrows() <= rows.ncols() { rows } else { rows.qr().thin_R().to_owned() }
}

fn rows(lines: &WeighedLines, chunk: &[WeighedLine], model: &Model, chart: &Chart) -> Mat<f64> {
    let (m, p, parameters) = (lines.inputs, lines.outputs, chart.parameters());
    let count: usize = chunk.iter().map(|l| l.columns.len() * p * 2).sum();
    let mut out = Mat::zeros(count, parameters + 1);
    let mut at = 0;
    for line in chunk {
        let (g, slopes) = (model.response(line.z), chart.response_slopes(model, line.z));
        for column in &line.columns {
            let mut write = |k: usize, values: Vec<c64>| {
                for (i, value) in values.into_iter().enumerate() {
                    (out[(at + 2 * i, k)], out[(at + 2 * i + 1, k)]) = (value.re, value.im);
                }
            };
            for k in 0..parameters {
                let moved = |i: usize| (0..m).fold(c64::ZERO, |sum, j| sum + slopes[(i * m + j, k)] * column.u[j]);
                write(k, column.whitened(&(0..p).map(moved).collect::<Vec<_>>()));
            }
            write(parameters, column.whitened(&column.rest(&g, m)));
            at += 2 * p;
        }
    }
    out
}

/// B and D by least squares, A and C kept.
pub(super) fn with_best_inputs(lines: &WeighedLines, model: &Model, feedthrough: bool) -> Option<Model> {
    let chart = Chart::inputs_only(model, feedthrough);
    let factor = linearise(lines, model, &chart);
    let (step, _) = damped(&factor, chart.parameters(), LEAST_DAMPING);
    let moved = chart.moved(model, &step);
    lines.energy(&moved).is_finite().then_some(moved)
}

/// Searches from a start; `None` where nothing finite comes of it.
pub(super) fn search(lines: &WeighedLines, start: &Model, feedthrough: bool, most: usize) -> Option<Found> {
    let mut model = reblocked(&Point::at_rest(start.clone(), 0))?.model;
    let mut energy = lines.energy(&model);
    let unit = |energy: f64| (energy / lines.rows().max(1) as f64).min(1.0);
    let (mut damping, mut steps) = (Damping::new(FIRST_DAMPING), 0);
    while steps < most && energy.is_finite() {
        let chart = Chart::new(&model, feedthrough);
        let factor = linearise(lines, &model, &chart);
        let lower = damping.descend(|damping| {
            let (step, promised) = damped(&factor, chart.parameters(), damping);
            // A promise that is not a number ends the search as well.
            if promised.is_nan() || promised <= TOLERANCE * unit(energy) {
                return Trial::Negligible;
            }
            let trial = chart.moved(&model, &step);
            let value = lines.energy(&trial);
            match value < energy {
                true => Trial::Lower { point: (trial, value), ratio: (energy - value) / promised },
                false => Trial::Rejected,
            }
        });
        let Some((trial, value)) = lower else { break };
        (model, energy) = (reblocked(&Point::at_rest(trial, 0))?.model, value);
        steps += 1;
    }
    energy.is_finite().then_some(Found { model, energy, steps })
}
