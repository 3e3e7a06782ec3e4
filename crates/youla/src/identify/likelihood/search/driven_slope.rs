//! What the parameters do to the likelihood through the spectrum of noise at the inputs, which the plant shapes.
//!
//! ```text
//! 1/2 sum (1 - |e_i|^2 / Lambda_ii) d log (1 + lambda |G_i|^2)     over the full circle, of one output
//! ```
//! With the filter of the noise held, a step that lowers the squares may raise the likelihood, and a search would end there. The terms vanish on
//! average at the plant itself.

use super::chart::Chart;
use super::driven::Gains;
use super::model::Model;
use super::noise::Noise;
use super::point::Point;
use crate::identify::likelihood::data::spectra::{Lines, Spectra, parts};
use faer::c64;
use rayon::prelude::*;
use std::ops::Range;

/// What an output sees of the noise at the inputs: the plant without its direct path, and which parameters move it.
struct Seen {
    output: usize,
    plant: Model,
    moves: Vec<bool>,
}

impl Seen {
    fn new(model: &Model, chart: &Chart, gains: &Gains, output: usize) -> Self {
        let hidden = &gains.hidden[output];
        let of_block = |k: usize| std::iter::repeat_n(!hidden.contains(&k), chart.parameters_of(k));
        let mut moves: Vec<bool> = (0..model.blocks.len()).flat_map(of_block).collect();
        moves.resize(chart.parameters(), false);
        let mut plant = model.without(hidden);
        plant.d.fill(0.0);
        Seen { output, plant, moves }
    }
}

/// Slope of half the deviance in the parameters of a chart.
pub(crate) fn slope(spectra: &Spectra, point: &Point, chart: &Chart, noise: &Noise) -> Vec<f64> {
    let driven = |i: &usize| noise.regression[*i].driven.is_some();
    let gains = Gains::new(&point.model, spectra);
    let seen: Vec<Seen> =
        (0..spectra.outputs).filter(driven).map(|i| Seen::new(&point.model, chart, &gains, i)).collect();
    let residuals = point.residuals(spectra);
    let mut sum = vec![0.0; chart.parameters()];
    for ((lines, v), values) in spectra.records.iter().zip(&residuals).zip(&gains.values) {
        let of = |range| part((&point.model, chart, noise), &seen, (lines, v), (gains.every, values), range);
        let of_parts: Vec<Vec<f64>> = parts(values.len() / spectra.outputs).map(of).collect();
        of_parts.iter().for_each(|part| sum.iter_mut().zip(part).for_each(|(sum, of)| *sum += of));
    }
    sum
}

/// The sum over some of every so many lines, by their places among these.
fn part(
    (model, chart, noise): (&Model, &Chart, &Noise),
    seen: &[Seen],
    (lines, v): (&Lines, &[c64]),
    (every, values): (usize, &[f64]),
    range: Range<usize>,
) -> Vec<f64> {
    let (m, p) = (model.inputs, model.outputs);
    let mut sum = vec![0.0; chart.parameters()];
    let mut filters = vec![c64::ZERO; p];
    for place in range {
        let k = place * every;
        noise.filters(lines.z[k], &mut filters);
        let e: Vec<c64> = (0..p).map(|i| filters[i] * v[k * p + i]).collect();
        let white: Vec<c64> = (0..p).map(|i| (0..=i).map(|j| e[j] * noise.root[(i, j)]).sum()).collect();
        let slopes = chart.response_slopes(model, lines.z[k]);
        for Seen { output: i, plant, moves } in seen {
            let Some(driven) = &noise.regression[*i].driven else { continue };
            // Lambda^-1 e
            let behind: c64 = (*i..p).map(|j| white[j] * noise.root[(j, *i)]).sum();
            let excess = lines.share[k] - lines.weight[k].powi(2) * (behind.conj() * e[*i]).re;
            let ratio = driven.kalman.entry.ratio();
            let shape = excess * every as f64 * ratio / (1.0 + ratio * values[place * p + i]);
            let response = plant.response(lines.z[k]);
            let moved = sum.iter_mut().enumerate().filter(|(q, _)| moves[*q]);
            moved.for_each(|(q, sum)| {
                let along = |j: usize| (response[i * m + j].conj() * slopes[(i * m + j, q)]).re;
                *sum += shape * (0..m).map(along).sum::<f64>();
            });
        }
    }
    sum
}
