//! Choices of the search.

use crate::prediction::noise::NoiseModel;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::identify::subspace::InitialState;

/// Choices of [`crate::greybox`].
///
/// ```
/// use youla::identify::subspace::InitialState;
/// use youla_greybox::GreyBoxOptions;
/// let options = GreyBoxOptions { initial_state: InitialState::Zero, ..Default::default() };
/// assert_eq!(options.max_iterations, 50);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GreyBoxOptions {
    /// Largest number of steps. From nominal models of the bearing that are up to 60 % wrong the search takes 5 to 20; a
    /// search in a local minimum usually runs to the limit.
    pub max_iterations: usize,
    /// Converged where the distance to the minimum of the linearised criterion is below this share of the radius of the
    /// confidence region: the relative offset (D. M. Bates and D. G. Watts, Technometrics 23 (1981), 179).
    pub offset_tolerance: f64,
    /// Smallest step, relative to the parameters, both in units of their effect on the output.
    pub step_tolerance: f64,
    /// Damping of the first step, relative to the squared lengths of the columns of the Jacobian.
    pub damping: f64,
    /// The state at the first sample of each experiment.
    pub initial_state: InitialState,
    /// The model of the noise.
    pub noise: NoiseModel,
    /// Standard deviation of the noise of each output, of which only the ratios count; empty where all are equal.
    pub output_deviations: Vec<f64>,
    /// Known delay of each input in whole samples, beyond the zero-order hold; none when empty.
    pub delays: Vec<usize>,
}

impl Default for GreyBoxOptions {
    fn default() -> Self {
        GreyBoxOptions {
            max_iterations: 50,
            offset_tolerance: 1e-4,
            step_tolerance: 1e-10,
            damping: 1e-3,
            initial_state: InitialState::default(),
            noise: NoiseModel::default(),
            output_deviations: Vec::new(),
            delays: Vec::new(),
        }
    }
}

impl GreyBoxOptions {
    /// Refuses numbers that no search can use.
    pub(super) fn check(&self) -> Result<()> {
        require_positive(&[
            ("the offset tolerance", self.offset_tolerance),
            ("the step tolerance", self.step_tolerance),
            ("the damping", self.damping),
        ])
    }
}

/// Refuses a named number that is not positive.
pub(super) fn require_positive(values: &[(&str, f64)]) -> Result<()> {
    match values.iter().find(|(_, value)| !(*value > 0.0 && value.is_finite())) {
        Some((what, value)) => Err(Error::Method(youla::Error::OutOfRange {
            what: (*what).into(),
            value: *value,
            must: "a positive number",
        })),
        None => Ok(()),
    }
}
