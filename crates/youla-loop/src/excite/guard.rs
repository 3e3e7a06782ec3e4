//! The response of the nominal loop to an excitation, and its change under model errors.
//!
//! ```text
//! [u; y] = T_0 alpha          T_0 the nominal model with the controller and its port
//! ```
//!
//! The prediction contains the excitation alone. Noise, unbalance and the operating point add to it.

use super::LoopToExcite;
use super::options::ExciteOptions;
use crate::error::{Error, Result};
use faer::Scale;
use serde::Serialize;
use youla::control::closed_loop;
use youla::linalg::block;
use youla::lti::{Continuous, Discrete, StateSpace, simulate};
use youla::{Mat, MatRef};

/// Fraction to which the response decays after the end of the sequence.
/// The peak that is cut off is below the printed digits of a limit. Chosen, not measured.
const DECAYED: f64 = 1e-8;

/// The prediction of the nominal loop, with what follows the end of the sequence.
pub(super) struct Response {
    /// samples x m.
    pub(super) u: Mat<f64>,
    /// samples x p.
    pub(super) y: Mat<f64>,
}

/// Effect of a model error on the prediction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelErrorEffect {
    /// Relative error theta of (27), applied with both signs.
    pub theta: f64,
    /// Largest predicted magnitude of each input over the perturbed models.
    pub inputs: Vec<f64>,
    /// The same for each output.
    pub outputs: Vec<f64>,
    /// Models whose loop is not stable, for example `A times 1.1`.
    pub unstable: Vec<String>,
    /// Whether A was varied: models with delays or poles on the negative real axis have no matrix A in continuous time.
    pub a_varied: bool,
}

/// The loop of a plant with the controller; alpha and output noise to u and y.
pub(super) fn loop_of(plant: &StateSpace<Discrete>, on: &LoopToExcite) -> Result<StateSpace<Discrete>> {
    let closed = closed_loop(plant, on.controller)?;
    let seen = plant.inputs() + plant.outputs();
    let closed = closed.part(0..seen, 0..closed.inputs());
    closed.require_stable("the nominal model").map_err(|e| match e {
        youla::Error::Unstable { what, pole } => youla::Error::NotStabilising { model: what, pole },
        other => other,
    })?;
    Ok(closed)
}

/// Samples after the sequence until the loop is at rest, at most four times the sequence.
pub(super) fn tail(closed: &StateSpace<Discrete>, samples: usize) -> Result<usize> {
    let slowest = closed.worst_pole()?.map_or(0.0, |p| p.norm());
    let needed = if slowest > 0.0 { DECAYED.ln() / slowest.ln() } else { 0.0 };
    Ok((needed.ceil().max(0.0) as usize).saturating_add(closed.order() + 1).min(4 * samples))
}

/// Simulates from rest.
pub(super) fn respond(closed: &StateSpace<Discrete>, alpha: MatRef<'_, f64>, tail: usize) -> Result<Response> {
    let (m, inputs) = (alpha.ncols(), closed.inputs());
    let noise = Mat::zeros(alpha.nrows(), inputs - m);
    let driving =
        block(&[&[alpha, noise.as_ref()], &[Mat::zeros(tail, m).as_ref(), Mat::zeros(tail, inputs - m).as_ref()]]);
    let z = simulate(closed, driving.as_ref(), &vec![0.0; closed.order()])?;
    Ok(Response { u: z.subcols(0, m).to_owned(), y: z.subcols(m, z.ncols() - m).to_owned() })
}

impl Response {
    /// The response to `factor` times the excitation.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        Response { u: Scale(factor) * &self.u, y: Scale(factor) * &self.y }
    }

    /// Largest magnitudes of u and of y.
    pub(super) fn peaks(&self) -> [Vec<f64>; 2] {
        [&self.u, &self.y].map(|m| m.col_iter().map(|c| c.norm_max()).collect())
    }
}

/// The prediction for models with the relative error theta.
pub(super) fn model_error(
    on: &LoopToExcite,
    alpha: MatRef<'_, f64>,
    options: &ExciteOptions,
) -> Result<ModelErrorEffect> {
    let theta = options.model_error;
    let continuous = on.nominal.inverse_zoh().ok();
    let mut models = Vec::new();
    for factor in [1.0 - theta, 1.0 + theta] {
        if let Some(g) = &continuous {
            let a = Scale(factor) * g.a();
            let scaled = StateSpace::new(a, g.b().to_owned(), g.c().to_owned(), g.d().to_owned(), Continuous)?;
            models.push((format!("A times {factor}"), scaled.zoh(on.nominal.time())?));
        }
        let g = on.nominal;
        let b = Scale(factor) * g.b();
        let scaled = StateSpace::new(g.a().to_owned(), b, g.c().to_owned(), g.d().to_owned(), g.time())?;
        models.push((format!("B times {factor}"), scaled));
    }
    let (m, p) = (on.nominal.inputs(), on.nominal.outputs());
    let mut effect = ModelErrorEffect {
        theta,
        inputs: vec![0.0; m],
        outputs: vec![0.0; p],
        unstable: Vec::new(),
        a_varied: continuous.is_some(),
    };
    for (name, model) in models {
        match loop_of(&model, on) {
            Ok(closed) => {
                let [u, y] = respond(&closed, alpha, tail(&closed, alpha.nrows())?)?.peaks();
                effect.inputs.iter_mut().zip(u).for_each(|(most, peak)| *most = most.max(peak));
                effect.outputs.iter_mut().zip(y).for_each(|(most, peak)| *most = most.max(peak));
            }
            Err(
                Error::Method(youla::Error::NotStabilising { .. }) | Error::Method(youla::Error::AlgebraicLoop { .. }),
            ) => effect.unstable.push(name),
            Err(other) => return Err(other),
        }
    }
    Ok(effect)
}
