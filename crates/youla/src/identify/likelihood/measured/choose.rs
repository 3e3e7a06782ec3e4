//! Order, dead time and direct path by Schwarz's criterion: starts of all orders, then models one step away as long as it falls.

use super::data::{Column, MeasuredResponse};
use super::lines::{VarianceShape, WeighedLines, sizes, unknown, weighed};
use super::search::{Found, search, with_best_inputs};
use super::subspace::Subspace;
use crate::identify::likelihood::data::spectra::Sizes;
use crate::identify::likelihood::deviation::delayed;
use crate::identify::likelihood::search::chart::Chart;
use crate::identify::likelihood::search::model::Model;
use crate::identify::likelihood::{Candidate, LikelihoodOptions};
use crate::signal::output_rest;
use crate::{Error, Result};
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, c64};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// Dead times that are compared first, all inputs alike, samples.
const DEAD_TIMES: [usize; 10] = [0, 1, 2, 3, 4, 6, 8, 11, 15, 20];
/// Lines on which starts are compared; more of them change no order that the search would not find.
const SCANNED_LINES: usize = 300;
/// Orders that are scanned first; twice as many where the best is among the last third of them.
const SCANNED: usize = 12;
/// Orders from the subspace that are searched.
const FIRST: usize = 4;
/// Steps of a search, and of the last one.
const STEPS: [usize; 2] = [30, 100];
/// Rounds of models one step away.
const ROUNDS: usize = 16;
/// Differences of the criterion that do not decide for the larger order: odds of e^2 to one.
const INDISTINCT: f64 = 4.0;
/// Differences of the criterion up to which a model counts beside the best: weights of e^-6.
const BESIDE: f64 = 12.0;
/// Real numbers of the lines for each parameter of the largest model.
const NUMBERS_PER_PARAMETER: usize = 3;
/// Energy per number below which residuals are rounding.
const ROUNDING: f64 = 1e-20;

/// The lines with what is fixed about the model.
#[derive(Debug, Clone)]
pub(super) struct Problem<'a> {
    response: &'a MeasuredResponse,
    options: &'a LikelihoodOptions,
    sizes: Sizes,
    /// Response of the plant for the covariance of `Y - G U`, scaled.
    plant: Vec<Mat<c64>>,
    shape: VarianceShape,
    largest_order: usize,
    /// Dead times to begin with, where they are known.
    delays: Option<Vec<usize>>,
}

/// A model that was searched.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) model: Model,
    pub(super) delays: Vec<usize>,
    pub(super) feedthrough: bool,
    pub(super) energy: f64,
    pub(super) criterion: f64,
    steps: usize,
    origin: &'static str,
}

impl Fitted {
    /// The coordinates of its parameters.
    pub(super) fn chart(&self) -> Chart {
        Chart::new(&self.model, self.feedthrough)
    }
}

/// A search to be done.
pub(super) struct Task {
    pub(super) start: Model,
    pub(super) delays: Vec<usize>,
    pub(super) feedthrough: bool,
    pub(super) origin: &'static str,
}

impl<'a> Problem<'a> {
    /// Checks the options; the covariance of `Y - G U` is that for the quotient of neighbouring lines.
    pub(super) fn new(response: &'a MeasuredResponse, options: &'a LikelihoodOptions) -> Result<Self> {
        let (m, p) = (response.inputs, response.outputs);
        let given = options.dead_time.as_deref();
        if let Some(given) = given.filter(|given| given.len() != m) {
            return Err(Error::Ports { what: "the number of dead times".into(), expected: m, found: given.len() });
        }
        if options.order == Some(0) || options.largest_order == 0 {
            return Err(Error::OutOfRange { what: "the order".into(), value: 0.0, must: "at least one" });
        }
        let numbers: usize = response.lines.iter().map(|l| 2 * p * l.len()).sum();
        let needed = NUMBERS_PER_PARAMETER * (options.order.unwrap_or(1) * (m + p) + m * p);
        if numbers < needed {
            let per_line = (2 * p * response.lines.first().map_or(m, Vec::len)).max(1);
            let (found, needed) = (response.omega.len(), needed.div_ceil(per_line));
            return Err(Error::TooFewSamples { what: "the frequencies of the response".into(), found, needed });
        }
        let largest_order = options.largest_order.min(numbers / NUMBERS_PER_PARAMETER / (m + p)).max(1);
        let sizes = sizes(response);
        let plant = (0..response.omega.len()).map(|k| quotient(response, k, &sizes)).collect();
        let shape = VarianceShape { absolute: 0.01, relative: 1.0 };
        let delays = options.dead_time.clone();
        Ok(Problem { response, options, sizes, plant, shape, largest_order, delays })
    }

    /// Sizes of the channels.
    pub(super) fn sizes(&self) -> &Sizes {
        &self.sizes
    }

    /// What is fixed about the model.
    pub(super) fn options(&self) -> &LikelihoodOptions {
        self.options
    }

    /// Largest order that is tried.
    pub(super) fn largest_order(&self) -> usize {
        self.largest_order
    }

    /// The response that was measured.
    pub(super) fn response(&self) -> &MeasuredResponse {
        self.response
    }

    /// The same with the covariance at a first model, where it depends on the model.
    pub(super) fn refined(self) -> Self {
        if !self.response.depends_on_plant() {
            return self;
        }
        let Some((first, _)) = self.solve(&mut Vec::new()) else { return self };
        let of = |omega: &f64| {
            let g = delayed(&first.model, &first.delays, omega * self.response.time.ts() / TAU);
            Mat::from_fn(self.response.outputs, self.response.inputs, |i, j| g[i * self.response.inputs + j])
        };
        let plant = self.response.omega.iter().map(of).collect();
        let shape =
            if self.response.known() || self.response.proportional { self.shape } else { self.shape_of(&first) };
        Problem { plant, shape, delays: Some(first.delays), ..self }
    }

    /// Shares of the variance by least squares of the squared residuals, relative to what they are now; neither below zero.
    fn shape_of(&self, first: &Fitted) -> VarianceShape {
        let (mut normal, mut right) = ([0.0; 3], [0.0; 2]);
        let (m, p) = (self.response.inputs, self.response.outputs);
        for (line, measured) in self.weighed(first).lines.iter().zip(&self.response.lines) {
            let g = first.model.response(line.z);
            let of_plant = output_rest(Mat::from_fn(p, m, |i, j| g[i * m + j]).as_ref());
            for (column, measured) in line.columns.iter().zip(measured) {
                let [absolute, relative] = unknown(self.response, &self.sizes, measured, &of_plant);
                for (i, rest) in column.rest(&g, m).iter().enumerate() {
                    let (one, square) = (absolute[(i, i)].re, relative[(i, i)].re);
                    let now = self.shape.absolute * one + self.shape.relative * square;
                    let (one, square, found) = (one / now, square / now, rest.norm_sqr() / now);
                    normal = [normal[0] + one * one, normal[1] + one * square, normal[2] + square * square];
                    right = [right[0] + one * found, right[1] + square * found];
                }
            }
        }
        let [aa, ar, rr] = normal;
        let determinant = aa * rr - ar * ar;
        let both = [(rr * right[0] - ar * right[1]) / determinant, (aa * right[1] - ar * right[0]) / determinant];
        let [absolute, relative] = match both {
            [a, r] if a > 0.0 && r > 0.0 => both,
            [a, _] if a > 0.0 => [1.0, 0.0],
            _ => [0.0, 1.0],
        };
        let scale = absolute.max(relative).max(f64::MIN_POSITIVE);
        // a value near zero is not known better than a hundredth of the typical error
        VarianceShape { absolute: (absolute / scale).max(1e-4), relative: relative / scale }
    }

    /// The lines as a model is judged by them.
    pub(super) fn weighed(&self, of: &Fitted) -> WeighedLines {
        self.lines(&of.delays)
    }

    pub(super) fn lines(&self, delays: &[usize]) -> WeighedLines {
        weighed(self.response, &self.sizes, delays, &self.plant, self.shape)
    }

    /// The best model and those that the lines do not tell from it; what was tried is noted in the table.
    pub(super) fn solve(&self, table: &mut Vec<Candidate>) -> Option<(Fitted, Vec<Fitted>)> {
        let delays = self.delays.clone().unwrap_or_else(|| self.first_delays());
        let mut tried = self.run(self.starts(&delays), table);
        let mut at = self.improved(&mut tried, table)?;
        if self.options.feedthrough.is_none() {
            let other = Task { feedthrough: !at.feedthrough, ..Task::same(&at, "direct path") };
            tried.extend(self.run(vec![other], table));
            if best(&tried)?.criterion < at.criterion {
                at = self.improved(&mut tried, table)?;
            }
        }
        // of many orders that were tried, one beats a smaller one by this much through chance alone
        let enough = |c: &&Fitted| c.criterion <= at.criterion + INDISTINCT;
        let simplest = tried
            .iter()
            .filter(enough)
            .min_by(|a, b| a.model.order().cmp(&b.model.order()).then(a.criterion.total_cmp(&b.criterion)));
        let at = simplest.cloned().unwrap_or(at);
        let last = Task::same(&at, at.origin);
        let chosen = self.searched(last, STEPS[1]).filter(|c| c.criterion <= at.criterion).unwrap_or(at);
        let rivals = tried.into_iter().filter(|c| c.criterion <= chosen.criterion + BESIDE).collect();
        Some((chosen, rivals))
    }

    fn improved(&self, tried: &mut Vec<Fitted>, table: &mut Vec<Candidate>) -> Option<Fitted> {
        let mut at = best(tried)?.clone();
        for _ in 0..ROUNDS {
            tried.extend(self.run(self.neighbours(&at), table));
            let before = std::mem::replace(&mut at, best(tried)?.clone());
            if at.criterion >= before.criterion - 0.5 {
                break;
            }
        }
        Some(at)
    }

    /// The dead times from whose starts the criterion is least.
    fn first_delays(&self) -> Vec<usize> {
        let m = self.response.inputs;
        let least = |delay: &usize| {
            let delays = vec![*delay; m];
            let starts = self.scanned(&self.lines(&delays).thinned(SCANNED_LINES));
            starts.iter().map(|(criterion, _)| *criterion).fold(f64::INFINITY, f64::min)
        };
        let found: Vec<f64> = DEAD_TIMES.par_iter().map(least).collect();
        let at = (0..found.len()).min_by(|a, b| found[*a].total_cmp(&found[*b])).unwrap_or(0);
        vec![DEAD_TIMES[at]; m]
    }

    fn feedthrough(&self) -> bool {
        self.options.feedthrough.unwrap_or(false)
    }

    /// Models of all orders from the subspace with their criteria, B by least squares.
    fn scanned(&self, lines: &WeighedLines) -> Vec<(f64, Model)> {
        if let Some(order) = self.options.order {
            return self.of_orders(lines, order, order..order + 1);
        }
        let mut limit = SCANNED.min(self.largest_order);
        loop {
            let found = self.of_orders(lines, limit, 1..limit + 1);
            let least = found.iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, model)| model.order());
            if limit == self.largest_order || 3 * least < 2 * limit {
                return found;
            }
            limit = (2 * limit).min(self.largest_order);
        }
    }

    fn of_orders(&self, lines: &WeighedLines, largest: usize, orders: Range<usize>) -> Vec<(f64, Model)> {
        let Some(subspace) = Subspace::new(lines, largest) else { return Vec::new() };
        let of = |order: usize| {
            let model = with_best_inputs(lines, &subspace.model(order)?, self.feedthrough())?;
            let energy = lines.energy(&model);
            energy.is_finite().then(|| (self.criterion(energy, &model, self.feedthrough(), lines.rows()), model))
        };
        let orders: Vec<usize> = orders.filter(|order| *order <= subspace.orders()).collect();
        orders.into_par_iter().filter_map(of).collect()
    }

    fn starts(&self, delays: &[usize]) -> Vec<Task> {
        let mut found = self.scanned(&self.lines(delays).thinned(SCANNED_LINES));
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(FIRST);
        let task =
            |(_, start)| Task { start, delays: delays.to_vec(), feedthrough: self.feedthrough(), origin: "subspace" };
        found.into_iter().map(task).collect()
    }

    pub(super) fn criterion(&self, energy: f64, model: &Model, feedthrough: bool, rows: usize) -> f64 {
        let (n, m, p) = (rows.max(2) as f64, model.inputs, model.outputs);
        let parameters = model.order() * (m + p) + if feedthrough { m * p } else { 0 };
        let deviance = if self.response.known() { energy } else { n * (energy / n).max(ROUNDING).ln() };
        deviance + parameters as f64 * n.ln()
    }

    fn run(&self, tasks: Vec<Task>, table: &mut Vec<Candidate>) -> Vec<Fitted> {
        let found: Vec<Option<Fitted>> = tasks.into_par_iter().map(|task| self.searched(task, STEPS[0])).collect();
        let found: Vec<Fitted> = found.into_iter().flatten().collect();
        let lines = self.response.omega.len();
        table.extend(found.iter().map(|fitted| fitted.noted(lines)));
        found
    }

    fn searched(&self, task: Task, steps: usize) -> Option<Fitted> {
        let lines = self.lines(&task.delays);
        let Found { model, energy, steps } = search(&lines, &task.start, task.feedthrough, steps)?;
        let criterion = self.criterion(energy, &model, task.feedthrough, lines.rows());
        let Task { delays, feedthrough, origin, .. } = task;
        Some(Fitted { model, delays, feedthrough, energy, criterion, steps, origin })
    }
}

impl Task {
    pub(super) fn same(at: &Fitted, origin: &'static str) -> Self {
        Task { start: at.model.clone(), delays: at.delays.clone(), feedthrough: at.feedthrough, origin }
    }
}

impl Fitted {
    fn noted(&self, lines: usize) -> Candidate {
        Candidate {
            origin: self.origin.into(),
            dead_time: self.delays.clone(),
            order: self.model.order(),
            deviance: self.energy,
            criterion: self.criterion,
            samples: lines,
            steps: self.steps,
            stabilised: true,
        }
    }
}

fn best(tried: &[Fitted]) -> Option<&Fitted> {
    tried.iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion))
}

/// `Y U^H (U U^H)^-1` over as few neighbouring lines as excite all inputs, scaled; zero where none do.
fn quotient(response: &MeasuredResponse, k: usize, sizes: &Sizes) -> Mat<c64> {
    let (m, p) = (response.inputs, response.outputs);
    for half in 0..=3 * m {
        let near = &response.lines[k.saturating_sub(half)..(k + half + 1).min(response.lines.len())];
        let (mut square, mut cross) = (Mat::<c64>::zeros(m, m), Mat::<c64>::zeros(p, m));
        for Column { u, y, .. } in near.iter().flatten() {
            let u = |j: usize| u[j] / sizes.u[j];
            square += Mat::from_fn(m, m, |i, j| u(i) * u(j).conj());
            cross += Mat::from_fn(p, m, |i, j| y[i] / sizes.y[i] * u(j).conj());
        }
        match square.singular_values() {
            Ok(s) if s[m - 1] > 1e-6 * s[0] => return cross * square.partial_piv_lu().inverse(),
            _ => {}
        }
    }
    Mat::zeros(p, m)
}
