//! Figures of a loop: the modes that a disturbance at the plant input excites, the peak of the response to it, and the peak
//! of the sensitivity.

use crate::error::Result;
use youla::control::{closed_loop, peak_sensitivity, with_input_port};
use youla::lti::{Discrete, Mode, PeakOptions, SharedMode, StateSpace, frequency_response, hinf_norm};
use youla::{MatRef, c64};

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
        let response = disturbance_response(&plant, &controller)?;
        let modes = loop_modes(&response)?;
        let least_damping = least_damping(&modes);
        let peak_response = hinf_norm(&response, &PeakOptions { tolerance: 1e-6 })?.value;
        Ok(LoopFigures { response, modes, least_damping, peak_response, peak_sensitivity })
    }

    /// Largest gain of the response at angular frequencies.
    ///
    /// # Errors
    /// As [`frequency_response`].
    pub fn gain(&self, omega: &[f64]) -> Result<Vec<f64>> {
        let response = frequency_response(&self.response, omega)?;
        let largest = |g: MatRef<'_, c64>| g.singular_values().map_or(f64::NAN, |s| s.first().copied().unwrap_or(0.0));
        Ok(response.iter().map(largest).collect())
    }
}

/// From a disturbance at the plant input to the outputs, under a controller `u = K y` (positive feedback).
///
/// # Errors
/// Ports, sample times, an algebraic loop.
pub fn disturbance_response(
    plant: &StateSpace<Discrete>,
    controller: &StateSpace<Discrete>,
) -> youla::Result<StateSpace<Discrete>> {
    let (m, p) = (plant.inputs(), plant.outputs());
    Ok(closed_loop(plant, &with_input_port(controller)?)?.part(m..m + p, 0..m))
}

/// The modes below the Nyquist frequency with their shares in the response of all of them, largest first.
///
/// Poles at zero, of dead time, are left out: they have nearly one direction, so that their responses are huge and cancel, and no other
/// mode would have a share beside them.
///
/// # Errors
/// As [`StateSpace::shared_modes`].
pub fn loop_modes(response: &StateSpace<Discrete>) -> youla::Result<Vec<SharedMode>> {
    let nyquist = 0.5 / response.time().ts();
    let mut modes = response.shared_modes()?;
    modes.retain(|m| m.mode.hz <= nyquist);
    let all: f64 = modes.iter().map(|m| m.share).sum();
    modes.iter_mut().for_each(|m| m.share /= if all > 0.0 { all } else { 1.0 });
    Ok(modes)
}

/// Least damping ratio of the oscillating modes with a share of [`LoopFigures::LEAST_SHARE`] or more; 1 where there is none.
pub fn least_damping(modes: &[SharedMode]) -> f64 {
    least_damped(modes).map_or(1.0, |m| m.mode.zeta)
}

/// The mode with that damping.
fn least_damped(modes: &[SharedMode]) -> Option<&SharedMode> {
    let matter = modes.iter().filter(|m| m.share >= LoopFigures::LEAST_SHARE && m.mode.pole.im > 0.0);
    matter.min_by(|a, b| a.mode.zeta.total_cmp(&b.mode.zeta))
}

/// The damping ratio of the least damped mode of a loop, followed to loops near it: that of the pole nearest to its pole. The shares of
/// the modes would jump where a pole of dead time, of order n at zero, splits into a circle of radius `|change|^(1/n)`.
pub(super) fn followed_damping(modes: &[SharedMode]) -> impl Fn(&StateSpace<Discrete>) -> youla::Result<f64> + use<> {
    let pole = least_damped(modes).map(|m| m.mode.pole);
    move |response| {
        let Some(pole) = pole else { return Ok(1.0) };
        let distance = |mode: &Mode| (mode.pole - pole).norm();
        let modes = response.modes()?.into_iter();
        Ok(modes.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(1.0, |nearest| nearest.zeta))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use youla::Mat;

    /// A mode beside a pole near zero with a huge residue, as those of dead time have by rounding.
    #[test]
    fn a_pole_near_zero_hides_no_mode() {
        let time = Discrete::new(1.0).unwrap();
        let a = Mat::from_fn(3, 3, |i, j| [[0.9, 0.3, 0.0], [-0.3, 0.9, 0.0], [0.0, 0.0, 1e-6]][i][j]);
        let (b, c) = (Mat::from_fn(3, 1, |_, _| 1.0), Mat::from_fn(1, 3, |_, j| [1.0, 1.0, 1e6][j]));
        let response = StateSpace::new(a, b, c, Mat::zeros(1, 1), time).unwrap();
        let all = response.shared_modes().unwrap();
        assert_eq!(least_damping(&all), 1.0);
        let modes = loop_modes(&response).unwrap();
        let zeta = all.iter().find(|m| m.mode.pole.im > 0.0).unwrap().mode.zeta;
        assert_eq!((least_damping(&modes), modes.len(), modes[0].share), (zeta, 1, 1.0));
    }

    /// Twelve poles at zero that a change of 1e-4 moves to the radius 0.46 do not change the damping of the mode beside them.
    #[test]
    fn the_damping_of_a_mode_is_that_of_its_pole() {
        let loop_of = |change: f64| {
            let shift = |i: usize, j: usize| f64::from(i == j + 1) + if (i, j) == (0, 11) { change } else { 0.0 };
            let of = |i: usize, j: usize| match (i, j) {
                (0..2, 0..2) => [[0.9, 0.3], [-0.3, 0.9]][i][j],
                (2.., 2..) => shift(i - 2, j - 2),
                _ => 0.0,
            };
            let (b, c) = (Mat::from_fn(14, 1, |_, _| 1.0), Mat::from_fn(1, 14, |_, _| 1.0));
            StateSpace::new(Mat::from_fn(14, 14, of), b, c, Mat::zeros(1, 1), Discrete::new(1.0).unwrap()).unwrap()
        };
        let modes = loop_modes(&loop_of(0.0)).unwrap();
        let damping = followed_damping(&modes);
        let (here, moved) = (damping(&loop_of(0.0)).unwrap(), damping(&loop_of(1e-4)).unwrap());
        assert_eq!(here, least_damping(&modes));
        assert!((here - moved).abs() < 1e-9, "{here} {moved}");
    }
}
