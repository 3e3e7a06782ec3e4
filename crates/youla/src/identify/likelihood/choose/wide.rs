//! Order and dead time of many channels: from states of long regressions of all orders, then several modes less or more at once.
//!
//! A search costs seconds here, and a model that grows mode by mode from a small start would need one for each. The states of a regression have
//! the order already, as their singular values show; what is left is to see which modes the records do not need, by what the rows of C lose
//! without them, and which are missing.

use super::grow;
use super::problem::{Choice, NOISE_ORDER, Problem, Solution, Task};
use super::solve::{INDISTINCT, best};
use super::starts::COMPARED;
use crate::identify::likelihood::Candidate;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::by_output::{Ends, Normal};
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::{deviance, with_best_ends, with_best_inputs};
use rayon::prelude::*;
use std::sync::Arc;

/// Inputs and outputs together from which they are many. Chosen: up to four of each the choice one step at a time costs seconds to a minute.
const MANY_CHANNELS: usize = 9;
/// Samples above which order and dead time are first chosen on a part, and samples of that part.
pub(super) const LONG: usize = 9000;
pub(super) const SHORT: usize = 6000;
/// Rounds of models with modes less and more.
const ROUNDS: usize = 8;
/// Modes that are added at once.
const MORE: usize = 4;
/// Times its penalty that a mode may lose to be tried without: its share in the other modes is not counted.
const DOUBTFUL: f64 = 4.0;

impl Problem<'_> {
    /// Whether channels are many.
    pub(super) fn is_wide(&self) -> bool {
        self.inputs() + self.outputs() >= MANY_CHANNELS
    }

    /// The model that is reached from some models.
    pub(super) fn solve_wide_from(&self, mut tried: Vec<Choice>, table: &mut Vec<Candidate>) -> Option<Solution> {
        let now = best(&tried)?.found.feedthrough;
        let mut at = self.with_feedthrough(now).settled(&mut tried, table)?;
        if self.direct.is_some() && !now {
            let wider = self.with_feedthrough(true);
            tried.extend(wider.run(vec![wider.same(&at)], at.criterion, table));
            if best(&tried)?.criterion < at.criterion - INDISTINCT {
                at = wider.settled(&mut tried, table)?;
            }
        }
        self.concluded(tried, &at)
    }

    /// Modes less and more as long as the criterion falls.
    fn settled(&self, tried: &mut Vec<Choice>, table: &mut Vec<Candidate>) -> Option<Choice> {
        let mut at = best(tried)?.clone();
        for _ in 0..ROUNDS {
            if self.out_of_time() {
                break;
            }
            let spectra = Arc::new(self.spectra(&at.delays));
            let mut tasks = Vec::new();
            if self.order.is_none() {
                tasks.extend(self.less(&at, &spectra));
                tasks.extend(self.more(&at, &spectra));
            }
            tasks.extend(self.delayed(&at, &spectra));
            tried.extend(self.run(tasks, at.criterion, table));
            let before = std::mem::replace(&mut at, best(tried)?.clone());
            if at.criterion >= before.criterion - 0.5 {
                break;
            }
        }
        Some(at)
    }

    /// What Schwarz's criterion asks of so many states.
    fn price(&self, states: usize) -> f64 {
        (self.samples().0 as f64).ln() * (states * (self.inputs() + self.outputs())) as f64
    }

    /// Without every mode that the rows of C hardly need; else without the one that they need least, where that is little.
    fn less(&self, at: &Choice, spectra: &Arc<Spectra>) -> Option<Task> {
        let noise = &at.found.noise;
        let parts = at.found.point.model.separated()?;
        let point = with_best_ends(spectra, parts, noise);
        let chart = Chart::by_outputs(&point.model, self.feedthrough);
        let weights = Normal::new(spectra, &point, &chart, noise, Ends::Shared).weights(&point);
        let prices = point.model.blocks.iter().map(|b| self.price(b.states));
        let ratios: Vec<f64> = weights.iter().zip(prices).map(|(weight, price)| weight / price).collect();
        let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        let limit = if least < 1.0 { 1.0 } else { least.next_up() };
        let places: Vec<usize> = (0..ratios.len()).filter(|k| ratios[*k] < limit).collect();
        if least > DOUBTFUL || places.len() == ratios.len() {
            return None;
        }
        Some(self.beside(noise, point.model.without(&places), spectra, "modes less"))
    }

    /// With the modes that explain most of what the model leaves, each more than it costs.
    fn more(&self, at: &Choice, spectra: &Arc<Spectra>) -> Option<Task> {
        let (model, noise) = (&at.found.point.model, &at.found.noise);
        let room = self.largest_order.saturating_sub(model.order()) / 2;
        let found = grow::modes(spectra, &at.found.point, noise, MORE.min(room));
        let needed: Vec<_> = found.into_iter().filter(|(gain, _)| *gain > self.price(2)).collect();
        if needed.is_empty() {
            return None;
        }
        let wider: Model = needed.into_iter().fold(model.clone(), |model, (_, block)| grow::with_block(&model, block));
        Some(self.beside(noise, wider, spectra, "modes more"))
    }

    /// One input a sample sooner or later, where B refitted says that this is better.
    fn delayed(&self, at: &Choice, here: &Arc<Spectra>) -> Option<Task> {
        let noise = &at.found.noise;
        let judged = |spectra: &Spectra| {
            let thin = spectra.thinned(spectra.every(COMPARED));
            let point = with_best_inputs(&thin, at.found.point.model.clone(), noise, self.feedthrough);
            deviance(&thin, &point, NOISE_ORDER).0 * spectra.every(COMPARED) as f64
        };
        let now = judged(here);
        let others: Vec<Vec<usize>> = self
            .shifted(&at.delays)
            .into_iter()
            .filter(|other| other.iter().zip(&at.delays).map(|(a, b)| a.abs_diff(*b)).sum::<usize>() == 1)
            .collect();
        let all = others.into_par_iter().map(|delays| {
            let spectra = self.spectra(&delays);
            (judged(&spectra), spectra)
        });
        let (value, spectra) = all.min_by(|a, b| a.0.total_cmp(&b.0))?;
        if value > now - INDISTINCT {
            return None;
        }
        Some(self.beside(noise, at.found.point.model.clone(), &Arc::new(spectra), "another dead time"))
    }
}
