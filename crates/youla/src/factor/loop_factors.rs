//! The factors of a nominal model and of the controller that ran, from what a user knows of both.

use super::CoprimeFactors;
use crate::control::{ChannelScales, LqrWeights, RunningController, lqr};
use crate::linalg::eye;
use crate::lti::{Discrete, StateSpace};
use crate::{Mat, Result};

/// Factors of a nominal model and the controller that ran, with balanced states.
///
/// An observer-based controller brings F and L of (13) to (15). For any other controller F is the state feedback of least
/// `sum |y / size|^2 + |u / size|^2`, channels in their `sizes`, and the factors are stacked ([`CoprimeFactors::stacked`]).
///
/// # Errors
/// [`crate::Error::NotStabilising`] with the pole where the controller does not stabilise the nominal model, [`crate::Error::Unstable`]
/// where a gain of an observer does not; ports, shapes.
pub fn loop_factors(
    nominal: &StateSpace<Discrete>,
    controller: &RunningController,
    sizes: &ChannelScales,
) -> Result<CoprimeFactors<Discrete>> {
    let scale = nominal.state_scales()?;
    let balanced = nominal.with_scaled_states(&scale);
    if let Some([f, l]) = controller.gains() {
        crate::linalg::check_shape("the state feedback F", f, (nominal.inputs(), nominal.order()))?;
        crate::linalg::check_shape("the observer gain L", l, (nominal.order(), nominal.outputs()))?;
        let f = Mat::from_fn(f.nrows(), f.ncols(), |i, j| f[(i, j)] * scale[j]);
        let l = Mat::from_fn(l.nrows(), l.ncols(), |i, j| l[(i, j)] / scale[i]);
        return CoprimeFactors::observer(&balanced, f.as_ref(), l.as_ref());
    }
    let diagonal = |sizes: &[f64]| {
        Mat::from_fn(sizes.len(), sizes.len(), |i, j| if i == j { 1.0 / (sizes[i] * sizes[i]) } else { 0.0 })
    };
    let (outputs, inputs) = (diagonal(sizes.outputs()), diagonal(sizes.inputs()));
    let weights = LqrWeights::on_outputs(&balanced, outputs.as_ref(), inputs.as_ref())?;
    let f = lqr(&balanced, &weights).map_err(|e| e.within("state feedback F of the nominal model"))?.f;
    let k = controller.system();
    CoprimeFactors::stacked(&balanced, k, f.as_ref(), controller_feedback(k)?.as_ref())
}

/// State feedback of the controller's own factors: none where it is stable.
fn controller_feedback(k: &StateSpace<Discrete>) -> Result<Mat<f64>> {
    if k.is_stable()? {
        return Ok(Mat::zeros(k.inputs(), k.order()));
    }
    let weights = LqrWeights { q: eye(k.order()), r: eye(k.inputs()), s: None };
    Ok(lqr(k, &weights).map_err(|e| e.within("state feedback of the controller's factors"))?.f)
}
