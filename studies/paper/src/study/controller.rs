//! The controller of one nominal model: LQG, the strongest of a list that keeps a margin.

use super::settings::StudyController;
use crate::{Error, Result};
use faer::Scale;
use youla::control::{LqrWeights, NoiseCovariance, kalman, lqr, peak_sensitivity};
use youla::factor::CoprimeFactors;
use youla::linalg::eye;
use youla::lti::{Discrete, StateSpace};
use youla::{ErrorKind, Mat};

/// An observer-based controller and what it is worth on two plants.
#[derive(Debug, Clone)]
pub struct Design {
    /// F, m x n.
    pub state_feedback: Mat<f64>,
    /// L, n x p.
    pub observer_gain: Mat<f64>,
    /// The factors (13)-(15).
    pub factors: CoprimeFactors<Discrete>,
    /// Weight of the command, per V^2.
    pub command_weight: f64,
    /// Peak of the output sensitivity with the nominal model.
    pub peak_nominal: f64,
    /// Peak of the output sensitivity with the true plant.
    pub peak_plant: f64,
}

/// The design for one weight of the command. `nominal` has the states `[l; l'; m]` of [`youla_twin::rig::Bearing`].
///
/// # Errors
/// Those of the Riccati equations; [`youla::Error::NotStabilising`] naming the plant that is not stabilised.
pub fn design_with(
    nominal: &StateSpace<Discrete>,
    plant: &StateSpace<Discrete>,
    command_weight: f64,
    settings: &StudyController,
) -> Result<Design> {
    let weights = [settings.displacement_weight, settings.velocity_weight, 0.0];
    let n = nominal.order();
    let q = Mat::from_fn(n, n, |i, j| if i == j { weights[i / 2] } else { 0.0 });
    let f = lqr(nominal, &LqrWeights { q, r: eye(2) * Scale(command_weight), s: None })?.f;
    let (w, v) = (eye(2) * Scale(settings.input_noise), eye(2) * Scale(settings.output_noise));
    let l = kalman(nominal, &NoiseCovariance::at_inputs(nominal, w.as_ref(), v.as_ref())?)?.l;
    let factors = CoprimeFactors::observer(nominal, f.as_ref(), l.as_ref())?;
    let controller = factors.controller()?;
    let peak = |model: &StateSpace<Discrete>, name: &str| {
        peak_sensitivity(model, &controller).map_err(|e| match e {
            youla::Error::NotStabilising { pole, .. } => youla::Error::NotStabilising { model: name.into(), pole },
            other => other,
        })
    };
    let (peak_nominal, peak_plant) = (peak(nominal, "the nominal model")?, peak(plant, "the true plant")?);
    Ok(Design { state_feedback: f, observer_gain: l, factors, command_weight, peak_nominal, peak_plant })
}

/// The first of `command_weights` whose controller stabilises both the nominal model and the true plant with a peak of the
/// output sensitivity of at most `settings.peak_sensitivity`.
///
/// # Errors
/// [`Error::NoController`] with the lowest peak that was reached.
pub fn design(
    nominal: &StateSpace<Discrete>,
    plant: &StateSpace<Discrete>,
    command_weights: &[f64],
    settings: &StudyController,
) -> Result<Design> {
    let mut lowest = None;
    for &weight in command_weights {
        let found = match design_with(nominal, plant, weight, settings) {
            Ok(found) => found,
            // Not every weight stabilises both; that is why there are several.
            Err(e)
                if e.kind() == ErrorKind::Numerical
                    || matches!(e, Error::Method(youla::Error::NotStabilising { .. })) =>
            {
                continue;
            }
            Err(e) => return Err(e),
        };
        let peak = found.peak_nominal.max(found.peak_plant);
        if peak <= settings.peak_sensitivity {
            return Ok(found);
        }
        lowest = Some(lowest.map_or(peak, |l: f64| l.min(peak)));
    }
    Err(Error::NoController { tried: command_weights.len(), limit: settings.peak_sensitivity, lowest })
}
