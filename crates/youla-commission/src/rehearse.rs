//! What the verification will measure: it is rehearsed on the model, with its noise, and evaluated as the record will be.

use crate::figures::{LoopState, Sizes, least_damping};
use crate::identify::{CleanRows, response_to};
use crate::parameter::{NewLoop, at_plant_input};
use crate::{Error, Result};
use faer::Side;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use youla::identify::likelihood::{Predictor, Recommendation};
use youla::linalg::block;
use youla::lti::{Discrete, StateSpace, simulate};
use youla::{Mat, MatRef};
use youla_loop::redesign::disturbance_response;
use youla_twin::RunningLoop;

/// Rehearsals.
const REHEARSALS: usize = 12;
/// Relative standard deviation of a measured damping by what the linear model does not hold. On the twin the scatter over seeds is 1.8 %
/// with the hysteresis of its valves and 0.6 % without, as rehearsed.
const UNMODELLED: f64 = 0.015;
/// Probability with which the interval holds the measurement.
pub const LEVEL: f64 = 0.99;
/// Quantile of Student's distribution with 11 degrees of freedom at 0.995.
const STUDENT: f64 = 3.106;

/// What is predicted of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DampingPrediction {
    /// Least damping of the loop on the model.
    pub damping: f64,
    /// Standard deviation of its measurement.
    pub deviation: f64,
    /// Bounds of its measurement, at the level [`LEVEL`].
    pub bounds: [f64; 2],
    /// Peak of the sensitivity on the model.
    pub sensitivity: f64,
}

/// Predicts a verification with the excitation of a record.
///
/// # Errors
/// Those of the identification of a rehearsal.
pub(crate) fn predict(
    running: &RunningLoop,
    model: &Recommendation,
    new: &NewLoop,
    rows: &CleanRows,
    sizes: Sizes<'_>,
) -> Result<DampingPrediction> {
    let state = LoopState::new(&disturbance_response(&model.plant, &new.controller)?, &new.controller, sizes)?;
    let v = at_plant_input(running, Some(&new.q), &rows.alpha)?;
    let noisy = with_noise(&model.predictor, &new.controller)?;
    let measured: Vec<Result<f64>> = (0..REHEARSALS as u64)
        .into_par_iter()
        .map(|seed| {
            let y = rehearsed(&noisy, v.as_ref(), &model.predictor.covariance, seed)?;
            let measured = response_to(v.as_ref(), y.as_ref(), noisy.time())?.in_units(sizes.input, sizes.output);
            Ok(least_damping(&measured)?)
        })
        .collect();
    let measured: Vec<f64> = measured.into_iter().collect::<Result<_>>()?;
    let (mean, spread) = moments(&measured);
    // A further measurement beside the mean of the rehearsals, the error of the model, and what it does not hold.
    let (of_model, of_rest) = (new.damping_deviation, UNMODELLED * state.damping);
    let deviation =
        (spread * spread * (1.0 + 1.0 / REHEARSALS as f64) + of_model * of_model + of_rest * of_rest).sqrt();
    let half = STUDENT * deviation;
    // The estimate of the loop has a bias that the rehearsals show; it depends on their noise, so both means count.
    let bounds = [mean.min(state.damping) - half, mean.max(state.damping) + half];
    Ok(DampingPrediction { damping: state.damping, deviation, bounds, sensitivity: state.sensitivity })
}

/// The loop from the disturbance at the plant input and the innovations to the outputs.
fn with_noise(model: &Predictor, controller: &StateSpace<Discrete>) -> Result<StateSpace<Discrete>> {
    let (n, m, p) = (model.a.nrows(), model.b.ncols(), model.c.nrows());
    let gain = model.k.clone().unwrap_or_else(|| Mat::zeros(n, p));
    let order = controller.order();
    let a = block(&[
        &[model.a.as_ref(), (&model.b * controller.c()).as_ref()],
        &[(controller.b() * &model.c).as_ref(), controller.a()],
    ]);
    let b = block(&[&[model.b.as_ref(), gain.as_ref()], &[Mat::zeros(order, m).as_ref(), controller.b()]]);
    let c = block(&[&[model.c.as_ref(), Mat::zeros(p, order).as_ref()]]);
    let d = block(&[&[Mat::zeros(p, m).as_ref(), youla::linalg::eye(p).as_ref()]]);
    Ok(StateSpace::new(a, b, c, d, controller.time())?)
}

fn rehearsed(noisy: &StateSpace<Discrete>, v: MatRef<'_, f64>, covariance: &Mat<f64>, seed: u64) -> Result<Mat<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let white = Mat::from_fn(v.nrows(), covariance.nrows(), |_, _| rng.sample::<f64, _>(StandardNormal));
    let root = covariance.llt(Side::Lower).map_err(|_| Error::Controller {
        problem: "cannot be rehearsed: the covariance of the noise is not positive".into(),
    })?;
    let e = white * root.L().transpose();
    let signals = block(&[&[v, e.as_ref()]]);
    Ok(simulate(noisy, signals.as_ref(), &vec![0.0; noisy.order()])?)
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
}
