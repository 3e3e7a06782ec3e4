//! Dual-Youla prediction error: S refined on alpha and beta, and G(S) with it.
//!
//! ```text
//! min over S of sum |beta - S alpha|^2,   or of the innovations of   x+ = A x + B alpha + K e,  beta = C x + D alpha + e
//! ```
//! alpha does not depend on the noise, so that both are consistent in closed loop, for an unstable plant too (25). White
//! output noise n reaches beta through `Mt + S Ut`, which shares A and C with S: for a stable plant the innovation form
//! then is the true one, and its minimum the maximum-likelihood estimate of S. The controller stabilises G(S) exactly when S
//! is stable; the search keeps it so. (Identity: `beta - S alpha = (Mt + S Ut) (y - G(S) u)`.)

use super::refine::{RefineNoise, RefineOptions, RefinedModel, refine};
use crate::Stop;
use crate::{Error, Result};
use serde::Serialize;
use youla::Mat;
use youla::factor::{CoprimeFactors, YoulaSignals};
use youla::identify::hansen::HansenModel;
use youla::identify::innovation_form::InnovationForm;
use youla::identify::subspace::{
    Experiment, Innovation, InputFit, NoInnovation, NoUncertainty, SubspaceModel, Uncertainty,
};
use youla::linalg::{block, check_shape};
use youla::lti::{Discrete, StateSpace, simulate};

/// What a refinement changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Refinement {
    /// The model of the noise of beta.
    pub noise: RefineNoise,
    /// Half the sum of squares of the residuals of beta, each divided by its root mean square before, before.
    pub cost_before: f64,
    /// The same after.
    pub cost: f64,
    /// Fit of the simulated beta before, percent per output.
    pub fit_before: Vec<f64>,
    /// The same after.
    pub fit: Vec<f64>,
    /// Why the search ended.
    pub stop: Stop,
    /// Steps that lowered the criterion.
    pub iterations: usize,
    /// Sets of local coordinates.
    pub charts: usize,
    /// Trial points that were rejected because they were not stable or their simulation was not finite.
    pub diverged: usize,
    /// Whether S is stable, and with it the loop of G(S) and the controller.
    pub stable: bool,
}

/// A refined S and the plant that follows from it, with what the refinement changed.
#[derive(Debug, Clone)]
pub struct RefinedHansen {
    /// The refined S and G(S).
    pub model: HansenModel,
    /// What changed.
    pub refinement: Refinement,
}

/// Refines S on the signals from which it was identified, and recombines it.
///
/// The innovation form begins with K_s of [`HansenModel::innovation_form`] or the Kalman gain of S, at zero where there is none.
/// The uncertainty of the subspace method is that of another fit then, and is refused; [`SubspaceModel::fit`] and
/// [`SubspaceModel::stability`] are those of the refined S. `signals` are those from which S was identified; known disturbances
/// are subtracted from beta with the size that was estimated with S.
///
/// # Errors
/// As [`refine`]; [`youla::Error::Unsupported`] for an S with delays; [`youla::Error::AlgebraicLoop`] when G(S) is not well posed;
/// [`youla::Error::Ports`] and [`youla::Error::Shape`] for other disturbances than those of S.
pub fn refine_hansen(
    found: HansenModel,
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    options: &RefineOptions,
) -> Result<RefinedHansen> {
    if found.deviation.delays.iter().any(|delay| *delay > 0) {
        let (what, instead) = ("the refinement of an S with delays", "leave `refine` or `delays` out");
        return Err(Error::Method(youla::Error::Unsupported { what, instead }));
    }
    let cleaned = without_disturbances(signals, &found.deviation)?;
    let mut experiments = Vec::new();
    for (s, cleaned) in signals.iter().zip(&cleaned) {
        experiments.push(Experiment::new(s.alpha(), cleaned.as_ref().map_or_else(|| s.beta(), |beta| beta.as_ref())));
    }
    let form = found.innovation_form.as_ref().map(|form| form.gain.as_ref());
    let refined =
        refine(&found.deviation.model, form.or_else(|| found.deviation.innovation.gain()), &experiments, options)?;
    let plant = factors.plant_of(&refined.model)?;
    let refinement = Refinement {
        noise: options.noise,
        cost_before: refined.cost_before,
        cost: refined.cost,
        fit_before: refined.fit_before.clone(),
        fit: refined.fit.clone(),
        stop: refined.stop,
        iterations: refined.iterations,
        charts: refined.charts,
        diverged: refined.diverged,
        stable: refined.stable,
    };
    let other = |uncertainty: Uncertainty| match uncertainty {
        Uncertainty::Refused { reason } => Uncertainty::Refused { reason },
        _ => Uncertainty::Refused { reason: NoUncertainty::OtherFit },
    };
    let innovation_form = found.innovation_form.and_then(|form| {
        refined.gain.as_ref().map(|gain| InnovationForm { gain: gain.clone(), from_kalman: None, ..form })
    });
    let uncertainty = found.deviation.uncertainty.clone().map(other);
    let model = HansenModel {
        deviation: SubspaceModel { uncertainty, ..replaced(found.deviation, refined, &experiments)? },
        plant,
        innovation_form,
        uncertainty: found.uncertainty.map(other),
        evidence: found.evidence,
    };
    Ok(RefinedHansen { model, refinement })
}

/// beta less the disturbances that were found with S, for each experiment that has any.
fn without_disturbances(signals: &[YoulaSignals], deviation: &SubspaceModel) -> Result<Vec<Option<Mat<f64>>>> {
    let (expected, found) =
        (deviation.disturbances.len(), signals.iter().filter_map(YoulaSignals::disturbance).count());
    if expected != found {
        let what = "the number of experiments with known disturbances of an S that is to be refined".into();
        return Err(Error::Method(youla::Error::Ports { what, expected, found }));
    }
    let cleaned = |(k, s): (usize, &YoulaSignals)| {
        let Some((known, size)) = s.disturbance().zip(deviation.disturbances.get(k)) else { return Ok(None) };
        check_shape("the known disturbances", known, (s.samples(), size.nrows()))?;
        Ok(Some(s.beta() - known * size))
    };
    signals.iter().enumerate().map(cleaned).collect()
}

/// The evidence of the subspace method with what belongs to the refined model in the place of what belonged to its own.
fn replaced(deviation: SubspaceModel, refined: RefinedModel, experiments: &[Experiment<'_>]) -> Result<SubspaceModel> {
    let mut deviation = deviation;
    deviation.innovation = match &refined.gain {
        Some(gain) => Innovation::Found {
            gain: gain.clone(),
            covariance: innovation_covariance(&refined, gain, experiments)?,
            residual: 0.0,
        },
        None => Innovation::None { reason: NoInnovation::Refined },
    };
    deviation.stability.poles = refined.model.poles()?;
    let worst = refined.model.worst_pole()?;
    deviation.stability.worst = worst.unwrap_or(deviation.stability.worst);
    deviation.stability.stable = refined.stable;
    deviation.fit.by = if refined.gain.is_some() { InputFit::Prediction } else { InputFit::Simulation };
    deviation.fit.percent = refined.prediction_fit;
    deviation.initial_states = refined.initial_states;
    deviation.model = refined.model;
    Ok(deviation)
}

/// Mean of `e e'` over the predictions with `A - K C`.
fn innovation_covariance(refined: &RefinedModel, gain: &Mat<f64>, experiments: &[Experiment<'_>]) -> Result<Mat<f64>> {
    let s = &refined.model;
    let p = s.outputs();
    let input = block(&[&[(s.b() - gain * s.d()).as_ref(), gain.as_ref()]]);
    let direct = block(&[&[s.d(), Mat::zeros(p, p).as_ref()]]);
    let predictor = StateSpace::new(s.a() - gain * s.c(), input, s.c().to_owned(), direct, s.time())?;
    let mut sum = Mat::<f64>::zeros(p, p);
    for (e, x0) in experiments.iter().zip(&refined.initial_states) {
        let error = e.y - simulate(&predictor, block(&[&[e.u, e.y]]).as_ref(), x0)?;
        sum += error.transpose() * &error;
    }
    let samples = experiments.iter().map(|e| e.y.nrows()).sum::<usize>().max(1) as f64;
    Ok(sum * faer::Scale(1.0 / samples))
}
