//! How near a loop is to instability.

use super::{closed_loop, with_input_port};
use crate::lti::{Discrete, StateSpace, frequency_response};
use crate::{Error, Result};
use std::f64::consts::PI;

/// Points of the logarithmic grid, from a ten-thousandth of the Nyquist frequency up to it.
const GRID: usize = 200;

/// Peak over frequency of the largest singular value of the output sensitivity `(I - G K)^-1`, positive feedback `u = K y`.
///
/// Its inverse is the distance of the loop to the critical point. ISO 14839-3 calls a machine on active bearings fit for
/// unlimited operation (zone A) up to 3, that is 9.5 dB. The peak is taken over 200 frequencies and those of the closed-loop
/// poles, so it is a lower bound, close because a sharp peak stands at a pole.
///
/// # Errors
/// [`Error::NotStabilising`] with the pole where the loop is unstable; those of [`closed_loop`] and
/// [`frequency_response`].
///
/// ```
/// use youla::{Mat, control::peak_sensitivity, linalg::eye, lti::{Discrete, StateSpace}};
/// let time = Discrete::new(1e-3)?;
/// let plant = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), time)?;
/// let gain = StateSpace::gain(Mat::from_fn(1, 1, |_, _| -0.5), time)?;
/// // (1 + 0.5 / (z - 1))^-1 is largest at z = -1: 1 / (1 - 0.25).
/// assert!((peak_sensitivity(&plant, &gain)? - 4.0 / 3.0).abs() < 1e-6);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn peak_sensitivity(plant: &StateSpace<Discrete>, controller: &StateSpace<Discrete>) -> Result<f64> {
    let closed = closed_loop(plant, &with_input_port(controller)?)?;
    closed.require_stable("the plant").map_err(|e| match e {
        Error::Unstable { what: model, pole } => Error::NotStabilising { model, pole },
        other => other,
    })?;
    let (m, p) = (plant.inputs(), plant.outputs());
    let nyquist = PI / plant.time().ts();
    let grid = (0..GRID).map(|k| nyquist * 1e-4f64.powf(1.0 - (k + 1) as f64 / GRID as f64));
    let at_poles = closed.poles()?.into_iter().map(|pole| pole.arg().abs() / plant.time().ts());
    let omega: Vec<f64> = grid.chain(at_poles).collect();
    let response = frequency_response(&closed.part(m..m + p, m..m + p), &omega)?;
    response.iter().try_fold(0.0f64, |peak, value| {
        let sigma = value.singular_values().map_err(|_| Error::NoConvergence {
            what: "the singular values of the sensitivity".into(),
            iterations: 0,
        })?;
        Ok(peak.max(sigma[0]))
    })
}
