//! Hansen's result on a physical structure: a start for the prediction-error method that needs no good nominal model.
//!
//! ```text
//! alpha, beta -> S -> G(S)                                 unbiased in closed loop, (25), of order n + n_S
//! theta_0 = arg min sum_k |((N + V S) - G_theta (M + U S)) W_k|^2        projection on the structure, no start needed
//! theta   = arg min 1/2 sum_k |y(k) - yhat(k; theta)|^2    prediction error from theta_0
//! ```
//! For white output noise the last line is the maximum-likelihood estimate, in closed loop too. The lines before it give a start in the
//! valley of the global minimum; a start there need not be accurate.
//!
//! The projection compares what alpha makes of y by S, `(N + V S) alpha`, with what the structure makes of the u that alpha
//! causes, `(M + U S) alpha`: it is `|(G(S) - G_theta) u|^2` without a division by `M + U S`, whose zeros next to poles are the
//! spurious lightly damped modes of G(S). With `W_jj^2 = Phi_alpha,jj domega` it is a quadrature of the criterion that follows, and since
//! S errs by `(Mt + S Ut) n / alpha`, the error has the same size at all frequencies.

pub use crate::projected_pem::{PemRun, PemStart};

use crate::Result;
use crate::projected_pem::{Grid, Searches, Task, falls_behind, fit_of, pem_from_targets, plant_target};
use crate::{FrequencyTarget, GreyBoxModel, GreyBoxOptions, Problem, ProjectionOptions, StructureFit, decayed};
use serde::{Deserialize, Serialize};
use youla::factor::{CoprimeFactors, YoulaSignals};
use youla::identify::direct::direct;
use youla::identify::hansen::{HansenModel, hansen};
use youla::identify::subspace::{Order, Stability, SubspaceMethod, SubspaceOptions};
use youla::lti::{Discrete, StateSpace, frequency_response};

/// Choices of [`hansen_pem`]. The initial states of `hansen` and `pem` are separate choices.
///
/// ```
/// let options = youla_greybox::hansen_pem::HansenPemOptions { frequencies: 200, ..Default::default() };
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
    /// Time constants that the shortest record is long, of the decay under which responses are compared: spurious poles of
    /// S whose time constant exceeds the record are smoothed by it. The modes of the plant should decay faster.
    pub decay: f64,
    /// Whether the prediction-error method starts a second time, at the projection of a model that PBSIDopt finds from u and y with
    /// the horizons of `hansen`. It is consistent in closed loop, and uses the excitation by noise that is fed back, which
    /// alpha does not contain: for much noise and strong feedback. It is left out where PBSIDopt gives no model.
    pub direct_start: bool,
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
            direct_start: true,
            projection: ProjectionOptions::default(),
            pem: GreyBoxOptions::default(),
        }
    }
}

/// Result of [`hansen_pem`].
#[derive(Debug)]
pub struct HansenPem {
    /// S and G(S).
    pub hansen: HansenModel,
    /// Projections of G(S), that with the lowest criterion first.
    pub projections: Vec<StructureFit>,
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
    /// Whether the fit of the structure is more than one point below that of G(S), or below that of a constant, on an
    /// output: the search ended in a local minimum, or the structure does not describe the plant.
    pub fn local_minimum_suspected(&self) -> bool {
        falls_behind(&self.model.simulation_fit, &self.fit_of_plant)
    }
}

/// The records of a loop as the scheme sees them.
#[derive(Debug, Clone, Copy)]
pub struct SchemeData<'a> {
    /// Coprime factors of the nominal model and the controller.
    pub factors: &'a CoprimeFactors<Discrete>,
    /// alpha and beta of (28) for each experiment.
    pub signals: &'a [YoulaSignals],
}

/// Identifies S, projects G(S) on the structure and starts the prediction-error method there; `nominal` parameters are a second
/// start, where they are given, and a hint to the scale of parameters in the projection.
///
/// The experiments of the problem are the measured u and y from which the signals were computed.
///
/// # Errors
/// As [`hansen`], [`crate::project`] and [`crate::greybox`]; [`youla::Error::Diverged`] where no start leads to a model;
/// [`crate::Error::MeasuredInputs`] for a problem with a simulated loop.
///
/// # Accuracy
/// `docs/hansen-pem.md` gives the share of records for which the result is that of a search from the true parameters.
pub fn hansen_pem(
    data: SchemeData<'_>,
    problem: &Problem<'_>,
    nominal: Option<&[f64]>,
    options: &HansenPemOptions,
) -> Result<HansenPem> {
    let found = hansen(data.factors, data.signals, &options.hansen)?;
    pem_from_hansen(found, data, problem, nominal, options)
}

/// The same from a result of [`hansen`] or one of its siblings for the same factors and signals.
///
/// # Errors
/// As [`hansen_pem`].
pub fn pem_from_hansen(
    found: HansenModel,
    data: SchemeData<'_>,
    problem: &Problem<'_>,
    nominal: Option<&[f64]>,
    options: &HansenPemOptions,
) -> Result<HansenPem> {
    problem.require_measured_inputs("hansen_pem")?;
    let target = projection_target(data.factors, &found.deviation.model, data.signals, options)?;
    let fit_of_plant = fit_of(&found.plant, problem.experiments, options.pem.initial_state)?;
    let direct = if options.direct_start { direct_target(problem, nominal, options).ok() } else { None };
    let task = Task { problem, nominal, projection: &options.projection, pem: &options.pem };
    let Searches { projections, runs, won, model } = pem_from_targets(&target, direct, &task)?;
    Ok(HansenPem { hansen: found, projections, runs, won, model, fit_of_plant })
}

/// The response of a model of the order of the structure that PBSIDopt finds from u and y.
fn direct_target(
    problem: &Problem<'_>,
    nominal: Option<&[f64]>,
    options: &HansenPemOptions,
) -> Result<FrequencyTarget> {
    let (structure, experiments) = (problem.structure, problem.experiments);
    // The order does not depend on the parameters.
    let probe = nominal.map_or_else(|| vec![1.0; structure.names().len()], <[f64]>::to_vec);
    let subspace = SubspaceOptions {
        method: SubspaceMethod::PbsidOpt,
        order: Order::Fixed(structure.model(&probe)?.order()),
        stability: Stability::Allow,
        delays: options.pem.delays.clone(),
        ..options.hansen.clone()
    };
    let model = direct(experiments, problem.time, &subspace)?.model;
    plant_target(&model, experiments, [options.window, options.frequencies], options.decay, &options.pem)
}

/// What alpha makes of u and y by S on the grid, with the weights of the criterion of the records.
///
/// # Errors
/// Ports; [`youla::Error::TooFewSamples`] for a record that is too short for a spectrum; [`youla::Error::PoleOnBoundary`].
pub fn projection_target(
    factors: &CoprimeFactors<Discrete>,
    s: &StateSpace<Discrete>,
    signals: &[YoulaSignals],
    options: &HansenPemOptions,
) -> Result<FrequencyTarget> {
    let (p, m, time) = (factors.outputs(), factors.inputs(), s.time());
    let alpha: Vec<_> = signals.iter().map(|s| s.alpha()).collect();
    let grid = Grid::new("alpha", &alpha, options.window, options.frequencies, time)?;
    let weights = grid.weights(&alpha, p, &options.pem)?;
    let decay = options.decay / grid.shortest;
    let response = frequency_response(&decayed(&factors.right_factors_of(s)?, decay)?, &grid.omega)?;
    let part = |first: usize, count: usize| response.iter().map(|g| g.subrows(first, count).to_owned()).collect();
    FrequencyTarget::of_excitation(&grid.omega, part(0, m), part(m, p), time)?
        .weighted(weights)?
        .decaying(decay)?
        .behind_delays(&options.pem.delays)
}
