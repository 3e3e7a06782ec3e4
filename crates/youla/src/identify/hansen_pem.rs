//! Hansen's result on a physical structure: a start for the prediction-error method that needs no good nominal model.
//!
//! ```text
//! alpha, beta -> S -> G(S)                                 unbiased in closed loop, (25), of order n + n_S
//! theta_0 = arg min sum_k |((N + V S) - G_theta (M + U S)) W_k|^2        projection on the structure, no start needed
//! theta   = arg min 1/2 sum_k |y(k) - yhat(k; theta)|^2    prediction error from theta_0
//! ```
//! For white output noise the last line is the maximum-likelihood estimate, in closed loop too; its only weakness, local
//! minima, is what the lines before it are for. They need not be accurate, only in the valley of the global minimum.
//!
//! The projection compares what alpha makes of y by S, `(N + V S) alpha`, with what the structure makes of the u that alpha
//! causes, `(M + U S) alpha`: it is `|(G(S) - G_theta) u|^2` without a division by `M + U S`, whose zeros next to poles are the
//! lightly damped ghosts of G(S). With `W_jj^2 = Phi_alpha,jj domega` it is a quadrature of the criterion that follows, and since
//! S errs by `(Mt + S Ut) n / alpha`, the error has the same size at all frequencies.

#[cfg(test)]
mod tests;

use super::fit::reproduction;
use super::greybox::{
    FrequencyTarget, GreyBoxModel, GreyBoxOptions, Projection, ProjectionOptions, Structure, decayed, greybox,
    greybox_cost, logarithmic_grid, projections,
};
use super::hansen::{HansenModel, hansen};
use super::subspace::{Experiment, InitialState, SubspaceOptions};
use crate::factor::{CoprimeFactors, YoulaSignals};
use crate::lti::{Discrete, StateSpace, frequency_response, simulate, simulate_best};
use crate::record::{Welch, cross_spectrum};
use crate::{Error, Mat, Result};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Points of fit by which the structure may stay behind G(S) on an output before the result counts as lost.
pub const LOST_POINTS: f64 = 1.0;

/// Choices of [`hansen_pem`]. The initial states of `hansen` and `pem` are separate choices.
///
/// ```
/// let options = youla::identify::hansen_pem::HansenPemOptions { frequencies: 200, ..Default::default() };
/// assert_eq!(options.window, 1024);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HansenPemOptions {
    /// Identification of S.
    pub hansen: SubspaceOptions,
    /// Number of frequencies of the projection, from `1 / (window ts)` Hz to 0.9 of the Nyquist frequency, equal ratios.
    pub frequencies: usize,
    /// Samples of a segment of the spectrum of alpha; at most a quarter of the shortest record is taken.
    pub window: usize,
    /// Time constants that the shortest record is long, of the decay under which responses are compared: ghosts of S that
    /// live longer than the record are flat then. The modes of the plant should decay faster.
    pub decay: f64,
    /// The projection.
    pub projection: ProjectionOptions,
    /// The prediction-error method.
    pub pem: GreyBoxOptions,
}

impl Default for HansenPemOptions {
    fn default() -> Self {
        HansenPemOptions {
            hansen: SubspaceOptions::default(),
            frequencies: 120,
            window: 1024,
            decay: 10.0,
            projection: ProjectionOptions::default(),
            pem: GreyBoxOptions::default(),
        }
    }
}

/// Where a search of the prediction-error method began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PemStart {
    /// At the projection of G(S).
    Projection,
    /// At the nominal parameters.
    Nominal,
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

/// Result of [`hansen_pem`].
#[derive(Debug)]
pub struct HansenPem {
    /// S and G(S).
    pub hansen: HansenModel,
    /// Projections of G(S), that with the lowest criterion first.
    pub projections: Vec<Projection>,
    /// The searches.
    pub runs: Vec<PemRun>,
    /// Which of them won.
    pub won: PemStart,
    /// Its model, with the covariance of the parameters.
    pub model: GreyBoxModel,
    /// Fit of G(S) to the same records, percent per output; minus infinity where its simulation diverges.
    pub fit_of_plant: Vec<f64>,
}

impl HansenPem {
    /// Whether the structure stays behind G(S), or behind a constant, by more than [`LOST_POINTS`] on an output: the search is
    /// lost, or the structure does not describe the plant.
    pub fn lost(&self) -> bool {
        self.model.simulation_fit.iter().zip(&self.fit_of_plant).any(|(fit, plant)| *fit < plant.max(0.0) - LOST_POINTS)
    }
}

/// Identifies S, projects G(S) on the structure and starts the prediction-error method there; `nominal` parameters are a second
/// start, where they are given, and a hint to the scale of parameters in the projection.
///
/// `signals` are those of (28), `experiments` the measured u and y that they were made of.
///
/// # Errors
/// As [`hansen`], [`super::greybox::project`] and [`greybox`]; [`Error::Diverged`] where no start leads to a model.
///
/// # Accuracy
/// See `docs/hansen-pem.md` for how often the result is that of a search started at the true parameters.
pub fn hansen_pem(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    experiments: &[Experiment<'_>],
    structure: &dyn Structure,
    nominal: Option<&[f64]>,
    options: &HansenPemOptions,
) -> Result<HansenPem> {
    let found = hansen(factors, signals, &options.hansen)?;
    pem_from_hansen(found, factors, signals, experiments, structure, nominal, options)
}

/// The same from a result of [`hansen`] or one of its siblings for the same factors and signals.
///
/// # Errors
/// As [`hansen_pem`].
pub fn pem_from_hansen(
    found: HansenModel,
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    experiments: &[Experiment<'_>],
    structure: &dyn Structure,
    nominal: Option<&[f64]>,
    options: &HansenPemOptions,
) -> Result<HansenPem> {
    let time = factors.nominal().time();
    let target = projection_target(factors, &found.deviation.model, signals, options)?;
    let starts: Vec<Vec<f64>> = nominal.iter().map(|theta| theta.to_vec()).collect();
    let projections = projections(structure, &target, &starts, &options.projection)?;
    let cost = |theta: &[f64]| greybox_cost(structure, theta, experiments, time, &options.pem).unwrap_or(f64::INFINITY);
    let mut order: Vec<(f64, Projection)> = projections.into_iter().map(|p| (cost(&p.parameters), p)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let begun = [(PemStart::Projection, order[0].0, order[0].1.parameters.as_slice())]
        .into_iter()
        .chain(nominal.map(|theta| (PemStart::Nominal, cost(theta), theta)));
    let mut best: Option<(PemStart, GreyBoxModel)> = None;
    let mut runs = Vec::new();
    for (start, cost_at_start, theta) in begun {
        let outcome = greybox(structure, theta, experiments, time, &options.pem).map(|model| {
            let cost = model.cost;
            if best.as_ref().is_none_or(|(_, best)| cost < best.cost) {
                best = Some((start, model));
            }
            cost
        });
        runs.push(PemRun { start, cost_at_start, cost: outcome });
    }
    let Some((won, model)) = best else { return Err(first_error(runs)) };
    let fit_of_plant = fit_of(&found.plant, experiments, options.pem.initial_state)?;
    let projections = order.into_iter().map(|(_, projection)| projection).collect();
    Ok(HansenPem { hansen: found, projections, runs, won, model, fit_of_plant })
}

/// Why the first search failed.
fn first_error(runs: Vec<PemRun>) -> Error {
    let first = runs.into_iter().find_map(|run| run.cost.err());
    first.unwrap_or(Error::NoStart).within("the prediction-error method from the projection of G(S)")
}

/// What alpha makes of u and y by S on the grid, with the weights of the criterion of the records.
///
/// # Errors
/// Ports; [`Error::TooFewSamples`] for a record that is too short for a spectrum; [`Error::PoleOnBoundary`].
pub fn projection_target(
    factors: &CoprimeFactors<Discrete>,
    s: &StateSpace<Discrete>,
    signals: &[YoulaSignals],
    options: &HansenPemOptions,
) -> Result<FrequencyTarget> {
    let (p, m, time) = (factors.outputs(), factors.inputs(), s.time());
    let shortest = signals.iter().map(|s| s.alpha.nrows()).min().unwrap_or(0);
    let window = options.window.min(shortest / 4);
    if window < SHORTEST_WINDOW {
        let what = "the shortest record, for the spectrum of alpha".into();
        return Err(Error::TooFewSamples { what, found: shortest, needed: 4 * SHORTEST_WINDOW });
    }
    let spacing = 2.0 * PI / (window as f64 * time.ts());
    let omega = logarithmic_grid([spacing, 0.9 * PI / time.ts()], options.frequencies)?;
    let spectrum = alpha_spectrum(signals, time, window)?;
    let size = |k: usize, j: usize| {
        let (before, after) = (omega[k.saturating_sub(1)], omega[(k + 1).min(omega.len() - 1)]);
        let bin = ((omega[k] / spacing).round() as usize).min(spectrum.nrows() - 1);
        (spectrum[(bin, j)] * 0.5 * (after - before)).sqrt()
    };
    let deviation = |i: usize| options.pem.output_deviations.get(i).copied().unwrap_or(1.0);
    let weight = |k: usize| Mat::from_fn(p, m, |i, j| size(k, j) / deviation(i));
    let decay = options.decay / (shortest as f64 * time.ts());
    let response = frequency_response(&decayed(&factors.right_factors_of(s)?, decay)?, &omega)?;
    let part = |first: usize, count: usize| response.iter().map(|g| g.subrows(first, count).to_owned()).collect();
    let weights = (0..omega.len()).map(weight).collect();
    FrequencyTarget::of_excitation(&omega, part(0, m), part(m, p), time)?.weighted(weights)?.decaying(decay)
}

/// Shortest segment of the spectrum of alpha.
const SHORTEST_WINDOW: usize = 16;

/// Power of each alpha per Hz, frequencies x m, averaged over the records by their length.
fn alpha_spectrum(signals: &[YoulaSignals], time: Discrete, window: usize) -> Result<Mat<f64>> {
    let welch = Welch { window, remove_mean: false, ..Welch::default() };
    let inputs = signals.first().map_or(0, |s| s.alpha.ncols());
    let mut sum = Mat::zeros(window / 2 + 1, inputs);
    for s in signals {
        let alpha = s.alpha.as_ref();
        let spectrum = cross_spectrum(alpha, alpha, time, &welch)?;
        for (k, density) in spectrum.density.iter().enumerate() {
            for j in 0..inputs.min(density.ncols()) {
                sum[(k, j)] += density[(j, j)].re.max(0.0) * alpha.nrows() as f64;
            }
        }
    }
    Ok(sum)
}

/// Fit (26) of a simulated model per output over all records, percent.
fn fit_of(model: &StateSpace<Discrete>, experiments: &[Experiment<'_>], initial: InitialState) -> Result<Vec<f64>> {
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
