//! A subspace model on a physical structure: a start for the prediction-error method that needs no guess, for open-loop records.
//!
//! ```text
//! u, y -> G                                                subspace identification of the plant
//! theta_0 = arg min sum_k |(G - G_theta) W_k|^2            projection on the structure, no start needed
//! theta   = arg min 1/2 sum_k |y(k) - yhat(k; theta)|^2    prediction error from theta_0
//! ```
//! The sibling of [`super::hansen_pem`] where no feedback makes the inputs depend on the noise, with `W_jj^2 = Phi_u,jj domega`. In
//! closed loop G is biased; it then still serves as a start where the bias is small.

#[cfg(test)]
mod tests;

pub use super::projected_pem::{PemRun, PemStart, SUSPICION_POINTS};

use super::projected_pem::{Searches, Task, falls_behind, fit_of, pem_from_targets, plant_target};
use crate::Result;
use crate::{GreyBoxModel, GreyBoxOptions, Problem, ProjectionOptions, StructureFit};
use serde::{Deserialize, Serialize};
use youla::identify::direct::direct;
use youla::identify::subspace::{SubspaceModel, SubspaceOptions};

/// Choices of [`subspace_pem`].
///
/// ```
/// use youla::identify::subspace::Order;
/// use youla_greybox::subspace_pem::SubspacePemOptions;
/// let mut options = SubspacePemOptions::default();
/// options.subspace.order = Order::Fixed(6);
/// assert_eq!(options.window, 1024);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SubspacePemOptions {
    /// Identification of the plant. An unstable estimate is as good a start as a stable one.
    pub subspace: SubspaceOptions,
    /// Number of frequencies of the projection, from `1 / (window ts)` Hz to 0.9 of the Nyquist frequency, equal ratios.
    pub frequencies: usize,
    /// Samples of a segment of the spectrum of u; at most a quarter of the shortest record is taken.
    pub window: usize,
    /// Time constants that the shortest record is long, of the decay under which responses are compared.
    pub decay: f64,
    /// The projection.
    pub projection: ProjectionOptions,
    /// The prediction-error method.
    pub pem: GreyBoxOptions,
}

impl Default for SubspacePemOptions {
    fn default() -> Self {
        SubspacePemOptions {
            subspace: SubspaceOptions::default(),
            frequencies: 120,
            window: 1024,
            decay: 10.0,
            projection: ProjectionOptions::default(),
            pem: GreyBoxOptions::default(),
        }
    }
}

/// Result of [`subspace_pem`].
#[derive(Debug)]
pub struct SubspacePem {
    /// G.
    pub subspace: SubspaceModel,
    /// Projections of G, that with the lowest criterion first.
    pub projections: Vec<StructureFit>,
    /// The searches.
    pub runs: Vec<PemRun>,
    /// Which of them won.
    pub won: PemStart,
    /// Its model, with the covariance of the parameters.
    pub model: GreyBoxModel,
    /// Fit of G to the same records, percent per output; minus infinity where its simulation diverges.
    pub fit_of_plant: Vec<f64>,
}

impl SubspacePem {
    /// Whether the fit of the structure is more than [`SUSPICION_POINTS`] below that of G, or below that of a constant, on an output:
    /// the search ended in a local minimum, or the structure does not describe the plant.
    pub fn local_minimum_suspected(&self) -> bool {
        falls_behind(&self.model.simulation_fit, &self.fit_of_plant)
    }
}

/// Identifies G, projects it on the structure and starts the prediction-error method there; `nominal` parameters are a second
/// start, where they are given, and a hint to the scale of parameters in the projection.
///
/// # Errors
/// As [`direct`], [`crate::project`] and [`crate::greybox`]; [`youla::Error::Diverged`] where no start leads to a
/// model.
///
/// # Accuracy
/// Noise-free records give the parameters back to 1e-6 (`tests`); see `docs/hansen-pem.md` for how often the result is that of a
/// search started at the true parameters.
///
/// ```
/// use youla_greybox::{DeclaredStructure, Problem, Structure, Template};
/// use youla::identify::subspace::{Experiment, Order};
/// use youla_greybox::subspace_pem::*;
/// use youla::lti::{Discrete, simulate};
/// use youla::Mat;
/// let time = Discrete::new(2e-4)?;
/// let u = Mat::from_fn(1000, 2, |k, j| if (k * k / 400 + k / (9 + j)) % 2 == 0 { 0.5 } else { -0.5 });
/// let bearing = DeclaredStructure::new(&Template::Bearing.declaration()?)?;
/// let y = simulate(&bearing.model(&bearing.start())?.zoh(time)?, u.as_ref(), &[0.0; 6])?;
/// let mut options = SubspacePemOptions::default();
/// options.subspace.order = Order::Fixed(6);
/// let experiments = [Experiment::new(u.as_ref(), y.as_ref())];
/// let problem = Problem::new(&bearing, &experiments, time);
/// let found = subspace_pem(&problem, None, &options)?;
/// assert!((found.model.parameters[4] / -1.869e6 - 1.0).abs() < 1e-6 && !found.local_minimum_suspected());
/// # Ok::<(), youla_greybox::Error>(())
/// ```
pub fn subspace_pem(
    problem: &Problem<'_>,
    nominal: Option<&[f64]>,
    options: &SubspacePemOptions,
) -> Result<SubspacePem> {
    problem.require_measured_inputs("subspace_pem")?;
    let experiments = problem.experiments;
    let found = direct(experiments, problem.time, &options.subspace)?;
    let sizes = [options.window, options.frequencies];
    let target = plant_target(&found.model, experiments, sizes, options.decay, &options.pem)?;
    let fit_of_plant = fit_of(&found.model, experiments, options.pem.initial_state)?;
    let task = Task { problem, nominal, projection: &options.projection, pem: &options.pem };
    let Searches { projections, runs, won, model } = pem_from_targets("the subspace model", &target, None, &task)?;
    Ok(SubspacePem { subspace: found, projections, runs, won, model, fit_of_plant })
}
