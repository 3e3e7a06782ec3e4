//! Figures of a loop: least damping and peak of the sensitivity.

use crate::Result;
use serde::{Deserialize, Serialize};
use youla::linalg::eye;
use youla::lti::{Discrete, PeakOptions, StateSpace, linf_norm};

/// Modes with less of the oscillating response than this are left out, as in the redesign.
/// Chosen, not measured.
const LEAST_SHARE: f64 = 0.05;

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

/// Least damping ratio of the modes with 5 % or more of the oscillating response; 1 where there is none. Real poles do not count: two near
/// each other have large responses that cancel, beside which no mode would have a share.
///
/// # Errors
/// [`youla::Error::Unstable`].
pub(crate) fn least_damping(response: &StateSpace<Discrete>) -> Result<f64> {
    let mut modes = response.shared_modes()?;
    modes.retain(|mode| mode.mode.pole.im > 0.0);
    let all: f64 = modes.iter().map(|mode| mode.share).sum();
    let visible = modes.iter().filter(|mode| mode.share >= LEAST_SHARE * all);
    Ok(visible.map(|mode| mode.mode.zeta).fold(1.0, f64::min))
}
