//! Figures of a loop: the modes that a disturbance at the plant input excites, the peak of the response to it, and the peak
//! of the sensitivity.

use crate::error::Result;
use youla::control::{closed_loop, peak_sensitivity, with_input_port};
use youla::lti::{Discrete, PeakOptions, SharedMode, StateSpace, hinf_norm};

/// Figures of one loop.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopFigures {
    /// From a disturbance at the plant input to y, channels in their rms.
    pub response: StateSpace<Discrete>,
    /// Modes of the response of y to a disturbance at the plant input, channels in their rms, by their share in it.
    pub modes: Vec<SharedMode>,
    /// Least damping ratio of the oscillating modes with a share of 5 % or more; 1 where there is none.
    pub least_damping: f64,
    /// Largest gain from a disturbance at the plant input to y, channels in their rms.
    pub peak_response: f64,
    /// Peak of the output sensitivity, channels in their rms.
    pub peak_sensitivity: f64,
}

impl LoopFigures {
    /// Modes with less than this share in the response are left out of the least damping.
    /// Below it a nearly cancelled mode is not visible in the response. Chosen, not measured.
    pub const LEAST_SHARE: f64 = 0.05;

    /// Of the loop of a plant and a controller `u = K y` (positive feedback), with the sizes of inputs and outputs.
    ///
    /// # Errors
    /// [`youla::Error::NotStabilising`] with the pole; ports, sample times.
    pub fn new(
        plant: &StateSpace<Discrete>,
        controller: &StateSpace<Discrete>,
        (input_size, output_size): (&[f64], &[f64]),
    ) -> Result<Self> {
        let plant = plant.in_units(input_size, output_size);
        let controller = controller.in_units(output_size, input_size);
        // Refuses an unstable loop with its pole.
        let peak_sensitivity = peak_sensitivity(&plant, &controller)?;
        let (m, p) = (plant.inputs(), plant.outputs());
        let response = closed_loop(&plant, &with_input_port(&controller)?)?.part(m..m + p, 0..m);
        let modes = response.shared_modes()?;
        let least_damping = least_damping(&modes);
        let peak_response = hinf_norm(&response, &PeakOptions { tolerance: 1e-6 })?.value;
        Ok(LoopFigures { response, modes, least_damping, peak_response, peak_sensitivity })
    }
}

/// Of the oscillating modes that matter.
fn least_damping(modes: &[SharedMode]) -> f64 {
    let matter = modes.iter().filter(|m| m.share >= LoopFigures::LEAST_SHARE && m.mode.pole.im > 0.0);
    matter.map(|m| m.mode.zeta).fold(1.0, f64::min)
}
