//! F and L on the identified model.

use super::{NewController, RedesignProblem, diagonal};
use crate::error::Result;
use youla::control::{LqrWeights, NoiseCovariance, kalman, lqr, observer_controller};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// An observer-based controller: the model and its gains, positive feedback.
#[derive(Debug, Clone, PartialEq)]
pub struct Gains {
    /// The model that the observer runs, behind the dead time of the machine.
    pub model: StateSpace<Discrete>,
    /// F, m x n.
    pub f: Mat<f64>,
    /// L, n x p.
    pub l: Mat<f64>,
}

/// LQR with weights `1 / size(y)^2` and `weight / size(u)^2`; Kalman predictor with input noise of the size of the inputs and
/// output noise `output_noise size(y)^2`.
pub(super) fn design(problem: &RedesignProblem<'_>, weight: f64, output_noise: f64) -> Result<NewController> {
    let model = problem.model.clone().delayed(problem.delay)?.balanced()?;
    let (u, y) = (problem.input_size, problem.output_size);
    let outputs = diagonal(y.iter().map(|s| 1.0 / (s * s)));
    let inputs = diagonal(u.iter().map(|s| weight / (s * s)));
    let f = lqr(&model, &LqrWeights::on_outputs(&model, outputs.as_ref(), inputs.as_ref())?)?.f;
    let disturbance = diagonal(u.iter().map(|s| s * s));
    let noise = diagonal(y.iter().map(|s| output_noise * s * s));
    let l = observer_gain(&model, disturbance.as_ref(), noise.as_ref())?;
    let computed = observer_controller(&model, f.as_ref(), l.as_ref())?;
    Ok(NewController {
        system: computed.clone().delayed(problem.delay)?,
        computed,
        gains: Some(Gains { model, f, l }),
        q: None,
    })
}

/// The Kalman predictor of a system with noise of the given covariances at its inputs and outputs.
pub(super) fn observer_gain(
    model: &StateSpace<Discrete>,
    disturbance: MatRef<'_, f64>,
    noise: MatRef<'_, f64>,
) -> Result<Mat<f64>> {
    Ok(kalman(model, &NoiseCovariance::at_inputs(model, disturbance, noise)?)?.l)
}
