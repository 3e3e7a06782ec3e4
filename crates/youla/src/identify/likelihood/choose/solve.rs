//! The choice of order and dead time by the likelihood of the record: starts, then models one step away as long as Schwarz's
//! criterion falls.

use super::dead_time::dead_times;
use super::loads;
use super::problem::{Choice, LONG, Problem, Solution, Task, credit_of_lags};
use super::wide;
use crate::identify::likelihood::Candidate;
use crate::identify::likelihood::data::lag_sums::LagSums;
use crate::identify::likelihood::search::{SearchOptions, search, with_best_ends};
use crate::identify::subspace::Experiment;
use std::sync::Arc;

/// Starts from long regressions that are searched without dead time.
const FIRST: usize = 2;
/// Samples of that part.
const SHORT: usize = 15000;
/// Least part of a record.
const SHORTEST: usize = 500;
/// Rounds of models one step away.
const ROUNDS: usize = 16;
/// Differences of the criterion that decide neither between dead times nor for a direct path: odds of e^4 to one.
pub const INDISTINCT: f64 = 8.0;
/// Difference of the criterion up to which a model with fewer states may owe it to a wrong dead time. Two samples cost 23 with
/// 12 000 samples of 10 dB; distinctly wrong orders cost hundreds.
const WRONG_DELAY: f64 = 60.0;
/// Distance of an unstable pole of a loop from the poles of the plant, over its distance from the unit circle, from which the feedback moves it.
/// Loops that lack one of several slow modes have 15 to 30.
const MOVED: f64 = 5.0;
/// Decrease of the deviance that the last search leaves at most: a hundredth of a standard deviation along any direction, so that the last digits of
/// a log do not show in the model.
const CONVERGED: f64 = 1e-4;
/// Differences of the criterion of rivals up to which a model counts beside the best: weights of e^-6.
const BESIDE: f64 = 12.0;

pub(super) fn best(tried: &[Choice]) -> Option<&Choice> {
    tried.iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion))
}

impl Problem<'_> {
    /// The model that the records support; what was tried is noted in the table. `None` where no search ends.
    pub(crate) fn solve(&self, table: &mut Vec<Candidate>) -> Option<Solution> {
        self.solve_from(self.first(table)?, table)
    }

    /// The models from which others are reached: of a long record that of its first part.
    pub(super) fn first(&self, table: &mut Vec<Candidate>) -> Option<Vec<Choice>> {
        let samples = self.samples().0;
        if samples > self.long() {
            return Some(vec![self.chosen_on_a_part(samples, table)?]);
        }
        Some(self.regressed(table))
    }

    /// Samples above which order and dead time are first chosen on a part of them.
    fn long(&self) -> usize {
        if self.is_wide() { wide::LONG } else { LONG }
    }

    /// The model that is reached from some models.
    pub(super) fn solve_from(&self, mut tried: Vec<Choice>, table: &mut Vec<Candidate>) -> Option<Solution> {
        if self.is_wide() {
            return self.solve_wide_from(tried, table);
        }
        let samples = self.samples().0;
        let now = best(&tried)?.found.feedthrough;
        let here = self.with_feedthrough(now);
        let mut at = here.improved(&mut tried, table)?;
        if self.stops_at(&at) {
            return Some(Solution { chosen: at, rivals: Vec::new(), unseen: None, samples });
        }
        let here = here.with_moving_filter(&mut tried, &mut at, table)?;
        here.walk_through_unstable(&mut tried, &at, table);
        here.integrating(&mut tried, &at, table);
        if best(&tried)?.criterion < at.criterion {
            at = here.improved(&mut tried, table)?;
        }
        let tasks = here.rivals(&at);
        let credit = tasks.iter().map(|task| credit_of_lags(&task.start.model, samples)).fold(0.0, f64::max);
        tried.extend(here.run(tasks, at.as_rival(samples) + BESIDE + credit, table));
        if best(&tried)?.criterion < at.criterion {
            at = here.improved(&mut tried, table)?;
        }
        if self.direct.is_some() && !now {
            let wider = here.with_feedthrough(true);
            // a dead time that the record does not tell from none hides what acts in the same sample
            let at_once = tried.iter().filter(|c| c.delays.iter().all(|d| *d == 0) && c.delays != at.delays);
            let at_once = at_once.min_by(|a, b| a.criterion.total_cmp(&b.criterion));
            let tasks = std::iter::once(&at).chain(at_once).map(|c| wider.same(c)).collect();
            tried.extend(wider.run(tasks, at.criterion, table));
            if best(&tried)?.criterion < at.criterion - INDISTINCT {
                at = wider.improved(&mut tried, table)?;
            }
        }
        if samples <= LONG {
            let last = here.with_feedthrough(at.found.feedthrough);
            last.smaller_along_delays(&mut tried, &at, table);
            if best(&tried)?.criterion < at.criterion {
                at = last.improved(&mut tried, table)?;
            }
            last.along_delays(&mut tried, &at, table);
        }
        self.concluded(tried, &at)
    }

    /// The calmest model beside the best, searched to its end, with its rivals.
    pub(super) fn concluded(&self, mut tried: Vec<Choice>, at: &Choice) -> Option<Solution> {
        let samples = self.samples().0;
        let place = calmest(&tried, at)?;
        let mut chosen = tried[place].clone();
        let spectra = self.spectra(&chosen.delays);
        let last = self.with_feedthrough(chosen.found.feedthrough);
        let options = SearchOptions { filter_moves: true, ..last.options(40, CONVERGED, &chosen.delays) };
        if let Some(found) = search(&spectra, chosen.found.point.clone(), Some(&chosen.found.noise), &options) {
            let last = self.choice(found, &spectra, chosen.origin.clone());
            if last.stabilised() || !chosen.stabilised() {
                chosen = last;
                // Beside the others it counts by what it had with a filter as theirs.
                tried[place].found = chosen.found.clone();
            }
        }
        let least = tried.iter().map(|c| c.as_rival(samples)).fold(f64::INFINITY, f64::min);
        let rivals = tried.into_iter().filter(|c| c.as_rival(samples) <= least + BESIDE).collect();
        Some(Solution { chosen, rivals, unseen: None, samples })
    }

    /// Models one step away as long as the criterion falls.
    pub(super) fn improved(&self, tried: &mut Vec<Choice>, table: &mut Vec<Candidate>) -> Option<Choice> {
        let mut at = best(tried)?.clone();
        for _ in 0..ROUNDS {
            if self.out_of_time() || self.stops_at(&at) {
                break;
            }
            let tasks = self.neighbours(&at);
            tried.extend(self.run(tasks, at.criterion, table));
            let before = std::mem::replace(&mut at, best(tried)?.clone());
            if at.criterion >= before.criterion - 0.5 {
                break;
            }
        }
        Some(at)
    }

    /// Goes on from a model that the feedback does not stabilise where it explains distinctly more than the best that it does: of a machine with
    /// more slow modes than the model, the next mode alone often makes the loop unstable, and the one after it makes it stable again.
    fn walk_through_unstable(&self, tried: &mut Vec<Choice>, at: &Choice, table: &mut Vec<Candidate>) {
        // A growing mode that the feedback does not move is a disturbance whose size changes.
        let moved = |c: &&Choice| self.unstable_poles(c).iter().all(|(z, apart)| *apart > MOVED * z.norm().ln());
        let unstable: Vec<Choice> =
            tried.iter().filter(|c| !c.stabilised()).filter(moved).map(Choice::without_penalty).collect();
        let Some(start) = best(&unstable).filter(|c| c.criterion < at.criterion - INDISTINCT) else { return };
        let (mut walked, free) = (vec![start.clone()], Problem { feedback: None, ..self.clone() });
        free.improved(&mut walked, &mut Vec::new());
        let walked = walked.into_iter().skip(1).map(|choice| self.with_penalty(choice));
        let first = tried.len();
        tried.extend(walked);
        table.extend(tried[first..].iter().map(|choice| self.noted(choice)));
    }

    /// The best model with an integrator in the place of a slow pole outside of the unit circle: a search that begins with a wrong model of slow
    /// noise at the inputs ends at two poles around 1, a likelihood of hundreds of nats below that of the machine.
    fn integrating(&self, tried: &mut Vec<Choice>, at: &Choice, table: &mut Vec<Candidate>) {
        let Some(model) = at.found.point.model.with_integrator() else { return };
        let spectra = Arc::new(self.spectra(&at.delays));
        let task = self.beside(&at.found.noise, model, &spectra, "an integrator for a pole outside");
        tried.extend(self.run(vec![task], f64::INFINITY, table));
    }

    /// The best models with fewer states, along their dead times: a pole in excess makes several dead times look alike, and without it
    /// the wrong one of them is left.
    fn smaller_along_delays(&self, tried: &mut Vec<Choice>, at: &Choice, table: &mut Vec<Candidate>) {
        for order in 1..at.order() {
            let alike = |c: &&Choice| c.order() == order && c.found.feedthrough == at.found.feedthrough;
            let of_order = tried.iter().filter(alike).min_by(|a, b| a.criterion.total_cmp(&b.criterion)).cloned();
            if let Some(smaller) = of_order.filter(|c| c.criterion <= at.criterion + WRONG_DELAY) {
                self.along_delays(tried, &smaller, table);
            }
        }
    }

    /// The dead times of a single input next to the best, one after the other from the model before, until one is distinctly worse.
    pub(super) fn along_delays(&self, tried: &mut Vec<Choice>, at: &Choice, table: &mut Vec<Candidate>) {
        let limit = at.criterion + INDISTINCT;
        let alike = |c: &Choice| c.order() == at.order() && c.found.feedthrough == at.found.feedthrough;
        for later in [false, true] {
            let mut from = at.clone();
            while let [delay] = from.delays[..] {
                let next = if later { Some(delay + 1) } else { delay.checked_sub(1) };
                let Some(next) = next.filter(|next| *next <= self.skip && self.dead_time.is_none()) else { break };
                let known = tried.iter().find(|c| c.delays == [next] && alike(c) && c.criterion <= limit).cloned();
                let mut search = || {
                    let spectra = Arc::new(self.spectra(&[next]));
                    let model = from.found.point.model.clone();
                    let task = self.beside(&from.found.noise, model, &spectra, "another dead time");
                    self.run(vec![task], limit, table).pop()
                };
                let found = match known {
                    Some(known) => known,
                    None => {
                        let Some(found) = search() else { break };
                        tried.push(found.clone());
                        found
                    }
                };
                if found.criterion > limit {
                    break;
                }
                from = found;
            }
        }
    }

    /// The same model as a start, for D to move.
    pub(super) fn same(&self, choice: &Choice) -> Task {
        Task {
            spectra: Arc::new(self.spectra(&choice.delays)),
            start: choice.found.point.clone(),
            origin: "feedthrough".into(),
        }
    }

    /// Searches from long regressions, without dead time and with that which a long regression shows.
    pub(super) fn regressed(&self, table: &mut Vec<Candidate>) -> Vec<Choice> {
        let zero = vec![0; self.inputs()];
        let count = if self.is_wide() { 1 } else { FIRST };
        let mut tasks = match &self.dead_time {
            Some(delays) => self.first_tasks(delays, count),
            None => {
                let most = if self.is_wide() { self.samples().0 / 4 / (self.inputs() + self.outputs()) } else { 40 };
                let past = 40.min(self.samples().1 / 8).min(most).max(2);
                let sums = LagSums::new(self.experiments, &self.sizes, &zero, past);
                let delays = dead_times(&sums, self.inputs(), self.skip);
                let mut tasks = self.first_tasks(&zero, count);
                if delays != zero {
                    tasks.extend(self.first_tasks(&delays, 1));
                }
                tasks
            }
        };
        if !self.is_wide() {
            tasks.extend(self.order.and_then(|order| self.resized(order)));
        }
        self.run(tasks, f64::INFINITY, table)
    }

    /// The choice for the first part of long records, searched again on all of them.
    fn chosen_on_a_part(&self, samples: usize, table: &mut Vec<Candidate>) -> Option<Choice> {
        let short = if self.is_wide() { wide::SHORT } else { SHORT };
        let share = short as f64 / samples as f64;
        let kept = |rows: usize| ((rows as f64 * share) as usize).max(SHORTEST).min(rows);
        let mut longest: Vec<usize> = (0..self.experiments.len()).collect();
        longest.sort_by_key(|k| std::cmp::Reverse(self.experiments[*k].u.nrows()));
        // Of many records the longest only.
        let mut sum = 0;
        longest.retain(|k| {
            sum += kept(self.experiments[*k].u.nrows());
            sum <= self.long()
        });
        longest.sort_unstable();
        let cut = |k: &usize| {
            let e = &self.experiments[*k];
            let rows = kept(e.u.nrows());
            (e.u.subrows(0, rows).to_owned(), e.y.subrows(0, rows).to_owned())
        };
        let parts: Vec<_> = longest.iter().map(cut).collect();
        let short: Vec<Experiment<'_>> = parts.iter().map(|(u, y)| Experiment::new(u.as_ref(), y.as_ref())).collect();
        let part = Problem { experiments: &short, ..self.clone() };
        let chosen = loads::solve(&part, &[], table)?.solution.chosen;
        let spectra = self.spectra(&chosen.delays);
        let whole = self.with_feedthrough(chosen.found.feedthrough);
        let options = whole.options(15, 0.3, &chosen.delays);
        let start = with_best_ends(&spectra, chosen.found.point.model, &chosen.found.noise);
        let found = search(&spectra, start, Some(&chosen.found.noise), &options)?;
        Some(self.choice(found, &spectra, "first part of the records".into()))
    }
}

/// The place of the model with the least gain at high frequencies, where physical machines have little and wrong dead times much, of those of
/// the same order within [`INDISTINCT`] of the least criterion.
fn calmest(tried: &[Choice], at: &Choice) -> Option<usize> {
    let calm = |c: &Choice| c.found.point.model.fast_gain();
    let same = |c: &Choice| c.order() == at.order() && c.found.feedthrough == at.found.feedthrough;
    let alike = |(_, c): &(usize, &Choice)| c.criterion <= at.criterion + INDISTINCT && same(c);
    let calmest = tried.iter().enumerate().filter(alike).min_by(|(_, a), (_, b)| calm(a).total_cmp(&calm(b)));
    calmest.map(|(place, _)| place)
}
