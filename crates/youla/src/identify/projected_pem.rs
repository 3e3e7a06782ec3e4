//! From a frequency response to the prediction-error method: what [`super::hansen_pem`] and [`super::subspace_pem`] share.
//!
//! ```text
//! theta_0 = arg min sum_k |(Y - G_theta U) W_k|^2          W_jj^2 = Phi_jj domega, the noise-free part of what follows
//! theta   = arg min 1/2 sum_k |y(k) - yhat(k; theta)|^2    from theta_0 and, where there are any, from nominal parameters
//! ```

use super::fit::reproduction;
use super::greybox::{
    ContinuationOptions, FrequencyTarget, GreyBoxModel, GreyBoxOptions, Projection, ProjectionOptions, Structure,
    greybox, greybox_continued, greybox_cost, logarithmic_grid, projections,
};
use super::subspace::{Experiment, InitialState};
use crate::lti::{Discrete, StateSpace, simulate, simulate_best};
use crate::record::{Welch, cross_spectrum};
use crate::{Error, Mat, MatRef, Result};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Points of fit by which the structure may stay behind the model that it was projected from, on an output, before the result
/// counts as lost.
pub const LOST_POINTS: f64 = 1.0;

/// Shortest segment of a spectrum.
const SHORTEST_WINDOW: usize = 16;

/// Where a search of the prediction-error method began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PemStart {
    /// At the projection.
    Projection,
    /// At the nominal parameters.
    Nominal,
    /// At the projection, behind an observer that is taken away step by step: tried where the searches before it are lost.
    Continued,
}

/// One search.
#[derive(Debug)]
pub struct PemRun {
    /// Where it began.
    pub start: PemStart,
    /// The criterion there, infinite where the simulation diverges.
    pub cost_at_start: f64,
    /// The criterion where it ended, or why it led to no model.
    pub cost: Result<f64>,
}

/// The searches, and the model with the lowest criterion.
pub(super) struct Projected {
    /// That with the lowest criterion first.
    pub(super) projections: Vec<Projection>,
    pub(super) runs: Vec<PemRun>,
    pub(super) won: PemStart,
    pub(super) model: GreyBoxModel,
}

/// Projects a response, `source` in words, on the structure and starts the prediction-error method there and at the nominal
/// parameters.
pub(super) fn pem_from_target(
    source: &str,
    target: &FrequencyTarget,
    structure: &dyn Structure,
    nominal: Option<&[f64]>,
    experiments: &[Experiment<'_>],
    fit_of_plant: &[f64],
    options: (&ProjectionOptions, &GreyBoxOptions),
) -> Result<Projected> {
    let ((projection, pem), time) = (options, target.time());
    let starts: Vec<Vec<f64>> = nominal.iter().map(|theta| theta.to_vec()).collect();
    let projections = projections(structure, target, &starts, projection)?;
    let cost = |theta: &[f64]| greybox_cost(structure, theta, experiments, time, pem).unwrap_or(f64::INFINITY);
    let mut order: Vec<(f64, Projection)> = projections.into_iter().map(|p| (cost(&p.parameters), p)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let begun = [(PemStart::Projection, order[0].0, order[0].1.parameters.as_slice())]
        .into_iter()
        .chain(nominal.map(|theta| (PemStart::Nominal, cost(theta), theta)));
    let mut searches = Searches::default();
    for (start, cost_at_start, theta) in begun {
        searches.take(start, cost_at_start, greybox(structure, theta, experiments, time, pem));
    }
    if searches.best.as_ref().is_none_or(|(_, best)| falls_behind(&best.fit, fit_of_plant)) {
        let options = ContinuationOptions { pem: pem.clone(), ..Default::default() };
        let (cost_at_start, best) = &order[0];
        let found = greybox_continued(structure, &best.parameters, experiments, time, &options);
        searches.take(PemStart::Continued, *cost_at_start, found.map(|found| found.model));
    }
    let Searches { best, runs } = searches;
    let Some((won, model)) = best else { return Err(first_error(source, runs)) };
    let projections = order.into_iter().map(|(_, projection)| projection).collect();
    Ok(Projected { projections, runs, won, model })
}

/// What came of them, and the best so far.
#[derive(Default)]
struct Searches {
    runs: Vec<PemRun>,
    best: Option<(PemStart, GreyBoxModel)>,
}

impl Searches {
    fn take(&mut self, start: PemStart, cost_at_start: f64, outcome: Result<GreyBoxModel>) {
        let cost = outcome.map(|model| {
            let cost = model.cost;
            if self.best.as_ref().is_none_or(|(_, best)| cost < best.cost) {
                self.best = Some((start, model));
            }
            cost
        });
        self.runs.push(PemRun { start, cost_at_start, cost });
    }
}

/// Why the first search failed.
fn first_error(source: &str, runs: Vec<PemRun>) -> Error {
    let first = runs.into_iter().find_map(|run| run.cost.err());
    first.unwrap_or(Error::NoStart).within(format!("the prediction-error method from the projection of {source}"))
}

/// Whether a fit stays behind another, or behind a constant, by more than [`LOST_POINTS`] on an output.
pub(super) fn falls_behind(fit: &[f64], other: &[f64]) -> bool {
    fit.iter().zip(other).any(|(fit, other)| *fit < other.max(0.0) - LOST_POINTS)
}

/// The frequencies of a projection.
pub(super) struct Grid {
    pub(super) omega: Vec<f64>,
    /// Samples of a segment of a spectrum.
    window: usize,
    /// Length of the shortest record, seconds.
    pub(super) shortest: f64,
    time: Discrete,
}

impl Grid {
    /// From `1 / (window ts)` Hz to 0.9 of the Nyquist frequency; a window is at most a quarter of the shortest record of the
    /// input, `name` in words.
    pub(super) fn new(
        name: &str,
        inputs: &[MatRef<'_, f64>],
        window: usize,
        frequencies: usize,
        time: Discrete,
    ) -> Result<Self> {
        let shortest = inputs.iter().map(|u| u.nrows()).min().unwrap_or(0);
        let window = window.min(shortest / 4);
        if window < SHORTEST_WINDOW {
            let what = format!("the shortest record, for the spectrum of {name}");
            return Err(Error::TooFewSamples { what, found: shortest, needed: 4 * SHORTEST_WINDOW });
        }
        let lowest = 2.0 * PI / (window as f64 * time.ts());
        let omega = logarithmic_grid([lowest, 0.9 * PI / time.ts()], frequencies)?;
        Ok(Grid { omega, window, shortest: shortest as f64 * time.ts(), time })
    }

    /// W, outputs x inputs for each frequency: the root of the power of the input around it over the deviation of the output.
    pub(super) fn weights(
        &self,
        inputs: &[MatRef<'_, f64>],
        outputs: usize,
        pem: &GreyBoxOptions,
    ) -> Result<Vec<Mat<f64>>> {
        let (omega, spacing) = (&self.omega, 2.0 * PI / (self.window as f64 * self.time.ts()));
        let spectrum = self.spectrum(inputs)?;
        let size = |k: usize, j: usize| {
            let (before, after) = (omega[k.saturating_sub(1)], omega[(k + 1).min(omega.len() - 1)]);
            let bin = ((omega[k] / spacing).round() as usize).min(spectrum.nrows() - 1);
            (spectrum[(bin, j)] * 0.5 * (after - before)).sqrt()
        };
        let deviation = |i: usize| pem.output_deviations.get(i).copied().unwrap_or(1.0);
        let weight = |k: usize| Mat::from_fn(outputs, spectrum.ncols(), |i, j| size(k, j) / deviation(i));
        Ok((0..omega.len()).map(weight).collect())
    }

    /// Power of each input per Hz, frequencies x m, averaged over the records by their length.
    fn spectrum(&self, inputs: &[MatRef<'_, f64>]) -> Result<Mat<f64>> {
        let welch = Welch { window: self.window, remove_mean: false, ..Welch::default() };
        let columns = inputs.first().map_or(0, |u| u.ncols());
        let mut sum = Mat::zeros(self.window / 2 + 1, columns);
        for u in inputs {
            let spectrum = cross_spectrum(*u, *u, self.time, &welch)?;
            for (k, density) in spectrum.density.iter().enumerate() {
                for j in 0..columns.min(density.ncols()) {
                    sum[(k, j)] += density[(j, j)].re.max(0.0) * u.nrows() as f64;
                }
            }
        }
        Ok(sum)
    }
}

/// Fit (26) of a simulated model per output over all records, percent.
pub(super) fn fit_of(
    model: &StateSpace<Discrete>,
    experiments: &[Experiment<'_>],
    initial: InitialState,
) -> Result<Vec<f64>> {
    let mut errors = Vec::new();
    for e in experiments {
        match simulated_error(model, e, initial) {
            Ok(error) => errors.push(error),
            Err(Error::Diverged { .. }) => return Ok(vec![f64::NEG_INFINITY; model.outputs()]),
            Err(other) => return Err(other),
        }
    }
    let measured: Vec<_> = experiments.iter().map(|e| e.y).collect();
    Ok(reproduction(&measured, &errors).iter().map(|output| output.fit).collect())
}

/// `y - yhat`, from rest or from the initial state that fits best; a black box has no steady state that can be trusted.
fn simulated_error(model: &StateSpace<Discrete>, e: &Experiment<'_>, initial: InitialState) -> Result<Mat<f64>> {
    let simulated = match initial {
        InitialState::Zero => simulate(model, e.u, &vec![0.0; model.order()])?,
        InitialState::Estimated | InitialState::SteadyState => simulate_best(model, e.u, e.y)?,
    };
    Ok(e.y - simulated)
}
