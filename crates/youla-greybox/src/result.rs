//! What an estimate holds.

use crate::search::bounds::AtBound;
use crate::search::identifiability::Undetermined;
use serde::{Deserialize, Serialize};
use youla::Mat;
use youla::lti::{Continuous, Discrete, StateSpace};

/// Why the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// At a minimum, as exactly as the noise lets it be known.
    Converged,
    /// The model reproduces the data to rounding.
    Exact,
    /// No step that is longer than the tolerance lowers the criterion.
    StepTooSmall,
    /// The limit of iterations was reached.
    Iterations,
}

/// Result of [`crate::greybox`].
#[derive(Debug, Clone)]
pub struct GreyBoxModel {
    /// Estimated parameters, in the order of [`crate::Structure::names`].
    pub parameters: Vec<f64>,
    /// Their covariance, q x q, for white residuals, whatever the gain of the innovation form is; `None` where the data do not determine them all. Parameters that a
    /// bound holds back count as known: their rows and columns are zero.
    pub covariance: Option<Mat<f64>>,
    /// The continuous-time model, without delays; `None` of a structure of discrete time.
    pub continuous: Option<StateSpace<Continuous>>,
    /// The sampled model, behind a zero-order hold for a structure of continuous time, with the delays of the inputs as further states behind its own.
    pub model: StateSpace<Discrete>,
    /// Whether it is stable.
    pub stable: bool,
    /// The gain K of the innovation form in the states of the structure, n x p, where one was estimated.
    pub gain: Option<Mat<f64>>,
    /// State at the first sample of each experiment that was used (the first of all, or that of the longest delay), n numbers
    /// and those of the delays each.
    pub initial_states: Vec<Vec<f64>>,
    /// Half the sum of squares of the residuals, each divided by the deviation of its output.
    pub cost: f64,
    /// `100 (1 - |y - yhat| / |y - mean y|)` per output over all experiments, percent, eq. (26), yhat the prediction that the
    /// criterion compares: the simulation for output error, else the prediction one step ahead.
    pub fit: Vec<f64>,
    /// Root-mean-square residual `y - yhat` per output, in its units.
    pub residual: Vec<f64>,
    /// The same fit of the simulation from the initial states, minus infinity where it diverges.
    pub simulation_fit: Vec<f64>,
    /// Number of residuals: samples times outputs, over all experiments.
    pub residuals: usize,
    /// Parameters, entries of a free gain, and estimated initial states.
    pub unknowns: usize,
    /// Why the search ended.
    pub stop: Stop,
    /// Distance to the minimum of the linearised criterion over the radius of the confidence region.
    pub relative_offset: f64,
    /// Steps that lowered the criterion; there is one linearisation more.
    pub iterations: usize,
    /// Simulations of all records for the value of the criterion, those of rejected trial points included.
    pub evaluations: usize,
    /// Trial points that were rejected because the model could not be computed or its simulation was not finite.
    pub diverged: usize,
    /// Number of parameters (in combination) that the data determine: rank of the Jacobian, columns of unit length.
    pub rank: usize,
    /// Reciprocal condition number of that Jacobian.
    pub rcond: f64,
    /// Which parameters those are that the data do not determine.
    pub undetermined: Undetermined,
    /// Parameters that ended at a bound.
    pub at_bounds: Vec<AtBound>,
}

impl GreyBoxModel {
    /// Standard deviations of the parameters, `None` where the data do not determine them all.
    pub fn standard_deviations(&self) -> Option<Vec<f64>> {
        self.covariance
            .as_ref()
            .map(|covariance| covariance.diagonal().column_vector().iter().map(|v| v.sqrt()).collect())
    }
}
