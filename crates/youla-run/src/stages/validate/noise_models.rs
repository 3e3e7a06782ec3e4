//! The noise that the models of a run state themselves, as `y = G u + H e` with white innovations e.
//!
//! ```text
//! Kalman gain K of a model (direct identification, grey box in innovation form):   H = I + C (z I - A)^-1 K
//! Kalman gain K of S:                                                              H = (Mt + S Ut)^-1 (I + C (z I - A)^-1 K)
//! ```
//!
//! The nominal and the reduced model have none, nor has a model for output error. Under `prediction = "closed-loop"` the residual is
//! `(I - G K)^-1 H e`, K the controller, and its predictor has the poles of the controller: it forgets its start only where the
//! controller is stable by itself, which one that integrates is not. There, none is used.

use crate::Result;
use crate::settings::PredictionKind;
use youla::factor::CoprimeFactors;
use youla::identify::hansen::HansenModel;
use youla::identify::likelihood::Recommendation;
use youla::identify::subspace::SubspaceModel;
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};
use youla_greybox::GreyBoxModel;

/// H of the direct model, from its Kalman gain.
///
/// # Errors
/// Ports.
pub(crate) fn noise_of_direct(
    prediction: PredictionKind,
    direct: &SubspaceModel,
) -> Result<Option<StateSpace<Discrete>>> {
    let gain = direct.innovation.gain().filter(|_| prediction == PredictionKind::OpenLoop);
    gain.map(|gain| innovations(&direct.model, gain)).transpose()
}

/// H of the recommended model, from the gain of its predictor.
///
/// # Errors
/// Ports.
pub(crate) fn noise_of_recommended(
    prediction: PredictionKind,
    found: &Recommendation,
) -> Result<Option<StateSpace<Discrete>>> {
    let predictor = &found.predictor;
    let Some(gain) = predictor.k.as_ref().filter(|_| prediction == PredictionKind::OpenLoop) else { return Ok(None) };
    let one = eye(predictor.c.nrows());
    let h = StateSpace::new(predictor.a.clone(), gain.clone(), predictor.c.clone(), one, found.plant.time())?;
    Ok(Some(h))
}

/// H of a physical structure in innovation form.
///
/// # Errors
/// Ports.
pub(crate) fn noise_of_structure(
    prediction: PredictionKind,
    found: &GreyBoxModel,
) -> Result<Option<StateSpace<Discrete>>> {
    let gain = found.gain.as_ref().filter(|_| prediction == PredictionKind::OpenLoop);
    gain.map(|gain| innovations(&found.model, gain.as_ref())).transpose()
}

/// H of G(S), from the gain of S.
///
/// # Errors
/// Ports, and `Mt + S Ut` without invertible feedthrough.
pub(crate) fn noise_of_hansen(
    prediction: PredictionKind,
    factors: &CoprimeFactors<Discrete>,
    hansen: &HansenModel,
) -> Result<Option<StateSpace<Discrete>>> {
    let gain = hansen.deviation.innovation.gain().filter(|_| prediction == PredictionKind::OpenLoop);
    let Some(gain) = gain else { return Ok(None) };
    let s = &hansen.deviation.model;
    Ok(factors.noise_of(s, &innovations(s, gain)?).map(Some)?)
}

/// `I + C (z I - A)^-1 K`; states beyond those of the gain are delays of inputs, which noise does not enter.
fn innovations(model: &StateSpace<Discrete>, gain: MatRef<'_, f64>) -> Result<StateSpace<Discrete>> {
    let delays = Mat::<f64>::zeros(model.order() - gain.nrows(), gain.ncols());
    let k = block(&[&[gain], &[delays.as_ref()]]);
    Ok(StateSpace::new(model.a().to_owned(), k, model.c().to_owned(), eye(model.outputs()), model.time())?)
}
