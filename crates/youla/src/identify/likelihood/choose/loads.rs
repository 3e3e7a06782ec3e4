//! Steps of load: what acts at an input beside it and changes in steps, `y = G (u + w) + v`.
//!
//! A few large steps are no stationary noise: a model that has to describe them as such bends the plant at low frequencies, which the feedback
//! hides from the loop that ran. Places and sizes are estimated with the parameters of the model (`places`), one round of search after the
//! other, and stay free in its region.

use super::lines::Cleaned;
use super::places::{Places, turned};
use super::problem::{Choice, LONG, Problem, Solution, Task};
use super::unmoved::free_modes;
use crate::identify::likelihood::data::spectra::{Lines, Spectra, long_enough};
use crate::identify::likelihood::search::separable::separable;
use crate::identify::likelihood::search::with_best_ends;
use crate::identify::likelihood::{Candidate, Evidence};
use crate::identify::subspace::Experiment;
use crate::identify::verdict::limits::{LARGEST_LOAD, MOST_STEPS};
use faer::{Mat, c64};
use rayon::prelude::*;
use std::sync::Arc;

/// Rounds of a model and the steps that it shows.
const ROUNDS: usize = 4;
/// Turns of sizes and model in a round, and the change of a size below which they end.
const TURNS: usize = 8;
const NOTICED: f64 = 1e-4;
/// Least samples of a record for each step in it: what changes more often is friction, or a noise.
const SAMPLES_PER_STEP: usize = 500;
/// Samples of a record above which steps are not looked for: time and memory of the transforms. Of a longer record the load is a noise.
const LONGEST: usize = 100_000;

/// A step of load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// Its first sample.
    sample: usize,
    /// Its input.
    input: usize,
    /// Its size in units of the input.
    size: f64,
}

impl Step {
    /// Its place on the lines of a record, whose first samples are the past of the delayed inputs.
    fn place(&self, delays: &[usize], skip: usize) -> usize {
        (self.sample + delays[self.input]).saturating_sub(skip)
    }
}

/// The steps of the records of estimation (0) and of the fresh ones (1).
pub(crate) type Steps = [Vec<Vec<Step>>; 2];

/// The inputs with the load that acts beside them.
fn loaded(records: &[Experiment<'_>], steps: &[Vec<Step>]) -> Vec<Mat<f64>> {
    let with = |(e, steps): (&Experiment<'_>, &Vec<Step>)| {
        let mut u = e.u.to_owned();
        for step in steps {
            (step.sample..u.nrows()).for_each(|t| u[(t, step.input)] += step.size);
        }
        u
    };
    records.iter().zip(steps).map(with).collect()
}

/// The inputs of the records of estimation and of the fresh ones with their steps of load.
pub(super) fn inputs(all: &Problem<'_>, fresh: &[Experiment<'_>], steps: &Steps) -> [Vec<Mat<f64>>; 2] {
    [loaded(all.experiments, &steps[0]), loaded(fresh, &steps[1])]
}

/// Parameters of some steps: place and size.
fn parameters(steps: &Steps) -> f64 {
    2.0 * steps[0].iter().map(Vec::len).sum::<usize>() as f64
}

/// The model with the steps of load that it shows, as long as Schwarz's criterion falls.
pub(super) fn with_steps(
    all: &Problem<'_>,
    fresh: &[Experiment<'_>],
    mut now: Cleaned,
    table: &mut Vec<Candidate>,
) -> Cleaned {
    if !are_sought(all) {
        return now;
    }
    for _ in 0..ROUNDS {
        if all.out_of_time() {
            break;
        }
        // Of a model whose steps are known, the modes that stood for them go first.
        let less = now.steps.as_ref().and_then(|_| without_free_modes(all, &now, table));
        let next = less
            .into_iter()
            .chain([now.clone()])
            .find_map(|from| with_shown(all, fresh, &from, table).filter(|next| total(all, next) < total(all, &now)));
        let Some(next) = next else { break };
        now = next;
    }
    now
}

/// Adds the steps that the fresh records alone show: the model is that of the records of estimation, and the fresh ones are compared with it.
pub(super) fn in_fresh(all: &Problem<'_>, fresh: &[Experiment<'_>], mut now: Cleaned) -> Cleaned {
    if now.steps.is_some() || !are_sought(all) {
        return now;
    }
    let clean = now.records(1, fresh);
    let found = clean.par_iter().map(|e| of_record(all, &now.solution.chosen, e));
    let found = found.collect::<Option<Vec<Vec<Step>>>>().filter(|found| found.iter().any(|steps| !steps.is_empty()));
    if let Some(found) = found {
        let steps = [vec![Vec::new(); all.experiments.len()], found];
        now.inputs = Some(inputs(all, fresh, &steps));
        now.steps = Some(steps);
    }
    now
}

/// The model with the steps that it shows; `None` where it shows none.
fn with_shown(
    all: &Problem<'_>,
    fresh: &[Experiment<'_>],
    now: &Cleaned,
    table: &mut Vec<Candidate>,
) -> Option<Cleaned> {
    let steps = steps(all, fresh, now)?;
    let inputs = Some(inputs(all, fresh, &steps));
    refined(all, fresh, Cleaned { inputs, steps: Some(steps), ..now.clone() }, table)
}

/// Whether disturbances are looked for before the walk: not of many channels, and not in an open loop, in which no feedback hides what they do to the model.
pub(super) fn are_sought(all: &Problem<'_>) -> bool {
    !(all.is_wide() || separable(all.outputs()) || all.open_loop)
}

/// Schwarz's criterion of a model and its steps.
fn total(all: &Problem<'_>, of: &Cleaned) -> f64 {
    let log = (all.samples().0.max(2) as f64).ln();
    of.solution.chosen.criterion + log * of.steps.as_ref().map_or(0.0, parameters)
}

/// The model that records support, on their inputs with steps of load where a transient shows on the way to it.
///
/// A load that ends some samples after the start of a record is what free modes describe too, two numbers in place of one step each, and the walk
/// would add modes up to the largest order. It stops at a model with several modes that the inputs hardly move: they are left out, and what is
/// left shows the steps. Where these explain no more than the modes did, the walk goes on.
pub(super) fn solve(all: &Problem<'_>, fresh: &[Experiment<'_>], table: &mut Vec<Candidate>) -> Option<Cleaned> {
    // Of a long record the walk on its first part has been watched.
    let watched = Problem { watched: are_sought(all) && all.samples().0 <= LONG, ..all.clone() };
    let first = all.first(table)?;
    let now = Cleaned::untouched(watched.solve_from(first, table)?);
    if !watched.stops_at(&now.solution.chosen) {
        return Some(now);
    }
    if let Some(less) = without_free_modes(all, &now, table) {
        let next = with_steps(all, fresh, less, table);
        if next.steps.is_some() && total(all, &next) < total(all, &now) {
            return Some(next);
        }
    }
    // Rivals with other lags stay; those with other modes than the chosen one have some that stand for the same loads.
    let Solution { chosen, mut rivals, .. } = now.solution;
    rivals.retain(|rival| rival.oscillating() == chosen.oscillating());
    rivals.push(chosen);
    Some(Cleaned::untouched(all.solve_from(rivals, table)?))
}

/// The model without the modes that the inputs hardly move; `None` where there are none or no others, and where the order is given.
fn without_free_modes(all: &Problem<'_>, now: &Cleaned, table: &mut Vec<Candidate>) -> Option<Cleaned> {
    let choice = &now.solution.chosen;
    let records = now.records(0, all.experiments);
    let problem = now.problem(all, &records);
    let spectra = Arc::new(problem.spectra(&choice.delays));
    let noise = &choice.found.noise;
    let point = with_best_ends(&spectra, choice.found.point.model.separated()?, noise);
    let free = free_modes(&spectra, &point, noise);
    if all.order.is_some() || free.is_empty() || free.len() == point.model.blocks.len() {
        return None;
    }
    let task = problem.beside(noise, point.model.without(&free), &spectra, "without free modes");
    let chosen = problem.run(vec![task], f64::INFINITY, table).pop()?;
    Some(Cleaned { solution: Solution { chosen, ..now.solution.clone() }, ..now.clone() })
}

/// The model with the sizes of its steps: in turn one step of Gauss and Newton of all together and a search of the model with these sizes, then
/// models one step away.
fn refined(
    all: &Problem<'_>,
    fresh: &[Experiment<'_>],
    mut now: Cleaned,
    table: &mut Vec<Candidate>,
) -> Option<Cleaned> {
    for turn in 0..TURNS {
        if turn > 0 && !resized(all, fresh, &mut now)? {
            break;
        }
        let records = now.records(0, all.experiments);
        let problem = now.problem(all, &records);
        let choice = now.solution.chosen.clone();
        let spectra = Arc::new(problem.spectra(&choice.delays));
        let task = Task { spectra, start: choice.found.point, origin: "with steps of load".into() };
        let chosen = problem.run(vec![task], f64::INFINITY, &mut Vec::new()).pop()?;
        now.solution.chosen = chosen;
    }
    let records = now.records(0, all.experiments);
    let solution = now.problem(all, &records).solve_from(vec![now.solution.chosen.clone()], table)?;
    Some(Cleaned { solution, ..now.clone() })
}

/// Changes the sizes of all steps together with the parameters of the model, and says whether one changed noticeably.
fn resized(all: &Problem<'_>, fresh: &[Experiment<'_>], now: &mut Cleaned) -> Option<bool> {
    let (mut steps, mut noticed) = (now.steps.clone()?, false);
    let choice = &now.solution.chosen;
    for (which, experiments) in [all.experiments, fresh].into_iter().enumerate() {
        let records = now.records(which, experiments);
        for (e, steps) in records.iter().zip(&mut steps[which]).filter(|(_, steps)| !steps.is_empty()) {
            let spectra = all.spectra_of(std::slice::from_ref(e), &choice.delays);
            let place = |s: &Step| (s.place(&choice.delays, all.skip), s.input);
            let changes = Places::new(&spectra, choice)?.changes(steps.iter().map(place).collect())?;
            for (step, change) in steps.iter_mut().zip(changes) {
                let change = change * all.sizes.u[step.input];
                step.size += change;
                noticed |= change.abs() > NOTICED * step.size.abs();
            }
        }
    }
    (now.inputs, now.steps) = (Some(inputs(all, fresh, &steps)), Some(steps));
    Some(noticed)
}

/// The steps that the model of some records shows in them; `None` where the records of estimation have none, and where a record has more than
/// are steps.
fn steps(all: &Problem<'_>, fresh: &[Experiment<'_>], now: &Cleaned) -> Option<Steps> {
    let choice = &now.solution.chosen;
    let unloaded = Cleaned { inputs: None, ..now.clone() };
    let of = |which: usize, records: &[Experiment<'_>]| {
        let records = unloaded.records(which, records);
        records.par_iter().map(|e| of_record(all, choice, e)).collect::<Option<Vec<Vec<Step>>>>()
    };
    let found = [of(0, all.experiments)?, of(1, fresh)?];
    in_estimation(&found).then_some(found)
}

/// The steps of one record.
fn of_record(all: &Problem<'_>, choice: &Choice, e: &Experiment<'_>) -> Option<Vec<Step>> {
    let rows = e.u.nrows();
    if !long_enough(rows, all.skip) || !(SAMPLES_PER_STEP..=LONGEST).contains(&rows) {
        return Some(Vec::new());
    }
    let spectra = all.spectra_of(std::slice::from_ref(e), &choice.delays);
    let shown = Places::new(&spectra, choice)?.steps(rows / SAMPLES_PER_STEP)?;
    let step = |(place, input, size): (usize, usize, f64)| {
        let sample = place + all.skip - choice.delays[input];
        Step { sample, input, size: size * all.sizes.u[input] }
    };
    Some(shown.into_iter().map(step).collect())
}

/// What the size and the place of each step do to the outputs of the records of estimation, lines x p x columns: nuisance beside the
/// parameters of the model.
pub(crate) fn nuisance(problem: &Problem<'_>, choice: &Choice, steps: &[Vec<Step>], spectra: &Spectra) -> Nuisance {
    let count = 2 * steps.iter().map(Vec::len).sum::<usize>();
    let (m, p, model) = (spectra.inputs, spectra.outputs, &choice.found.point.model);
    let kept = problem.experiments.iter().zip(steps).filter(|(e, _)| long_enough(e.u.nrows(), problem.skip));
    let mut first = 0;
    let of = |(lines, (_, steps)): (&Lines, (_, &Vec<Step>))| {
        let mut values = vec![c64::ZERO; lines.z.len() * p * count];
        for (k, of_line) in values.chunks_exact_mut(p * count).enumerate() {
            let response = model.response(lines.z[k]);
            for (s, step) in steps.iter().enumerate() {
                let place = step.place(&choice.delays, problem.skip);
                let pulse = turned(k + 1, place, lines.samples) / (lines.samples as f64).sqrt();
                let column = first + 2 * s;
                for i in 0..p {
                    let pulse = response[i * m + step.input] * pulse;
                    of_line[i * count + column] = pulse / (c64::ONE - lines.z[k].conj());
                    of_line[i * count + column + 1] = pulse;
                }
            }
        }
        first += 2 * steps.len();
        values
    };
    Nuisance { count, values: spectra.records.iter().zip(kept).map(of).collect() }
}

/// Columns of the steps, per record.
#[derive(Default)]
pub(crate) struct Nuisance {
    /// Their number.
    pub(crate) count: usize,
    /// Lines x p x columns of each record.
    pub(crate) values: Vec<Vec<c64>>,
}

/// The steps of the records of estimation, of the fresh ones where only these have some: their size over that of the inputs, where they are.
pub(crate) fn evidence(steps: &Steps, records: [&[Experiment<'_>]; 2], sizes: &[f64], ts: f64) -> Evidence {
    let (which, of_records) = if in_estimation(steps) { (0, " of record ") } else { (1, " of fresh record ") };
    let (steps, records) = (&steps[which], records[which]);
    let (mut square, mut count) = (0.0, 0.0);
    for (e, steps) in records.iter().zip(steps) {
        let load = loaded(
            &[Experiment { u: Mat::zeros(e.u.nrows(), e.u.ncols()).as_ref(), ..*e }],
            std::slice::from_ref(steps),
        );
        let load = &load[0];
        for j in 0..load.ncols() {
            let mean = load.col(j).iter().sum::<f64>() / load.nrows() as f64;
            square += load.col(j).iter().map(|w| ((w - mean) / sizes[j]).powi(2)).sum::<f64>();
        }
        count += load.nrows() as f64;
    }
    let several = records.len() > 1 || which == 1;
    let mut listed: Vec<(usize, &Step)> =
        steps.iter().enumerate().flat_map(|(k, of)| of.iter().map(move |s| (k, s))).collect();
    listed.sort_by(|a, b| (b.1.size / sizes[b.1.input]).abs().total_cmp(&(a.1.size / sizes[a.1.input]).abs()));
    let place = |(k, step): &(usize, &Step)| {
        let of = if several { format!("{of_records}{}", k + 1) } else { String::new() };
        let input = if sizes.len() > 1 { format!(" at input {}", step.input + 1) } else { String::new() };
        format!("{:.3}{input} at {:.4} s{of}", step.size, step.sample as f64 * ts)
    };
    let largest: Vec<String> = listed.iter().take(LISTED).map(place).collect();
    let question = "Load that changes in steps beside the inputs, over the inputs (load)";
    let listing = if listed.len() == 1 { "1 step".into() } else { format!("{} steps", listed.len()) };
    let note = format!("estimated and added to the inputs: {listing}, the largest {}", largest.join(", "));
    Evidence::new(question, (square / f64::max(count, 1.0)).sqrt(), LARGEST_LOAD).reported().noted(note)
}

/// Whether the records of estimation have steps.
pub(super) fn in_estimation(steps: &Steps) -> bool {
    steps[0].iter().any(|steps| !steps.is_empty())
}

/// The most steps that lie close together: a push, a gust or a cut has a shape of its own, which several steps describe in part, and what is left
/// bends the model at low frequencies. `None` where steps lie apart, and where all lie within few samples: what is left of a shorter load is at the
/// frequencies of the excitation.
pub(crate) fn of_another_shape(steps: &Steps, ts: f64) -> Option<Evidence> {
    let crowded = |of: &Vec<Step>| {
        let mut samples: Vec<usize> = of.iter().map(|step| step.sample).collect();
        samples.sort_unstable();
        let near = |first: usize| samples.iter().filter(|t| (first..=first + CROWD).contains(t)).copied().collect();
        let long = |crowd: &Vec<usize>| crowd.first().zip(crowd.last()).is_some_and(|(a, b)| b - a >= SHORTEST);
        samples.iter().map(|first| near(*first)).filter(long).max_by_key(Vec::<usize>::len)
    };
    // What bends no model, those of the fresh records, does not count.
    let crowds = steps[0].iter().enumerate().filter_map(|(k, of)| Some((k, crowded(of)?)));
    let (record, crowd) = crowds.max_by_key(|(_, crowd)| crowd.len())?;
    let [first, last] = [crowd.first()?, crowd.last()?].map(|sample| *sample as f64 * ts);
    let at = format!("from {first:.4} s to {last:.4} s of record {}", record + 1);
    let note = format!("{at}; where they describe a push or a gust, leave these samples out");
    let question = "Steps of load within 600 samples, the most (shape of the load)";
    Some(Evidence::new(question, crowd.len() as f64, MOST_STEPS).noted(note))
}

/// Samples within which steps are counted, and over which they extend at least. Beside pushes those over 534 and 599 samples were of models wrong
/// and trusted, those over 120 and 186 of good ones; where the phase of cogging jumps there are four within 50.
const CROWD: usize = 600;
const SHORTEST: usize = 150;
/// Steps that are listed.
const LISTED: usize = 3;

#[cfg(test)]
#[path = "loads_tests.rs"]
mod tests;
