//! Noise that reaches the outputs by paths of its own, behind the choice of order and dead time.

use super::problem::{Choice, LONG, Problem, Solution, Task};
use super::solve::INDISTINCT;
use crate::identify::likelihood::Candidate;
use crate::identify::likelihood::data::spectra::Spectra;
use crate::identify::likelihood::search::free_gain::with_free_gain;
use rayon::prelude::*;

/// Coefficients of the noise up to which it is that of the outputs: a pole and a zero describe drift.
const FEW: usize = 3;
/// Difference of the criteria, as rivals, up to which a model is searched with such noise as well, and their number: weights of e^-4. With such
/// noise criteria fall by tens to thousands, and a rival without it is no rival any more.
const CLOSE: f64 = 8.0;
const RIVALS: usize = 4;

impl Problem<'_> {
    /// The model with noise by paths of its own where the records ask for it, its rivals likewise, and the lines of its delays.
    pub(crate) fn with_own_noise(&self, solution: &Solution) -> (Solution, Spectra) {
        let chosen = &solution.chosen;
        let spectra = self.spectra(&chosen.delays);
        let Some(freed) = self.freed(&spectra, chosen) else { return (solution.clone(), spectra) };
        let rivals: Vec<Choice> = self.closest(solution).into_par_iter().map(|c| self.with_free_noise(c)).collect();
        // A larger model has states for the noise, which K describes: of four that were distinctly better three were worse models of the plant.
        let smaller = rivals.iter().filter(|c| c.order() <= freed.order());
        let better = smaller.filter(|c| c.criterion < freed.criterion - INDISTINCT);
        let best = better.min_by(|a, b| a.criterion.total_cmp(&b.criterion)).unwrap_or(&freed).clone();
        let spectra = if best.delays == freed.delays { spectra } else { self.spectra(&best.delays) };
        let rivals = std::iter::once(freed).chain(rivals).collect();
        (Solution { chosen: best, rivals, ..solution.clone() }, spectra)
    }

    /// The rivals of most weight, of each order and dead time the best, without those of the chosen model.
    fn closest<'s>(&self, Solution { chosen, rivals, samples, .. }: &'s Solution) -> Vec<&'s Choice> {
        let mut ordered: Vec<&Choice> = rivals.iter().collect();
        ordered.sort_by(|a, b| a.as_rival(*samples).total_cmp(&b.as_rival(*samples)));
        let least = ordered.first().map_or(0.0, |c| c.as_rival(*samples));
        let mut kept = vec![chosen];
        for choice in ordered.into_iter().filter(|c| c.as_rival(*samples) < least + CLOSE) {
            if kept.iter().all(|k| k.order() != choice.order() || k.delays != choice.delays) {
                kept.push(choice);
            }
        }
        kept.into_iter().skip(1).take(RIVALS).collect()
    }

    /// A model with such noise; `None` where the criterion is not less, and where the feedback does not stabilise it.
    fn freed(&self, spectra: &Spectra, choice: &Choice) -> Option<Choice> {
        let found = with_free_gain(spectra, &choice.found, &self.options(20, 0.01, &choice.delays))?;
        let samples = spectra.samples();
        // With the penalties of the choice.
        let criterion = choice.criterion + found.criterion(samples) - choice.found.criterion(samples);
        let freed = Choice { found, criterion, ..choice.clone() };
        (self.unstable_poles(&freed).is_empty() || !choice.stabilised()).then_some(freed)
    }

    /// A model with such noise where the criterion is less.
    fn with_free_noise(&self, choice: &Choice) -> Choice {
        self.freed(&self.spectra(&choice.delays), choice).unwrap_or_else(|| choice.clone())
    }

    /// With a filter that moves in every search, where that of the noise at the input of one output leads to a better model: from long regressions
    /// searches end at worse models with it for some records, without it for others. Where no noise enters at the inputs, no filter moves.
    pub(super) fn with_moving_filter(
        self,
        tried: &mut Vec<Choice>,
        at: &mut Choice,
        table: &mut Vec<Candidate>,
    ) -> Option<Self> {
        let noise = &at.found.noise;
        if self.outputs() > 1 || self.samples().0 > LONG || noise.joint.is_none() || noise.parameters() <= FEW {
            return Some(self);
        }
        let moving = Problem { filter_moves: true, ..self.clone() };
        let same = Task { origin: "the same with a filter that moves".into(), ..moving.same(at) };
        let mut found = moving.run(vec![same], f64::INFINITY, table);
        found.extend(moving.regressed(table));
        let better = moving.improved(&mut found, table)?;
        if moving.with_free_noise(&better).criterion >= self.with_free_noise(at).criterion - 0.5 {
            return Some(self);
        }
        tried.extend(found);
        *at = better;
        Some(moving)
    }
}
