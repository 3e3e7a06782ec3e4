//! Maximum likelihood from a start: Levenberg-Marquardt on the lines, the noise estimated anew after each step.
//!
//! ```text
//! -2 log likelihood = N log det Lambda + 2 N log |det A_u|,     Lambda = covariance of the whitened residuals
//! ```
//! A_u holds the poles outside the unit circle ([`unstable`]): poles may cross the circle, and neither a stable predictor nor a Kalman
//! gain is needed to search.

pub(crate) mod autoregression;
pub(crate) mod balancing;
mod begin;
pub(crate) mod block;
pub(crate) mod by_output;
pub(crate) mod chart;
mod cost;
pub(crate) mod driven;
pub(crate) mod driven_slope;
pub(crate) mod feedthrough;
pub(crate) mod free_gain;
pub(crate) mod grouping;
pub(crate) mod groups;
pub(crate) mod linearise;
pub(crate) mod model;
pub(crate) mod noise;
pub(crate) mod point;
pub(crate) mod residual;
pub(crate) mod rows;
pub(crate) mod separable;
pub(crate) mod state_lanes;
pub(crate) mod unstable;

use crate::identify::likelihood::data::spectra::Spectra;
use crate::linalg::{Damping, LEAST_DAMPING, damped_step, decrease};
use begin::begun;
use by_output::{Ends, Normal};
use chart::Chart;
pub(crate) use cost::deviance;
use cost::{cost, cost_beside, cost_near, least_cost, lesser, value_of};
use driven::has_line;
use faer::Mat;
use feedthrough::Answer;
use groups::grouped;
use linearise::{Filter, Linearised, linearise_quickly};
use model::Model;
use noise::Noise;
use point::{Point, reblocked};
use separable::separable;

/// Choices of a search.
#[derive(Debug, Clone)]
pub(crate) struct SearchOptions {
    /// Whether D moves.
    pub(crate) feedthrough: bool,
    /// Largest order of the autoregression of the noise.
    pub(crate) noise_order: usize,
    /// Largest number of steps.
    pub(crate) steps: usize,
    /// Ends where a step is expected to lower -2 log likelihood by less.
    pub(crate) tolerance: f64,
    /// Criterion to be undercut: a search that its steps will not bring there is given up.
    pub(crate) aim: f64,
    /// What the controller answers in the same sample.
    pub(crate) direct: Answer,
    /// Largest magnitude of a pole.
    pub(crate) radius: f64,
    /// Whether steps count what the plant of one output does to the spectrum of noise at its inputs.
    pub(crate) filter_moves: bool,
}

/// Damping of the first step, relative to the squared lengths of the columns of the Jacobian: starts from long regressions lie near enough
/// to a minimum for steps of Gauss and Newton.
pub(crate) const FIRST_DAMPING: f64 = 1e-6;
/// Part of the column of a drift beside those of the states, relative to its length, below which the drift is not determined. Chosen: an
/// integrator of the plant leaves less, an output that drifts by itself all of it.
const LEAST_DRIFT: f64 = 1e-3;
/// A search is given up where its distance to the aim is this many times what its first step gained, or a later one. Chosen: gains fall from step
/// to step; of 1100 searches of nine records none that was given up would have reached its aim.
const STEPS_TO_AIM: [f64; 2] = [40.0, 20.0];
/// Damping ratio of the modes that the groups of a search leave room for beside those of its start.
pub(crate) const DAMPED: f64 = 0.4;
/// Decrease that a search with the filter of the noise held promises without any step that lowers the deviance, from which the filter moves.
/// Chosen: odds of e^4 to one.
const MISLED: f64 = 8.0;
/// Steps on groups from which they are made anew: a start that moves less is near enough to them.
const REGROUPED: usize = 2;
/// Share of the gain that groups promise which all lines must show, and of that of a step which is enough to keep the noise that it brings. Chosen:
/// within it the slopes are those of what is judged.
const KEPT: f64 = 0.5;
/// Steps that are left for all lines behind those on groups, at least: most searches take none or one there.
const LAST: usize = 5;
/// Diagonal of the factor, relative to the largest, below which the records do not determine a direction: rounding of a sum of squares.
const UNDETERMINED: f64 = 1e-10;

/// Where a search ended.
#[derive(Clone)]
pub(crate) struct Found {
    /// Model and ends of the records.
    pub(crate) point: Point,
    /// Noise.
    pub(crate) noise: Noise,
    /// -2 log likelihood.
    pub(crate) deviance: f64,
    /// Number of parameters of the model.
    pub(crate) parameters: usize,
    /// Steps taken.
    pub(crate) steps: usize,
    /// Whether it would not have reached the aim.
    pub(crate) given_up: bool,
    /// Whether D moved.
    pub(crate) feedthrough: bool,
}

impl Found {
    /// -2 log likelihood plus log N per parameter of model and noise (Schwarz), and a share for the ends of further records.
    pub(crate) fn criterion(&self, samples: usize) -> f64 {
        self.deviance + penalty(self.parameters + self.noise.parameters(), samples, &self.point)
    }
}

/// log N for each parameter, and log of the samples of a record for each state at the ends of each further record: a mode without damping
/// takes whatever each of many short records has at its frequency.
fn penalty(parameters: usize, samples: usize, point: &Point) -> f64 {
    let (samples, records) = (samples.max(2) as f64, point.ends.len().max(1) as f64);
    let of_ends = (records - 1.0) * point.model.order() as f64 * (samples / records).max(1.0).ln();
    samples.ln() * parameters as f64 + of_ends
}

/// B, D and the ends of the records by least squares, A and C kept.
pub(crate) fn with_best_inputs(spectra: &Spectra, model: Model, noise: &Noise, feedthrough: bool) -> Point {
    let chart = Chart::inputs_only(&model, feedthrough);
    let point = Point::at_rest(model, spectra.records.len());
    Slopes::new(spectra, &point, (&chart, noise), Vec::new(), Filter::Held).trial(&point, LEAST_DAMPING).0
}

/// The ends of the records by least squares, the model kept.
pub(crate) fn with_best_ends(spectra: &Spectra, model: Model, noise: &Noise) -> Point {
    let chart = Chart::fixed(&model);
    let point = Point::at_rest(model, spectra.records.len());
    Slopes::new(spectra, &point, (&chart, noise), Vec::new(), Filter::Held).trial(&point, 0.0).0
}

/// Searches from a start and the noise that is known near it, on many lines first on groups of them; `None` where nothing finite comes of it.
pub(crate) fn search(spectra: &Spectra, start: Point, known: Option<&Noise>, options: &SearchOptions) -> Option<Found> {
    let Some(near) = on_groups(spectra, &start, known, options) else {
        return on_lines(spectra, start, known, options);
    };
    let left = if near.given_up { 0 } else { (options.steps - near.steps).max(LAST) };
    let last = SearchOptions { steps: left, ..options.clone() };
    let found = on_lines(spectra, near.point, Some(&near.noise), &last)?;
    Some(Found { steps: near.steps + found.steps, given_up: near.given_up || found.given_up, ..found })
}

/// The same on groups of lines alone, which are made anew while the search moves, with deviance and noise of all lines; `None` also where there
/// are no groups, and where all lines do not gain what groups promise: beside large and slow motion a small change of the model leaves more than
/// the noise.
pub(crate) fn on_groups(
    spectra: &Spectra,
    start: &Point,
    known: Option<&Noise>,
    options: &SearchOptions,
) -> Option<Found> {
    let (mut reached, mut steps): (Option<Found>, usize) = (None, 0);
    let mut before = f64::INFINITY;
    while steps < options.steps {
        let (point, known) = reached.as_ref().map_or((start, known), |found| (&found.point, Some(&found.noise)));
        let Some(groups) = grouped(spectra, point, DAMPED) else { break };
        if before.is_infinite() {
            before = cost_beside(spectra, point, known, options).0;
        }
        let options = SearchOptions { steps: options.steps - steps, ..options.clone() };
        let promised = cost_beside(&groups, point, known, &options).0;
        let found = on_lines(&groups, point.clone(), known, &options)?;
        let (after, noise) = cost_beside(spectra, &found.point, Some(&found.noise), &options);
        if (before - after).is_nan() || before - after < KEPT * (promised - found.deviance) - options.tolerance {
            break;
        }
        before = after;
        let (moved, given_up) = (found.steps, found.given_up);
        steps += moved;
        reached = Some(Found { steps, deviance: after, noise, ..found });
        if moved < REGROUPED || given_up {
            break;
        }
    }
    reached
}

/// The same on lines as they are.
fn on_lines(spectra: &Spectra, start: Point, known: Option<&Noise>, options: &SearchOptions) -> Option<Found> {
    let (mut point, mut least, mut noise) = begun(spectra, &start, known, options)?;
    let (mut damping, mut steps, mut given_up) = (Damping::new(FIRST_DAMPING), 0, false);
    let mut parameters = Chart::new(&point.model, options.feedthrough).parameters();
    let mut misled = false;
    while steps < options.steps {
        let chart = Chart::new(&point.model, options.feedthrough);
        parameters = chart.parameters();
        // With the filter of such noise held the slopes promise what no step keeps: of 60 searches near the model of a flexible drive 45 nats each.
        let may_move = noise.enters_at_inputs() && !has_line(&point.model, spectra);
        let moves = may_move && (misled || options.filter_moves || (noise.joint.is_some() && spectra.outputs > 1));
        let slope = slope(spectra, &point, (&chart, &noise), (options, moves));
        let filter = if moves { Filter::Free } else { Filter::Held };
        let slopes = Slopes::new(spectra, &point, (&chart, &noise), slope, filter);
        let mut first_promise = None;
        let step = |damping| {
            let (trial, of_noise, promised) = slopes.trial(&point, damping);
            first_promise.get_or_insert(promised);
            ((trial, of_noise, promised), promised)
        };
        let lower = damping.descend_sparingly(options.tolerance, step, |(trial, of_noise, promised)| {
            let inside = || trial.model.poles().iter().all(|p| p.norm() <= options.radius);
            let moved = noise.entry().map(|entry| entry.moved(&of_noise));
            let (value, noise) = if moves {
                least_cost(spectra, &trial, (moved, least - KEPT * promised), options)
            } else {
                // The step of the sizes is not known.
                let found = cost(spectra, &trial, options);
                if found.0 < least { found } else { lesser(cost_near(spectra, &trial, moved, options), found) }
            };
            let usable = value.is_finite() && (options.radius.is_infinite() || inside());
            usable.then_some(((trial, value, noise), least - value))
        });
        let mut gain = 0.0;
        if let Some((trial, value, lower_noise)) = lower {
            steps += 1;
            gain = least - value;
            (point, least, noise) = (reblocked(&trial)?, value, lower_noise);
        }
        if gain < options.tolerance {
            misled =
                may_move && !moves && noise.joint.is_some() && first_promise.is_some_and(|promise| promise > MISLED);
            if !misled {
                break;
            }
            damping = Damping::new(FIRST_DAMPING);
            continue;
        }
        let penalty = penalty(parameters + noise.parameters(), spectra.samples(), &point);
        given_up = least + penalty - options.aim > STEPS_TO_AIM[steps.min(2) - 1] * gain;
        if given_up {
            break;
        }
    }
    // The gain of noise at the inputs belongs to the coordinates of its model, which are others after `reblocked`.
    if steps > 0 && noise.enters_at_inputs() {
        (least, noise) = cost_beside(spectra, &point, Some(&noise), options);
    }
    Some(Found { point, noise, deviance: least, parameters, steps, given_up, feedthrough: options.feedthrough })
}

/// What a search near a point needs: a triangular factor, or normal equations by outputs.
enum Slopes<'a> {
    Dense(&'a Chart, Linearised),
    ByOutput(&'a Chart, Normal),
}

impl<'a> Slopes<'a> {
    /// With the slope of what is no square.
    fn new(
        spectra: &Spectra,
        point: &Point,
        (chart, noise): (&'a Chart, &Noise),
        slope: Vec<f64>,
        filter: Filter,
    ) -> Self {
        if separable(spectra.outputs) {
            let normal = Normal::new(spectra, point, chart, noise, Ends::Shared);
            return Slopes::ByOutput(chart, if slope.is_empty() { normal } else { normal.with_slope(slope) });
        }
        let Linearised { factor, ends } = linearise_quickly(spectra, point, (chart, noise), filter);
        Slopes::Dense(chart, Linearised { factor: with_slope(factor, &slope), ends })
    }

    /// The point after a damped step, the step of what is free of the noise, and the decrease of the deviance that they promise.
    fn trial(&self, point: &Point, damping: f64) -> (Point, Vec<f64>, f64) {
        match self {
            Slopes::Dense(chart, Linearised { factor, ends }) => {
                let count = factor.ncols() - 1;
                let (step, promised) = if count == 0 { (Vec::new(), 0.0) } else { damped(factor, count, damping) };
                (moved(point, chart, ends, &step), step[chart.parameters()..].to_vec(), promised)
            }
            Slopes::ByOutput(chart, normal) => {
                let (step, changes, promised) = normal.step(damping);
                let mut ends = point.ends.clone();
                let all = ends.iter_mut().flatten().zip(changes.iter().flatten());
                all.for_each(|(end, change)| *end += change);
                (Point { model: chart.moved(&point.model, &step), ends }, Vec::new(), promised)
            }
        }
    }
}

/// The point moved by a step of the parameters, t by what is best with it, by the rows of each record that determine t.
fn moved(point: &Point, chart: &Chart, determined: &[Mat<f64>], step: &[f64]) -> Point {
    let (states, n) = (point.model.order(), point.model.end_count());
    let mut ends = point.ends.clone();
    for (end, rows) in ends.iter_mut().zip(determined) {
        let last = rows.ncols() - 1;
        let mut change = vec![0.0; n];
        for i in (0..n.min(rows.nrows())).rev() {
            let mut value = rows[(i, last)];
            step.iter().enumerate().for_each(|(j, s)| value -= rows[(i, n + j)] * s);
            (i + 1..n).for_each(|j| value -= rows[(i, j)] * change[j]);
            let diagonal = rows[(i, i)];
            // An integrator of the plant describes the drift of its output as well.
            let least = if i < states { 1e-12 } else { LEAST_DRIFT * rows.col(i).norm_l2() };
            change[i] = if diagonal.abs() > least { value / diagonal } else { 0.0 };
        }
        end.iter_mut().zip(change).for_each(|(e, c)| *e += c);
    }
    Point { model: chart.moved(&point.model, step), ends }
}

/// The damped step of the leading parameters of a factor `[J r]` and the decrease of the sum of squares that it promises; none where the rows
/// are fewer than the parameters.
pub(crate) fn damped(factor: &Mat<f64>, parameters: usize, damping: f64) -> (Vec<f64>, f64) {
    if factor.nrows() < parameters {
        return (vec![0.0; parameters], 0.0);
    }
    let jacobian = factor.submatrix(0, 0, parameters, parameters);
    let residual = factor.submatrix(0, parameters, parameters, 1);
    let lengths: Vec<f64> = jacobian.col_iter().map(|column| column.norm_l2()).collect();
    let step = damped_step(jacobian, residual, &lengths, damping);
    (step.col(0).iter().copied().collect(), decrease(jacobian, residual, &step))
}

/// Slopes of the terms of half the deviance that are no squares.
fn slope(
    spectra: &Spectra,
    point: &Point,
    (chart, noise): (&Chart, &Noise),
    (options, moves): (&SearchOptions, bool),
) -> Vec<f64> {
    let outside = || unstable::slope(unstable::outside, spectra, &point.model, chart);
    let mut out = match (moves, separable(spectra.outputs)) {
        (false, _) => outside(),
        // Rows whose filter moves have them.
        (true, false) => vec![0.0; chart.parameters()],
        (true, true) => {
            let of_noise = driven_slope::slope(spectra, point, chart, noise);
            outside().iter().zip(of_noise).map(|(outside, of_noise)| outside + of_noise).collect()
        }
    };
    if chart.feedthrough {
        let slopes = feedthrough::slopes(&point.model, &options.direct);
        let first = out.len() - slopes.len();
        out[first..].iter_mut().zip(slopes).for_each(|(o, s)| *o += spectra.samples() as f64 * s);
    }
    out
}

/// `[R r - w]` with `R' w` the slope of what is no square beside `1/2 |r|^2`: then `R' (r - w)` is the slope of half the deviance, and the same
/// steps lower both.
fn with_slope(mut factor: Mat<f64>, slope: &[f64]) -> Mat<f64> {
    if slope.iter().all(|s| *s == 0.0) {
        return factor;
    }
    let columns = factor.ncols() - 1;
    let rows = columns.min(factor.nrows());
    let largest = (0..rows).map(|i| factor[(i, i)].abs()).fold(0.0, f64::max);
    // w by forward substitution; directions that the records do not determine take no part.
    let mut w = vec![0.0; rows];
    for i in 0..rows {
        let known: f64 = (0..i).map(|k| factor[(k, i)] * w[k]).sum();
        let diagonal = factor[(i, i)];
        if diagonal.abs() > UNDETERMINED * largest {
            w[i] = (slope.get(i).copied().unwrap_or(0.0) - known) / diagonal;
        }
    }
    w.iter().enumerate().for_each(|(i, w)| factor[(i, columns)] -= w);
    factor
}
