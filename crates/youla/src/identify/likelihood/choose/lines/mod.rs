//! Modes that are lines of a disturbance.
//!
//! A mode narrower than a line of the transform is what a disturbance at one frequency leaves, or a pole on the unit circle. A disturbance
//! acts on the outputs alone, `y = G u + cos, sin + v`: its amplitudes are those of the residual without the mode. What is left of the
//! outputs, without the lines next to it (weight zero), says whether it was one: then the criterion is less without the mode.

mod fit;
mod shown;

use super::loads::{self, Nuisance, Steps};
use super::problem::{Choice, Problem, Solution};
use super::unmoved::Motion;
use crate::identify::likelihood::data::spectra::{Mask, Spectra, long_enough};
use crate::identify::likelihood::search::driven::NARROW;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::search::point::Point;
use crate::identify::likelihood::search::{search, with_best_ends, with_best_inputs};
use crate::identify::likelihood::{Candidate, Evidence, LoopSignals};
use crate::identify::subspace::Experiment;
use crate::identify::verdict::limits::LARGEST_LINE;
use crate::linalg::TINY;
use faer::Mat;
use fit::{Line, Residual, WIDEST, disturbance, sharpened, with_sidebands};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Rounds of modes that are left out.
const ROUNDS: usize = 5;
/// Slow changes of a disturbance, `cos(pi j t / N)` with `j` below the first number, and lines on each side that do not count: the first of
/// these that are enough. A rotor whose speed wanders has sidebands.
const SHAPES: [(usize, f64); 5] = [(1, 5.0), (9, 5.0), (9, 10.0), (9, 20.0), (9, 40.0)];
/// Lowest frequency of such a mode, in lines: below it a drift of the record is one.
const LOWEST: f64 = 8.0;
/// Half width of a mode that may stand for sidebands, in lines of the longest record.
const SIDEBAND: f64 = 0.6;
/// Ratio of two frequencies that are listed as one, and frequencies that are listed.
const SAME: f64 = 1.05;
const LISTED: usize = 6;

/// A model and the inputs and outputs that it is the model of.
#[derive(Clone)]
pub(crate) struct Cleaned {
    /// The model.
    pub(crate) solution: Solution,
    /// What was taken out of the outputs.
    pub(crate) lines: Vec<Line>,
    /// The outputs without it, of the estimation and of the fresh records; `None` where there is nothing.
    pub(crate) outputs: Option<[Vec<Mat<f64>>; 2]>,
    /// Steps of load.
    pub(crate) steps: Option<Steps>,
    /// The inputs with them; `None` where there are none.
    pub(crate) inputs: Option<[Vec<Mat<f64>>; 2]>,
}

impl Cleaned {
    /// A model of the records as they are.
    pub(crate) fn untouched(solution: Solution) -> Self {
        Cleaned { solution, lines: Vec::new(), outputs: None, steps: None, inputs: None }
    }

    /// The problem that its model solves, on records with its outputs.
    pub(crate) fn problem<'a>(&self, all: &Problem<'a>, experiments: &'a [Experiment<'a>]) -> Problem<'a> {
        let masked = self.lines.iter().map(|line| line.mask).collect();
        Problem { experiments, masked, feedthrough: self.solution.chosen.found.feedthrough, ..all.clone() }
    }

    /// Records, those of estimation (0) or fresh (1), with its inputs and outputs.
    pub(crate) fn records<'a>(&'a self, which: usize, records: &[Experiment<'a>]) -> Vec<Experiment<'a>> {
        let pick = |own: &'a Option<[Vec<Mat<f64>>; 2]>, k: usize| own.as_ref().map(|own| own[which][k].as_ref());
        let of = |(k, e): (usize, &Experiment<'a>)| Experiment {
            u: pick(&self.inputs, k).unwrap_or(e.u),
            y: pick(&self.outputs, k).unwrap_or(e.y),
            ..*e
        };
        records.iter().enumerate().map(of).collect()
    }

    /// The columns of what was estimated beside the model of the records of estimation.
    pub(crate) fn nuisance(&self, problem: &Problem<'_>, choice: &Choice, spectra: &Spectra) -> Nuisance {
        let of = |steps: &Steps| loads::nuisance(problem, choice, &steps[0], spectra);
        self.steps.as_ref().filter(|steps| loads::in_estimation(steps)).map(of).unwrap_or_default()
    }

    /// What was taken out of the records.
    pub(crate) fn evidence(&self, all: &Problem<'_>, fresh: &[Experiment<'_>], ts: f64) -> Vec<Evidence> {
        let records = [all.experiments, fresh];
        let load = self.steps.as_ref().map(|steps| loads::evidence(steps, records, &all.sizes.u, ts));
        let shape = self.steps.as_ref().and_then(|steps| loads::of_another_shape(steps, ts));
        self.of_lines(all.experiments, ts).into_iter().chain(load).chain(shape).collect()
    }

    /// The lines that were taken out, and their size over that of what is left of the outputs; `None` where there are none.
    fn of_lines(&self, records: &[Experiment<'_>], ts: f64) -> Option<Evidence> {
        let [outputs, _] = self.outputs.as_ref()?;
        let (mut taken, mut left) = (0.0, 0.0);
        for (e, y) in records.iter().zip(outputs) {
            taken += (e.y - y).squared_norm_l2();
            left += y.squared_norm_l2();
        }
        let mut hz: Vec<f64> = self.lines.iter().map(|line| line.mask.middle / ts).collect();
        hz.sort_by(f64::total_cmp);
        hz.dedup_by(|b, a| *b < *a * SAME);
        let listed: Vec<String> = hz.iter().take(LISTED).map(|hz| format!("{hz:.4}")).collect();
        let more = hz.len().saturating_sub(LISTED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let question = "Size of disturbances at single frequencies over that of the outputs without them (lines)";
        let note = format!("taken out of the outputs at {} Hz{more}", listed.join(", "));
        Some(Evidence::new(question, (taken / left.max(TINY)).sqrt(), LARGEST_LINE).reported().noted(note))
    }
}

/// The model that records support, and what it takes out of them; of the records of estimation the signals of their loops are `known`.
pub(crate) fn solve(
    all: &Problem<'_>,
    fresh: &[Experiment<'_>],
    known: &[LoopSignals<'_>],
    table: &mut Vec<Candidate>,
) -> Option<Cleaned> {
    let found = without_lines(all, fresh, known, table).or_else(|| loads::solve(all, fresh, table))?;
    let mut now = loads::with_steps(all, fresh, found, table);
    for _ in 0..ROUNDS {
        let Some(next) = less_lines(all, fresh, &now, table) else { break };
        now = next;
    }
    Some(loads::in_fresh(all, fresh, now))
}

/// The model without the disturbances that records and loop show; `None` where they are not looked for: without feedback they have no share in the inputs, and
/// of many channels a walk takes too long for lines that are modes of a short record of a structure.
fn without_lines(
    all: &Problem<'_>,
    fresh: &[Experiment<'_>],
    known: &[LoopSignals<'_>],
    table: &mut Vec<Candidate>,
) -> Option<Cleaned> {
    if !loads::are_sought(all) {
        return None;
    }
    let lines = shown::shown(all.experiments, known);
    let first = shown::without(all, fresh, &lines, table).or_else(|| loads::solve(all, fresh, table))?;
    let more = [lines.as_slice(), &shown::of_loop(all, &first)].concat();
    let less = (more.len() > lines.len()).then(|| shown::without(all, fresh, &more, table)).flatten();
    Some(less.unwrap_or(first))
}

/// `None` where no mode is narrower than a line, and where the outputs speak for it without its line.
fn less_lines(
    all: &Problem<'_>,
    fresh: &[Experiment<'_>],
    now: &Cleaned,
    table: &mut Vec<Candidate>,
) -> Option<Cleaned> {
    let clean = now.records(0, all.experiments);
    let narrow = Narrow::of(&now.problem(all, &clean), now)?;
    let choice = &now.solution.chosen;
    let delays = &choice.delays;
    let residuals = [(0, all.experiments), (1, fresh)].map(|(k, records)| {
        let clean = now.records(k, records);
        narrow.residuals(&now.problem(all, &clean), choice, records)
    });
    let turns: Vec<f64> = narrow.turns.iter().map(|turns| sharpened(&residuals[0], *turns, narrow.longest)).collect();
    let lowest = turns.iter().copied().fold(f64::INFINITY, f64::min);
    for (changes, lines) in SHAPES {
        if lines / narrow.longest > WIDEST * lowest {
            break;
        }
        let mut taken = now.lines.clone();
        turns.iter().for_each(|middle| beside(&mut taken, *middle, (changes, lines / narrow.longest)));
        let outputs = Some([(all.experiments, &residuals[0]), (fresh, &residuals[1])].map(|of| subtracted(of, &taken)));
        let mut next = Cleaned { lines: taken, outputs, ..now.clone() };
        let records = next.records(0, all.experiments);
        let problem = next.problem(all, &records);
        let spectra = Arc::new(problem.spectra(delays));
        let noise = &choice.found.noise;
        // A search would move the modes in question to whatever else is there.
        let still = problem.options(0, f64::INFINITY, delays);
        let start = with_best_inputs(&spectra, narrow.model.clone(), noise, problem.feedthrough);
        let whole = search(&spectra, start, None, &still)?.criterion(spectra.samples());
        let task = problem.beside(noise, narrow.model.without(&narrow.places), &spectra, "without a line");
        let less = problem.run(vec![task], f64::INFINITY, table);
        if less.first()?.criterion < whole {
            let lines = with_sidebands(&next.lines, &problem, less.first()?);
            if lines.iter().any(|line| line.mask.skirt > 0.0) {
                let problem = Problem { masked: lines.iter().map(|line| line.mask).collect(), ..problem };
                let spectra = Arc::new(problem.spectra(delays));
                let model = less.first()?.found.point.model.clone();
                let task = problem.beside(noise, model, &spectra, "with the sidebands of a line");
                let weighed = problem.run(vec![task], f64::INFINITY, table);
                let solution = problem.solve_from(weighed, table)?;
                (next.solution, next.lines) = (solution, lines);
                return Some(next);
            }
            next.solution = problem.solve_from(less, table)?;
            return Some(next);
        }
    }
    None
}

/// Adds a disturbance, or widens one whose sidebands the mode stands for.
fn beside(lines: &mut Vec<Line>, middle: f64, (changes, half): (usize, f64)) {
    match lines.iter_mut().find(|line| line.near(middle)) {
        Some(line) => {
            let apart = (line.mask.middle - middle).abs();
            line.mask.half = (apart + half).max(2.0 * line.mask.half);
            line.changes = line.changes.max(changes);
        }
        None => lines.push(Line { mask: Mask { middle, half, skirt: 0.0 }, changes }),
    }
}

/// The modes of a solution that are narrower than a line.
struct Narrow {
    /// The model with a block for each mode.
    model: Model,
    /// The blocks.
    places: Vec<usize>,
    /// Their frequencies, shares of the sample rate.
    turns: Vec<f64>,
    /// Samples of the longest record.
    longest: f64,
}

impl Narrow {
    fn of(problem: &Problem<'_>, now: &Cleaned) -> Option<Self> {
        let choice = &now.solution.chosen;
        let model = choice.found.point.model.separated()?;
        let longest = problem.experiments.iter().map(|e| e.u.nrows()).max()? as f64;
        let mut first = 0;
        let mut found: Vec<(usize, f64, usize)> = Vec::new();
        for (k, block) in model.blocks.iter().enumerate() {
            let pole = block.poles().into_iter().find(|pole| pole.im > 0.0);
            let (width, turns) = pole.map_or((f64::MAX, 0.0), |z| (z.norm().ln().abs() / TAU, z.arg() / TAU));
            let sideband = now.lines.iter().any(|line| line.near(turns)) && width * longest < SIDEBAND;
            if (width * longest < NARROW || sideband) && turns * longest > LOWEST && block.states == 2 {
                found.push((k, turns, first));
            }
            first += block.states;
        }
        if found.is_empty() || problem.order.is_some() {
            return None;
        }
        let spectra = problem.spectra(&choice.delays);
        let point = with_best_ends(&spectra, model.clone(), &choice.found.noise);
        let known = (&spectra, &choice.found.noise);
        found.retain(|(k, turns, first)| Motion::of((&model.blocks[*k], *first), *turns, known, &point).is_unmoved());
        let (places, turns): (Vec<usize>, Vec<f64>) = found.into_iter().map(|(k, turns, _)| (k, turns)).unzip();
        (!places.is_empty()).then_some(Narrow { model, places, turns, longest })
    }

    /// What the other modes leave of the outputs of some records, behind the first samples that are skipped; `None` for a record that has no
    /// lines. The ends of the records are those of the outputs as they are without earlier lines (`clean`).
    fn residuals(&self, clean: &Problem<'_>, choice: &Choice, records: &[Experiment<'_>]) -> Vec<Option<Residual>> {
        let whole = with_best_ends(&clean.spectra(&choice.delays), self.model.clone(), &choice.found.noise);
        let mut first = 0;
        let mut left_out = Vec::new();
        for (k, block) in self.model.blocks.iter().enumerate() {
            if self.places.contains(&k) {
                left_out.extend(first..first + block.states);
            }
            first += block.states;
        }
        let kept = |t: &Vec<f64>| (0..t.len()).filter(|i| !left_out.contains(i)).map(|i| t[i]).collect();
        let point = Point { model: self.model.without(&self.places), ends: whole.ends.iter().map(kept).collect() };
        residuals(&point, clean, choice, records)
    }
}

/// The outputs of some records without disturbances, from what a model leaves of each.
fn subtracted((records, left): (&[Experiment<'_>], &Vec<Option<Residual>>), taken: &[Line]) -> Vec<Mat<f64>> {
    let of = |(e, left): (&Experiment<'_>, &Option<Residual>)| match left {
        Some(left) => e.y - disturbance(left, e.y.nrows(), taken),
        None => e.y.to_owned(),
    };
    records.iter().zip(left).map(of).collect()
}

/// What a model leaves of the outputs of some records, behind the first samples that are skipped, with the lines that do not count; `None` for a
/// record that has no lines.
fn residuals(
    point: &Point,
    problem: &Problem<'_>,
    choice: &Choice,
    records: &[Experiment<'_>],
) -> Vec<Option<Residual>> {
    let bare = Problem { masked: Vec::new(), ..problem.clone() };
    let mut residuals = point.residuals(&bare.spectra_of(records, &choice.delays)).into_iter();
    let of = |e: &Experiment<'_>| {
        let rows = e.y.nrows();
        let v = long_enough(rows, problem.skip).then(|| residuals.next()).flatten()?;
        let (samples, p) = (rows - problem.skip, problem.sizes.y.len());
        // The spectra are those of outputs over their sizes, over the root of the samples.
        let scale = |i: usize| problem.sizes.y[i] * (samples as f64).sqrt();
        Some(Residual { lines: Mat::from_fn(v.len() / p, p, |k, i| v[k * p + i] * scale(i)), samples })
    };
    records.iter().map(of).collect()
}
