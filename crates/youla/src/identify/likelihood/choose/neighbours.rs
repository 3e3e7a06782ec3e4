//! Models one step away: another dead time, one pole or pair less, one mode more, two modes for one.

use super::grow;
use super::problem::{Choice, LONG, NOISE_ORDER, Problem, Task};
use super::starts::COMPARED;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::block::Block;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::{deviance, with_best_inputs};
use rayon::prelude::*;
use std::sync::Arc;

/// Largest change of the dead time of a single input in a step, samples.
const REACH: usize = 12;

/// The same for several inputs, and on long records, whose dead time was chosen on a part of them.
const NEAR_REACH: usize = 2;

/// Pole from which the search of a lag in place of a sample of dead time starts; at zero both are the same.
pub(super) const FAST: f64 = 0.1;

/// Damping ratio up to which a mode is tried as two.
const LIGHTLY_DAMPED: f64 = 0.1;

/// The model with two modes of half the damping in place of block k, apart by its width; `None` where that is not a lightly damped mode.
fn halved(model: &Model, k: usize) -> Option<Model> {
    let block = model.blocks.get(k).filter(|b| b.states == 2)?;
    let pole = block.poles().into_iter().find(|p| p.im > 0.0)?;
    let (decay, angle) = (-pole.norm().ln(), pole.arg());
    if decay <= 0.0 || decay > LIGHTLY_DAMPED * angle {
        return None;
    }
    let moved = |side: f64| {
        // Turned and stretched in its own coordinates: A = T [re im; -im re] T^-1 keeps T.
        let to = faer::c64::from_polar((-0.5 * decay).exp(), angle + side * decay);
        let (scale, shift) = (to.im / pole.im, to.re - pole.re * to.im / pole.im);
        let a = (0..4).map(|i| scale * block.a[i] + if i % 3 == 0 { shift } else { 0.0 }).collect();
        Block { a, ..block.clone() }
    };
    let mut wider = model.clone();
    wider.blocks[k] = moved(-1.0);
    wider.blocks.push(moved(1.0));
    Some(wider)
}

/// A step: the place of the lines for its delays, and that of the set of blocks that is left out.
#[derive(Clone, Copy)]
struct Step {
    around: usize,
    without: Option<usize>,
}

/// Blocks that may be left out: each alone, and two real poles together, as one of them alone often is needed by the other.
pub(crate) fn sets(parts: &Model) -> Vec<Vec<usize>> {
    let real: Vec<usize> = (0..parts.blocks.len()).filter(|k| parts.blocks[*k].states == 1).collect();
    let pairs = real.iter().enumerate().flat_map(|(k, a)| real[k + 1..].iter().map(move |b| vec![*a, *b]));
    (0..parts.blocks.len()).map(|k| vec![k]).chain(pairs).collect()
}

impl Problem<'_> {
    /// Starts one delay or one block away.
    pub(crate) fn neighbours(&self, best: &Choice) -> Vec<Task> {
        let (model, noise) = (&best.found.point.model, &best.found.noise);
        let parts = model.separated().unwrap_or_else(|| model.clone());
        let around: Vec<Vec<usize>> = self.shifted(&best.delays).into_iter().chain([best.delays.clone()]).collect();
        let around: Vec<Arc<Spectra>> = around.into_par_iter().map(|delays| Arc::new(self.spectra(&delays))).collect();
        let sets = sets(&parts);
        let start_of = |step: Step| step.without.map_or_else(|| model.clone(), |set| parts.without(&sets[set]));
        let per_order = (self.samples().0 as f64).ln() * (self.inputs() + self.outputs()) as f64;
        let judged = |step: Step| {
            let spectra = &around[step.around];
            let every = spectra.every(COMPARED);
            let thin = spectra.thinned(every);
            let start = start_of(step);
            let states = start.order() as f64;
            let point = with_best_inputs(&thin, start, noise, self.feedthrough);
            (deviance(&thin, &point, NOISE_ORDER).0 * every as f64 + per_order * states, step)
        };
        let steps = self.steps(best, &around, &sets);
        let mut starts: Vec<(f64, Step)> = steps.into_par_iter().map(judged).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut tasks = Vec::new();
        for step in self.promising(best, &around, &starts, &sets) {
            let origin = if step.without.is_some() { "one mode less" } else { "another dead time" };
            tasks.push(self.beside(noise, start_of(step), &around[step.around], origin));
        }
        if let Some(here) = around.last() {
            tasks.extend(self.one_more(best, here));
            tasks.extend(self.split(best, &parts, here));
        }
        let sooner = around.iter().find(|a| a.delays.len() == 1 && a.delays[0] + 1 == best.delays[0]);
        tasks.extend(sooner.and_then(|sooner| self.pole_for_delay(best, sooner)));
        tasks
    }

    /// One sample of the dead time of a single input as a fast pole: an actuator's lag is often taken for it.
    fn pole_for_delay(&self, best: &Choice, sooner: &Arc<Spectra>) -> Option<Task> {
        let model = &best.found.point.model;
        if self.order.is_some() || model.order() + 1 > self.largest_order {
            return None;
        }
        let lagged = model.with_lags(0, &[FAST])?;
        Some(self.beside(&best.found.noise, lagged, sooner, "a pole for a sample of dead time"))
    }

    /// All steps to be judged by their least squares: every dead time around, every block left out with a near one.
    fn steps(&self, best: &Choice, around: &[Arc<Spectra>], sets: &[Vec<usize>]) -> Vec<Step> {
        // A fast mode in excess hides several samples of dead time of a single input.
        let reach = if self.inputs() == 1 { REACH } else { 1 };
        let mut steps = Vec::new();
        for (k, delays) in around.iter().map(|spectra| &spectra.delays).enumerate() {
            if *delays != best.delays {
                steps.push(Step { around: k, without: None });
            }
            let near = delays.iter().zip(&best.delays).map(|(a, b)| a.abs_diff(*b)).sum::<usize>() <= reach;
            if near && self.order.is_none() {
                // without two poles another dead time looks best as long as the other poles stay where they are
                let here = |set: &usize| sets[*set].len() == 1 || *delays == best.delays;
                steps.extend((0..sets.len()).filter(here).map(|set| Step { around: k, without: Some(set) }));
            }
        }
        steps
    }

    /// The first of each kind, and for a single input the dead times next to the best.
    fn promising(
        &self,
        best: &Choice,
        around: &[Arc<Spectra>],
        starts: &[(f64, Step)],
        sets: &[Vec<usize>],
    ) -> Vec<Step> {
        let next = |s: &Step| self.inputs() == 1 && around[s.around].delays[0].abs_diff(best.delays[0]) == 1;
        let whole = starts.iter().filter(|s| s.1.without.is_none()).enumerate();
        let whole = whole.filter(|(place, s)| *place < 2 || next(&s.1)).map(|(_, s)| s);
        // of each set of blocks the best dead time
        let less = |blocks: usize, count: usize| {
            let mut seen = Vec::new();
            let of = starts.iter().filter(|s| s.1.without.is_some_and(|set| sets[set].len() == blocks));
            let first: Vec<&(f64, Step)> = of
                .filter(|s| {
                    let new = !seen.contains(&s.1.without);
                    seen.push(s.1.without);
                    new
                })
                .collect();
            first.into_iter().take(count)
        };
        let single = less(1, if self.inputs() == 1 { 2 } else { 1 });
        whole.chain(single).chain(less(2, 1)).map(|s| s.1).collect()
    }

    /// The mode that explains most of what the model leaves, added to it.
    fn one_more(&self, best: &Choice, spectra: &Arc<Spectra>) -> Option<Task> {
        let (model, noise) = (&best.found.point.model, &best.found.noise);
        if self.order.is_some() || model.order() + 2 > self.largest_order {
            return None;
        }
        let (_, block) = grow::modes(spectra, &best.found.point, noise, 1).into_iter().next()?;
        let wider: Model = grow::with_block(model, block);
        Some(self.beside(noise, wider, spectra, "one mode more"))
    }

    /// Two modes in place of a lightly damped one: what two resonances within each other's width leave looks like one mode of more damping,
    /// and no further mode beside it explains the rest. Of all such modes the one whose halves lower the deviance most.
    fn split(&self, best: &Choice, parts: &Model, spectra: &Arc<Spectra>) -> Option<Task> {
        if self.order.is_some() || parts.order() + 2 > self.largest_order {
            return None;
        }
        let (noise, thin) = (&best.found.noise, spectra.thinned(spectra.every(COMPARED)));
        let halves = (0..parts.blocks.len()).filter_map(|k| halved(parts, k));
        let judged = halves.map(|model| {
            let point = with_best_inputs(&thin, model.clone(), noise, self.feedthrough);
            (deviance(&thin, &point, NOISE_ORDER).0, model)
        });
        let (_, model) = judged.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(self.beside(noise, model, spectra, "two modes for one"))
    }

    /// Other delays, input by input: many of a single input, up to two samples away for several and on long records.
    pub(super) fn shifted(&self, delays: &[usize]) -> Vec<Vec<usize>> {
        if self.dead_time.is_some() {
            return Vec::new();
        }
        let near = delays.len() > 1 || self.samples().0 > LONG;
        let reach = if near { NEAR_REACH } else { REACH };
        let mut out = Vec::new();
        for j in 0..delays.len() {
            for d in delays[j].saturating_sub(reach)..=(delays[j] + reach).min(self.skip) {
                if d != delays[j] {
                    let mut other = delays.to_vec();
                    other[j] = d;
                    out.push(other);
                }
            }
        }
        out
    }
}
