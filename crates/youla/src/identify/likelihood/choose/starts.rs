//! Starts of the search from long regressions: of different pasts, ridges and orders the most promising.

use super::problem::{NOISE_ORDER, Problem, Task};
use super::states::States;
use crate::identify::likelihood::data::lag_sums::LagSums;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::Point;
use crate::identify::likelihood::search::{deviance, with_best_ends, with_best_inputs};
use rayon::prelude::*;
use std::sync::Arc;

/// Starts are compared on every so many lines that about as many are left, at least on every third. Enough to rank them: their order is
/// decided by hundreds.
pub(crate) const COMPARED: usize = 5000;
/// Longest past of a regression, samples; and the most columns of it.
const LONGEST_PAST: (usize, usize) = (120, 360);
/// Largest order of a start; larger models grow from it where the records ask for them.
const LARGEST_START: usize = 12;
/// Most rows of the predictor whose singular vectors are the states.
const LONGEST_FUTURE: usize = 30;
/// Of many channels: columns of a regression, rows of the predictor, and the step of the orders beyond the largest start of few channels.
const WIDEST_PAST: usize = 1200;
const WIDEST_FUTURE: usize = 600;
const STEP_OF_WIDE: usize = 4;
/// Relative ridges: rounding only, and what tames empty bands. Of many channels the last alone: structures of 6 x 6 to 8 x 64 end at the same
/// models, in three quarters of the time.
const RIDGES: [f64; 2] = [1e-10, 1e-5];

/// Regressions of several pasts and ridges.
struct Sources {
    sums: LagSums,
    states: Vec<(String, States)>,
}

/// A start that was judged.
struct Judged {
    criterion: f64,
    order: usize,
    source: usize,
    model: Model,
}

/// -2 log likelihood of white noise that is independent at the outputs.
fn of_white(spectra: &Spectra, point: &Point) -> f64 {
    let (p, samples) = (spectra.outputs, spectra.samples() as f64);
    let mut powers = vec![0.0; p];
    for (lines, v) in spectra.records.iter().zip(point.residuals(spectra)) {
        for (v, weight) in v.chunks_exact(p).zip(&lines.weight) {
            powers.iter_mut().zip(v).for_each(|(sum, v)| *sum += weight * weight * v.norm_sqr());
        }
    }
    samples * powers.iter().map(|power| (power / samples).ln()).sum::<f64>()
}

impl Problem<'_> {
    /// Largest order of a start.
    fn largest_start(&self) -> usize {
        let largest = if self.is_wide() { self.largest_order } else { self.largest_order.min(LARGEST_START) };
        self.order.unwrap_or(largest)
    }

    /// The most promising starts from long regressions, of different orders.
    pub(crate) fn first_tasks(&self, delays: &[usize], count: usize) -> Vec<Task> {
        let spectra = Arc::new(self.spectra(delays));
        let every = spectra.every(COMPARED);
        let thin = spectra.thinned(every);
        let sources = self.sources(delays);
        let judged = |(order, source)| self.judged((&thin, every), &sources, order, source);
        let mut starts: Vec<Judged> = Vec::new();
        let mut orders = self.order.map_or(1..=self.largest_start().min(LARGEST_START), |n| n..=n);
        loop {
            let step = match self.is_wide() {
                true if *orders.start() > LARGEST_START => STEP_OF_WIDE,
                true => 2,
                false => 1,
            };
            let last = *orders.end();
            let trials = orders.step_by(step).flat_map(|n| (0..sources.states.len()).map(move |s| (n, s)));
            let trials: Vec<(usize, usize)> = trials.collect();
            starts.extend(trials.into_par_iter().filter_map(judged).collect::<Vec<Judged>>());
            starts.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
            // Of many channels larger ones while the best are among the largest.
            let best = starts.first().map_or(0, |start| start.order);
            if last >= self.largest_start() || best + 2 * STEP_OF_WIDE < last {
                break;
            }
            orders = last + STEP_OF_WIDE..=(2 * last).min(self.largest_start());
        }
        let white = Noise::white(self.outputs());
        let mut tasks: Vec<Task> = Vec::new();
        let mut orders: Vec<usize> = Vec::new();
        for Judged { order, source, model, .. } in starts {
            let near = orders.first().is_none_or(|first| order <= first + 2);
            let other = self.order.is_some() || !orders.contains(&order);
            if orders.len() < count && near && other {
                orders.push(order);
                let start = with_best_ends(&spectra, model, &white);
                let origin = sources.states[source].0.clone();
                tasks.push(Task { spectra: spectra.clone(), start, origin });
            }
        }
        tasks
    }

    /// A and C of a regression with B and the ends by least squares, twice: white, then weighted by the noise that is left.
    fn judged(
        &self,
        (thin, every): (&Spectra, usize),
        sources: &Sources,
        order: usize,
        source: usize,
    ) -> Option<Judged> {
        let states = &sources.states[source].1;
        if states.singular.len() < order {
            return None;
        }
        let [a, b, c, _] = states.realise(&sources.sums, order)?;
        let (m, p) = (self.inputs(), self.outputs());
        let mut model = Model::of(a.as_ref(), b.as_ref(), c.as_ref(), vec![0.0; m * p])?;
        if self.open_loop {
            model.draw_inside();
        }
        let point = with_best_inputs(thin, model, &Noise::white(p), self.feedthrough);
        let per_order = (self.samples().0 as f64).ln() * (m + p) as f64;
        if self.is_wide() {
            let criterion = of_white(thin, &point) * every as f64 + per_order * order as f64;
            return criterion.is_finite().then_some(Judged { criterion, order, source, model: point.model });
        }
        let (first, noise) = deviance(thin, &point, NOISE_ORDER);
        let again = with_best_inputs(thin, point.model.clone(), &noise, self.feedthrough);
        let (second, _) = deviance(thin, &again, NOISE_ORDER);
        let (value, point) = if second < first { (second, again) } else { (first, point) };
        let criterion = value * every as f64 + per_order * order as f64;
        value.is_finite().then_some(Judged { criterion, order, source, model: point.model })
    }

    fn sources(&self, delays: &[usize]) -> Sources {
        let (m, p) = (self.inputs(), self.outputs());
        let columns = if self.is_wide() { WIDEST_PAST.min(self.samples().0 / 4) } else { LONGEST_PAST.1 };
        let longest = LONGEST_PAST.0.min(self.samples().1 / 6).min(columns / (m + p)).max(4);
        let sums = LagSums::new(self.experiments, &self.sizes, delays, longest);
        let largest = self.largest_start();
        let longest_future = if self.is_wide() { (WIDEST_FUTURE / p).max(2) } else { LONGEST_FUTURE };
        let ridges = if self.is_wide() { &RIDGES[1..] } else { &RIDGES };
        let mut states = Vec::new();
        for past in [longest / 6, longest / 2, longest].map(|past| past.max(3)) {
            for ridge in ridges.iter().copied() {
                let shape = [past, past.min(LONGEST_FUTURE).min(longest_future), largest];
                if let Some(found) = States::new(&sums, m, shape, ridge) {
                    states.push((format!("predictor of {past} samples, ridge {ridge:.0e}"), found));
                }
            }
        }
        Sources { sums, states }
    }
}
