//! The records with what is fixed about the model, and the searches that are made on them.

use super::deadline::Deadline;
use crate::control::{closed_loop, with_input_port};
use crate::identify::likelihood::Candidate;
use crate::identify::likelihood::data::spectra::{Mask, Sizes, Spectra};
use crate::identify::likelihood::deviation::physical;
use crate::identify::likelihood::search::feedthrough::Answer;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::noise::Noise;
use crate::identify::likelihood::search::point::Point;
use crate::identify::likelihood::search::{Found, SearchOptions, on_groups, search, with_best_inputs};
use crate::identify::subspace::Experiment;
use crate::lti::{Discrete, StateSpace};
use faer::{Mat, c64};
use rayon::prelude::*;
use std::sync::Arc;

/// Largest order of the autoregression of the noise: noise at the inputs of a plant has zeros near the circle as well as poles.
pub(crate) const NOISE_ORDER: usize = 40;

/// Samples of all records above which order and dead time are first chosen on a part of them.
pub(crate) const LONG: usize = 30000;
/// Tasks on them that count, and distance of the criterion on groups of lines to the aim up to which the best is searched on all lines: twice that
/// of rivals. All lines gain a few nats on groups.
const KEPT: usize = 2;
const NEAR: f64 = 24.0;

/// More than any criterion of a record that fits into memory.
const UNSTABLE: f64 = 1e12;

/// Largest growth of a mode over all records of an open loop, as a logarithm: an integrator is not told from less, nor a disturbance at one
/// frequency in a closed one.
pub(crate) const GROWTH: f64 = 2.0;

/// A found model with the delays it was found for.
#[derive(Clone)]
pub(crate) struct Choice {
    /// The model.
    pub(crate) found: Found,
    /// Delays of the inputs in samples.
    pub(crate) delays: Vec<usize>,
    /// Schwarz's criterion.
    pub(crate) criterion: f64,
    /// Where its start came from.
    pub(crate) origin: String,
}

impl Choice {
    /// Whether the feedback stabilises it, as far as one explains the log.
    pub(crate) fn stabilised(&self) -> bool {
        self.criterion < 0.5 * UNSTABLE
    }

    /// The same with Schwarz's criterion alone, whether the feedback stabilises it or not.
    pub(super) fn without_penalty(&self) -> Self {
        let criterion = if self.stabilised() { self.criterion } else { self.criterion - UNSTABLE };
        Choice { criterion, ..self.clone() }
    }

    /// The criterion by which it counts beside the chosen model.
    pub(crate) fn as_rival(&self, samples: usize) -> f64 {
        self.criterion - credit_of_lags(&self.found.point.model, samples)
    }

    /// States of oscillating modes.
    pub(super) fn oscillating(&self) -> usize {
        self.order() - lags(&self.found.point.model)
    }

    /// States without those of the delays.
    pub(crate) fn order(&self) -> usize {
        self.found.point.model.order()
    }
}

/// What Akaike's criterion takes off that of Schwarz for the states of lags: damping ratio 0.7 and more on either side of the unit circle.
///
/// Schwarz's criterion, which chooses, takes lags that are hardly seen for none rather than for wrong ones; whether they are there is for
/// Akaike's to say. Of oscillating modes the best of all frequencies is tried, of which one always gains more than two per parameter: with
/// Akaike's for all states 5 of 28 good models were refused for poles that are not there.
pub(crate) fn credit_of_lags(model: &Model, samples: usize) -> f64 {
    ((samples.max(2) as f64).ln() - 2.0) * ((model.inputs + model.outputs) * lags(model)) as f64
}

/// States of lags.
fn lags(model: &Model) -> usize {
    model.poles().iter().filter(|pole| pole.norm().ln().abs() >= pole.arg().abs()).count()
}

/// The chosen model and those that the data do not tell from it.
#[derive(Clone)]
pub(crate) struct Solution {
    /// The model.
    pub(crate) chosen: Choice,
    /// Models whose likelihood is close.
    pub(crate) rivals: Vec<Choice>,
    /// The model with the modes that only the noise shows, a rival of equal weight: where the excitation shows nothing, the records do not say
    /// whether plant or noise has them.
    pub(crate) unseen: Option<Choice>,
    /// Samples of all records.
    pub(crate) samples: usize,
}

impl Solution {
    /// The rivals with the criteria of their weights.
    pub(crate) fn weighed(&self) -> impl Iterator<Item = (&Choice, f64)> {
        let close = self.rivals.iter().map(|c| (c, c.as_rival(self.samples)));
        close.chain(self.unseen.iter().map(|c| (c, self.chosen.as_rival(self.samples))))
    }
}

/// A search to be done.
pub(crate) struct Task {
    /// The lines for the delays.
    pub(crate) spectra: Arc<Spectra>,
    /// Where it starts.
    pub(crate) start: Point,
    /// Where the start came from.
    pub(crate) origin: String,
}

/// Everything that a search needs to know of the records.
#[derive(Clone)]
pub(crate) struct Problem<'a> {
    /// Records.
    pub(crate) experiments: &'a [Experiment<'a>],
    /// Sizes of the channels.
    pub(crate) sizes: Sizes,
    /// Samples kept as the past of delayed inputs: the largest dead time.
    pub(crate) skip: usize,
    /// Whether D moves.
    pub(crate) feedthrough: bool,
    /// Whether D may be chosen by the evidence, and what the controller answers in the same sample, in units of the sizes: without it D
    /// cannot be distinguished from the noise.
    pub(crate) direct: Option<Answer>,
    /// Whether the records are of an open loop, in which nothing unstable stays within bounds.
    pub(crate) open_loop: bool,
    /// The order where it is given.
    pub(crate) order: Option<usize>,
    /// The dead times where they are given.
    pub(crate) dead_time: Option<Vec<usize>>,
    /// Largest order.
    pub(crate) largest_order: usize,
    /// Bands of disturbances whose lines do not count.
    pub(crate) masked: Vec<Mask>,
    /// The feedback that ran, where it explains the log: what it does not stabilise is not the plant.
    pub(crate) feedback: Option<&'a StateSpace<Discrete>>,
    /// Whether the filter of noise at the input of one output moves in every search: else in the last one alone.
    pub(crate) filter_moves: bool,
    /// Whether the walk stops at a model with several modes that the inputs hardly move.
    pub(crate) watched: bool,
    /// When the search for a better model ends.
    pub(crate) deadline: Option<Deadline>,
}

impl Problem<'_> {
    /// The lines for given delays.
    pub(crate) fn spectra(&self, delays: &[usize]) -> Spectra {
        self.spectra_of(self.experiments, delays)
    }

    /// The lines of other records in the same units.
    pub(crate) fn spectra_of(&self, experiments: &[Experiment<'_>], delays: &[usize]) -> Spectra {
        let spectra = Spectra::new(experiments, &self.sizes, delays, self.skip).masked(&self.masked);
        Spectra { held: !self.open_loop, ..spectra }
    }

    /// Options of a search.
    pub(crate) fn options(&self, steps: usize, tolerance: f64, delays: &[usize]) -> SearchOptions {
        let (m, p) = (self.inputs(), self.outputs());
        let at_once = |known: &Answer| Answer {
            gain: Mat::from_fn(m, p, |j, i| if delays[j] == 0 { known.gain[(j, i)] } else { 0.0 }),
            ..*known
        };
        let direct = self.direct.as_ref().map_or_else(Answer::unknown, at_once);
        let radius = if self.open_loop { 1.0 + GROWTH / self.samples().0 as f64 } else { f64::INFINITY };
        let aim = f64::INFINITY;
        SearchOptions {
            feedthrough: self.feedthrough,
            noise_order: NOISE_ORDER,
            steps,
            tolerance,
            aim,
            direct,
            radius,
            // Searches on long records of one output begin at the model of their first part; the filter of several moves anyway.
            filter_moves: self.filter_moves || (self.outputs() == 1 && self.samples().0 > LONG),
        }
    }

    /// The same with D moving or not.
    pub(crate) fn with_feedthrough(&self, feedthrough: bool) -> Self {
        Problem { feedthrough, ..self.clone() }
    }

    /// Inputs.
    pub(crate) fn inputs(&self) -> usize {
        self.sizes.u.len()
    }

    /// Outputs.
    pub(crate) fn outputs(&self) -> usize {
        self.sizes.y.len()
    }

    /// Samples of all records, and of the shortest.
    pub(crate) fn samples(&self) -> (usize, usize) {
        let rows = || self.experiments.iter().map(|e| e.u.nrows());
        (rows().sum(), rows().min().unwrap_or(0))
    }

    /// A choice with Schwarz's criterion, and the penalty where the feedback does not stabilise it.
    pub(super) fn with_penalty(&self, choice: Choice) -> Choice {
        Choice { criterion: choice.criterion + self.instability(&choice), ..choice }
    }

    /// What is added to the criterion of a model that the feedback does not stabilise, so that any other comes before it.
    fn instability(&self, choice: &Choice) -> f64 {
        if self.unstable_poles(choice).is_empty() { 0.0 } else { UNSTABLE }
    }

    /// Poles of the loop outside of the unit circle, each with its distance to the nearest pole of the plant.
    ///
    /// A pole on the unit circle that the feedback does not move is a disturbance at one frequency, and is left to `lines`; one that the plant does
    /// not move is that of the statement of the controller, as rounding of a polynomial with an integrator leaves it.
    pub(super) fn unstable_poles(&self, choice: &Choice) -> Vec<(c64, f64)> {
        let least = GROWTH / self.samples().0 as f64;
        let outside = self.poles_outside(choice);
        if outside.is_empty() {
            return outside;
        }
        let of_controller = self.feedback.and_then(|k| k.poles().ok()).unwrap_or_default();
        let moved = |z: &c64, apart: f64| apart > least && of_controller.iter().all(|pole| (pole - z).norm() > least);
        outside.into_iter().filter(|(z, apart)| z.norm().ln() > least || moved(z, *apart)).collect()
    }

    /// The same with those on the circle that the feedback does not move.
    pub(super) fn poles_outside(&self, choice: &Choice) -> Vec<(c64, f64)> {
        let Some([own, of_loop]) = self.poles(choice) else { return Vec::new() };
        let apart = |z: &c64| own.iter().map(|p| (p - z).norm()).fold(f64::INFINITY, f64::min);
        of_loop.into_iter().filter(|z| z.norm() >= 1.0).map(|z| (z, apart(&z))).collect()
    }

    /// Poles of a model and of its loop; `None` where the feedback is not known.
    pub(super) fn poles(&self, choice: &Choice) -> Option<[Vec<c64>; 2]> {
        let k = self.feedback?;
        let plant = physical::plant(choice, &self.sizes, k.time()).ok()?;
        let of_loop = closed_loop(&plant, &with_input_port(k).ok()?).ok()?.poles().ok()?;
        Some([plant.poles().ok()?, of_loop])
    }

    /// What a search found on some lines.
    pub(crate) fn choice(&self, found: Found, spectra: &Spectra, origin: String) -> Choice {
        let criterion = found.criterion(spectra.samples());
        self.with_penalty(Choice { found, delays: spectra.delays.clone(), criterion, origin })
    }

    /// The search on some lines that begins at a model beside the noise of another one, with the inputs, direct path and ends that suit it best.
    pub(super) fn beside(&self, noise: &Noise, model: Model, spectra: &Arc<Spectra>, origin: &str) -> Task {
        let start = with_best_inputs(spectra, model, noise, self.feedthrough);
        Task { spectra: spectra.clone(), start, origin: origin.into() }
    }

    /// Searches all tasks side by side and notes them in their order.
    pub(crate) fn run(&self, tasks: Vec<Task>, aim: f64, table: &mut Vec<Candidate>) -> Vec<Choice> {
        // What begins a search is always tried.
        let tasks = tasks.into_par_iter().filter(|_| !(aim.is_finite() && self.out_of_time()));
        let found = match self.samples().0 > LONG {
            true => self.searched_on_groups(tasks, aim),
            false => tasks.filter_map(|task| self.searched(task, aim)).collect(),
        };
        table.extend(found.iter().map(|choice| self.noted(choice)));
        found
    }

    /// Where a search on all lines ends.
    fn searched(&self, task: Task, aim: f64) -> Option<Choice> {
        let options = SearchOptions { aim, ..self.options(25, 0.3, &task.spectra.delays) };
        let found = search(&task.spectra, task.start, None, &options)?;
        Some(self.choice(found, &task.spectra, task.origin))
    }

    /// Of tasks on long records those that reach the least criteria on groups of lines, searched on all lines where they come near the aim.
    fn searched_on_groups(&self, tasks: impl ParallelIterator<Item = Task>, aim: f64) -> Vec<Choice> {
        let reached = |task: Task| {
            let options = SearchOptions { aim, ..self.options(25, 0.3, &task.spectra.delays) };
            let Some(found) = on_groups(&task.spectra, &task.start, None, &options) else {
                return Some((self.searched(task, aim)?, None));
            };
            let choice = self.choice(found, &task.spectra, task.origin);
            Some((choice, Some(task.spectra)))
        };
        let mut found: Vec<(Choice, Option<Arc<Spectra>>)> = tasks.filter_map(reached).collect();
        found.sort_by(|a, b| a.0.criterion.total_cmp(&b.0.criterion));
        found.truncate(KEPT);
        // All lines decide of the best alone.
        if let Some((best, Some(spectra))) = found.first_mut().filter(|(choice, _)| choice.criterion < aim + NEAR) {
            let Choice { found, origin, .. } = best.clone();
            let task = Task { spectra: spectra.clone(), start: found.point, origin };
            if let Some(last) = self.searched(task, aim) {
                *best = last;
            }
        }
        found.into_iter().map(|(choice, _)| choice).collect()
    }

    /// Whether nothing better is tried any more.
    pub(super) fn out_of_time(&self) -> bool {
        self.deadline.as_ref().is_some_and(Deadline::ends)
    }

    /// A choice as it is listed.
    pub(super) fn noted(&self, choice: &Choice) -> Candidate {
        Candidate {
            origin: choice.origin.clone(),
            dead_time: choice.delays.clone(),
            order: choice.order(),
            deviance: choice.found.deviance,
            criterion: choice.without_penalty().criterion,
            samples: self.samples().0,
            steps: choice.found.steps,
            stabilised: choice.stabilised(),
        }
    }
}
