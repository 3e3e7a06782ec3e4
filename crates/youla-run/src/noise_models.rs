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

use super::pipeline::Identification;
use super::settings::Prediction;
use super::verdict::Method;
use crate::Result;
use youla::linalg::{block, eye};
use youla::lti::{Discrete, StateSpace};
use youla::{Mat, MatRef};

/// H of a model from the measured input; `None` where there is none.
///
/// # Errors
/// Ports, and `Mt + S Ut` without invertible feedthrough.
pub(super) fn noise_model(
    found: &Identification,
    method: Method,
    model: &StateSpace<Discrete>,
) -> Result<Option<StateSpace<Discrete>>> {
    if found.settings.verification.prediction == Prediction::ClosedLoop {
        return Ok(None);
    }
    match method {
        Method::Direct => {
            let direct = found.direct.as_ref().and_then(|d| d.as_ref().ok());
            direct.and_then(|d| d.innovation.gain()).map(|gain| innovations(model, gain)).transpose()
        }
        Method::GreyBox => {
            let run = found.grey_box.as_ref().and_then(|run| run.as_ref().ok());
            run.and_then(|run| run.found.model.gain.as_ref()).map(|gain| innovations(model, gain.as_ref())).transpose()
        }
        Method::Hansen => {
            let (hansen, factors) = (&found.hansen, &found.factorisation.factors);
            let form = hansen.innovation_form.as_ref().map(|form| form.gain.as_ref());
            let Some(gain) = form.or_else(|| hansen.deviation.innovation.gain()) else { return Ok(None) };
            let s = &hansen.deviation.model;
            Ok(factors.noise_of(s, &innovations(s, gain)?).map(Some)?)
        }
        Method::Nominal | Method::HansenReduced | Method::TruePlant => Ok(None),
    }
}

/// `I + C (z I - A)^-1 K`; states beyond those of the gain are delays of inputs, which noise does not enter.
fn innovations(model: &StateSpace<Discrete>, gain: MatRef<'_, f64>) -> Result<StateSpace<Discrete>> {
    let delays = Mat::<f64>::zeros(model.order() - gain.nrows(), gain.ncols());
    let k = block(&[&[gain], &[delays.as_ref()]]);
    Ok(StateSpace::new(model.a().to_owned(), k, model.c().to_owned(), eye(model.outputs()), model.time())?)
}
