//! How near a loop is to instability, in one number.

use super::margins::Loop;
use crate::Result;
use crate::lti::{StateSpace, TimeDomain};

/// Peak over frequency of the largest singular value of the output sensitivity `(I - G K)^-1`, positive feedback `u = K y`.
///
/// Its inverse is the distance of the loop to the critical point. ISO 14839-3 calls a machine on active bearings fit for
/// unlimited operation (zone A) up to 3, that is 9.5 dB. The peak is that of [`crate::lti::hinf_norm`], to 1e-9;
/// [`super::margins()`] gives it with everything else.
///
/// # Errors
/// [`crate::Error::NotStabilising`] with the pole where the loop is unstable; those of [`super::closed_loop`] and
/// [`crate::lti::hinf_norm`].
///
/// ```
/// use youla::{Mat, control::peak_sensitivity, linalg::eye, lti::{Discrete, StateSpace}};
/// let time = Discrete::new(1e-3)?;
/// let plant = StateSpace::new(eye(1), eye(1), eye(1), Mat::zeros(1, 1), time)?;
/// let gain = StateSpace::gain(Mat::from_fn(1, 1, |_, _| -0.5), time)?;
/// // (1 + 0.5 / (z - 1))^-1 is largest at z = -1: 1 / (1 - 0.25).
/// assert!((peak_sensitivity(&plant, &gain)? - 4.0 / 3.0).abs() < 1e-9);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn peak_sensitivity<T: TimeDomain>(plant: &StateSpace<T>, controller: &StateSpace<T>) -> Result<f64> {
    Ok(Loop::new(plant, controller)?.peak(&Loop::output_sensitivity)?.value)
}
