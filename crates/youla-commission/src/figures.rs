//! Figures of a loop: least damping and peak of the sensitivity.

use crate::Result;
use serde::{Deserialize, Serialize};
use youla::linalg::eye;
use youla::lti::{Discrete, PeakOptions, StateSpace, linf_norm};
use youla_loop::redesign;

/// Sizes of inputs and outputs, their rms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes<'a> {
    pub(crate) input: &'a [f64],
    pub(crate) output: &'a [f64],
}

/// Figures of one loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LoopState {
    /// Least damping ratio.
    pub damping: f64,
    /// Peak of the output sensitivity.
    pub sensitivity: f64,
}

impl LoopState {
    /// Of a loop with the response from a disturbance at the plant input to the outputs.
    ///
    /// # Errors
    /// [`youla::Error::Unstable`] for an unstable response.
    pub(crate) fn new(
        response: &StateSpace<Discrete>,
        controller: &StateSpace<Discrete>,
        sizes: Sizes<'_>,
    ) -> Result<Self> {
        let scaled = response.in_units(sizes.input, sizes.output);
        // With positive feedback the sensitivity is I + T K.
        let rest = controller.in_units(sizes.output, sizes.input).then(&scaled)?;
        let sensitivity = rest.plus(&StateSpace::gain(eye(rest.outputs()), rest.time())?)?;
        let peak = linf_norm(&sensitivity, &PeakOptions { tolerance: 1e-4 })?.value;
        Ok(LoopState { damping: least_damping(&scaled)?, sensitivity: peak })
    }
}

/// Least damping ratio of the modes that matter, as in the redesign.
///
/// # Errors
/// [`youla::Error::Unstable`].
pub(crate) fn least_damping(response: &StateSpace<Discrete>) -> youla::Result<f64> {
    Ok(redesign::least_damping(&redesign::loop_modes(response)?))
}
