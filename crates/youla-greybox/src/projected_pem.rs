//! From a frequency response to the prediction-error method: the steps of [`crate::hansen_pem`], and of the closed-loop search of a run.
//!
//! ```text
//! theta_0 = arg min sum_k |(Y - G_theta U) W_k|^2          W_jj^2 = Phi_jj domega, the noise-free part of what follows
//! theta   = arg min 1/2 sum_k |y(k) - yhat(k; theta)|^2    from theta_0 of each response, and from nominal parameters
//! ```

use crate::search::fit::reproduction;
use crate::{Error, Result};
use crate::{
    FrequencyTarget, GreyBoxModel, GreyBoxOptions, Problem, ProjectionOptions, Structure, StructureFit, decayed,
    greybox, greybox_cost, logarithmic_grid, projections,
};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use youla::identify::subspace::{Experiment, InitialState};
use youla::lti::{Discrete, StateSpace, frequency_response, simulate, simulate_best};
use youla::signal::{Welch, cross_spectrum};
use youla::{Mat, MatRef};

/// A local minimum is suspected where the fit of the structure is this many percentage points below that of the model from which it was
/// projected, on an output. Chosen: ten times the 0.1 point by which `docs/hansen-pem.md` counts a search as converged to the truth.
pub(crate) const SUSPICION_POINTS: f64 = 1.0;

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
    /// At the projection of a model that was identified from u and y by a method for closed loops.
    Direct,
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

/// A start counts as better where it lowers the criterion by more than this share.
const BETTER: f64 = 1e-6;

/// The searches, and the model with the lowest criterion.
pub(super) struct Searches {
    /// Of the first response, that with the lowest criterion first.
    pub(super) projections: Vec<StructureFit>,
    pub(super) runs: Vec<PemRun>,
    pub(super) won: PemStart,
    pub(super) model: GreyBoxModel,
}

/// What is searched in, and how.
pub(super) struct Task<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) nominal: Option<&'a [f64]>,
    pub(super) projection: &'a ProjectionOptions,
    pub(super) pem: &'a GreyBoxOptions,
}

/// Projects responses on the structure and starts the prediction-error method at the best projection of each, and at the nominal
/// parameters. Only the first response, that of G(S), must have a projection. The first start wins unless a later one is better by more
/// than rounding.
pub(super) fn pem_from_targets(
    first: &FrequencyTarget,
    further: Option<FrequencyTarget>,
    task: &Task<'_>,
) -> Result<Searches> {
    let structure = task.problem.structure;
    let projections = task.projections(first)?;
    let mut begun = vec![(PemStart::Projection, projections[0].0, projections[0].1.start(structure))];
    if let Some(others) = further.and_then(|target| task.projections(&target).ok()) {
        begun.push((PemStart::Direct, others[0].0, others[0].1.start(structure)));
    }
    begun.extend(task.nominal.map(|theta| (PemStart::Nominal, task.cost(theta), theta.to_vec())));
    let search = |theta: &[f64]| greybox(task.problem, theta, task.pem);
    let (runs, best) = searched(begun, search);
    let Some((won, model)) = best else { return Err(first_error(runs)) };
    let projections = projections.into_iter().map(|(_, projection)| projection).collect();
    Ok(Searches { projections, runs, won, model })
}

/// The projections of a response on a structure with the criterion where a search from them starts, the lowest first; nominal
/// parameters are a hint.
pub fn projected(
    structure: &dyn Structure,
    target: &FrequencyTarget,
    nominal: Option<&[f64]>,
    options: &ProjectionOptions,
    cost: impl Fn(&[f64]) -> f64,
) -> Result<Vec<(f64, StructureFit)>> {
    let hints: Vec<Vec<f64>> = nominal.iter().map(|theta| theta.to_vec()).collect();
    let found = projections(structure, target, &hints, options)?;
    let mut order: Vec<(f64, StructureFit)> = found.into_iter().map(|p| (cost(&p.start(structure)), p)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(order)
}

/// Searches from all starts, given with the criterion there. The first wins unless a later one ends lower by more than rounding.
pub fn searched(
    begun: Vec<(PemStart, f64, Vec<f64>)>,
    search: impl Fn(&[f64]) -> Result<GreyBoxModel>,
) -> (Vec<PemRun>, Option<(PemStart, GreyBoxModel)>) {
    let mut best: Option<(PemStart, GreyBoxModel)> = None;
    let mut runs = Vec::new();
    for (start, cost_at_start, theta) in begun {
        let outcome = search(&theta).map(|model| {
            let cost = model.cost;
            if best.as_ref().is_none_or(|(_, best)| cost < best.cost * (1.0 - BETTER)) {
                best = Some((start, model));
            }
            cost
        });
        runs.push(PemRun { start, cost_at_start, cost: outcome });
    }
    (runs, best)
}

impl Task<'_> {
    /// Projections of a response with their criterion, the lowest first.
    fn projections(&self, target: &FrequencyTarget) -> Result<Vec<(f64, StructureFit)>> {
        let cost = |theta: &[f64]| self.cost(theta);
        projected(self.problem.structure, target, self.nominal, self.projection, cost)
    }

    /// The criterion, infinite where there is none.
    fn cost(&self, theta: &[f64]) -> f64 {
        greybox_cost(self.problem, theta, self.pem).unwrap_or(f64::INFINITY)
    }
}

/// Why the first search failed.
fn first_error(runs: Vec<PemRun>) -> Error {
    let first = runs.into_iter().find_map(|run| run.cost.err());
    first.unwrap_or(Error::NoStart).within("the prediction-error method from the projection of G(S)")
}

/// Whether a fit is more than one point below another, or below that of a constant, on an output.
pub(super) fn falls_behind(fit: &[f64], other: &[f64]) -> bool {
    fit.iter().zip(other).any(|(fit, other)| *fit < other.max(0.0) - SUSPICION_POINTS)
}

/// The response of a model of the plant on a grid of frequencies, with the weights of the criterion of its inputs' records.
pub(super) fn plant_target(
    model: &StateSpace<Discrete>,
    experiments: &[Experiment<'_>],
    [window, frequencies]: [usize; 2],
    decay: f64,
    pem: &GreyBoxOptions,
) -> Result<FrequencyTarget> {
    let u: Vec<_> = experiments.iter().map(|e| e.u).collect();
    let grid = Grid::new("the inputs", &u, window, frequencies, model.time())?;
    let weights = grid.weights(&u, model.outputs(), pem)?;
    let decay = decay / grid.shortest;
    let response = frequency_response(&decayed(model, decay)?, &grid.omega)?;
    let values: Vec<Mat<_>> = response.iter().map(|g| g.to_owned()).collect();
    FrequencyTarget::new(&grid.omega, values, model.time())?
        .weighted(weights)?
        .decaying(decay)?
        .behind_delays(&pem.delays)
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
            return Err(Error::Method(youla::Error::TooFewSamples {
                what,
                found: shortest,
                needed: 4 * SHORTEST_WINDOW,
            }));
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
            Err(Error::Method(youla::Error::Diverged { .. })) => return Ok(vec![f64::NEG_INFINITY; model.outputs()]),
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

#[cfg(test)]
mod tests;
