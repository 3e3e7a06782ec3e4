//! Models one step away: another dead time, one pole or pair less, one mode more.

use super::grow;
use super::model::Model;
use super::problem::{Choice, NOISE_ORDER, Problem, Task};
use super::search::{deviance, with_best_inputs};
use super::spectra::Spectra;
use super::starts::THINNED;
use rayon::prelude::*;
use std::sync::Arc;

/// Largest change of the dead time of a single input in a step, samples.
const REACH: usize = 12;

/// The lines for other delays.
struct Around {
    spectra: Arc<Spectra>,
    delays: Vec<usize>,
}

/// A step: the place of its delays, and the block that is left out.
#[derive(Clone, Copy)]
struct Step {
    around: usize,
    without: Option<usize>,
}

impl Problem<'_> {
    /// Starts one delay or one block away.
    pub(crate) fn neighbours(&self, best: &Choice) -> Vec<Task> {
        let (model, noise) = (&best.found.point.model, &best.found.noise);
        let parts = model.separated().unwrap_or_else(|| model.clone());
        let around: Vec<Vec<usize>> = self.shifted(&best.delays).into_iter().chain([best.delays.clone()]).collect();
        let prepared = |delays: Vec<usize>| Around { spectra: Arc::new(self.spectra(&delays)), delays };
        let around: Vec<Around> = around.into_par_iter().map(prepared).collect();
        let start_of = |step: Step| step.without.map_or_else(|| model.clone(), |place| parts.without(place));
        let judged = |step: Step| {
            let thin = around[step.around].spectra.thinned(THINNED);
            let point = with_best_inputs(&thin, start_of(step), noise, self.feedthrough);
            (deviance(&thin, &point, NOISE_ORDER).0, step)
        };
        let steps = self.steps(best, &around, parts.blocks.len());
        let mut starts: Vec<(f64, Step)> = steps.into_par_iter().map(judged).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut tasks = Vec::new();
        for step in self.promising(best, &around, &starts) {
            let Around { spectra, delays } = &around[step.around];
            let start = with_best_inputs(spectra, start_of(step), noise, self.feedthrough);
            let origin = if step.without.is_some() { "one mode less" } else { "another dead time" };
            tasks.push(Task { spectra: spectra.clone(), start, delays: delays.clone(), origin: origin.into() });
        }
        if let Some(here) = around.last() {
            tasks.extend(self.one_more(best, &here.spectra));
        }
        tasks
    }

    /// All steps to be judged by their least squares: every dead time around, every block left out with a near one.
    fn steps(&self, best: &Choice, around: &[Around], blocks: usize) -> Vec<Step> {
        // A fast mode in excess hides several samples of dead time of a single input.
        let reach = if self.inputs() == 1 { REACH } else { 1 };
        let mut steps = Vec::new();
        for (k, Around { delays, .. }) in around.iter().enumerate() {
            if *delays != best.delays {
                steps.push(Step { around: k, without: None });
            }
            let near = delays.iter().zip(&best.delays).map(|(a, b)| a.abs_diff(*b)).sum::<usize>() <= reach;
            if near && self.order.is_none() {
                steps.extend((0..blocks).map(|place| Step { around: k, without: Some(place) }));
            }
        }
        steps
    }

    /// The first of each kind, and for a single input the dead times next to the best.
    fn promising(&self, best: &Choice, around: &[Around], starts: &[(f64, Step)]) -> Vec<Step> {
        let next = |s: &Step| self.inputs() == 1 && around[s.around].delays[0].abs_diff(best.delays[0]) == 1;
        let whole = starts.iter().filter(|s| s.1.without.is_none()).enumerate();
        let whole = whole.filter(|(place, s)| *place < 2 || next(&s.1)).map(|(_, s)| s);
        let less = starts.iter().filter(|s| s.1.without.is_some()).take(if self.inputs() == 1 { 2 } else { 1 });
        whole.chain(less).map(|s| s.1).collect()
    }

    /// The mode that explains most of what the model leaves, added to it.
    fn one_more(&self, best: &Choice, spectra: &Arc<Spectra>) -> Option<Task> {
        let (model, noise) = (&best.found.point.model, &best.found.noise);
        if self.order.is_some() || model.order() + 2 > self.largest_order {
            return None;
        }
        let residuals = best.found.point.residuals(spectra);
        let (_, block) = grow::modes(spectra, &residuals, noise, 1).into_iter().next()?;
        let wider: Model = grow::with_block(model, block);
        let start = with_best_inputs(spectra, wider, noise, self.feedthrough);
        Some(Task { spectra: spectra.clone(), start, delays: best.delays.clone(), origin: "one mode more".into() })
    }

    /// Other delays, input by input: many of a single input, up to two samples away for several.
    fn shifted(&self, delays: &[usize]) -> Vec<Vec<usize>> {
        if self.dead_time.is_some() {
            return Vec::new();
        }
        let reach = if delays.len() == 1 { REACH } else { 2 };
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
