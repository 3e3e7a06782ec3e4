//! The residual of every model on every verification record: correlations with what excites the loop, fits some steps ahead.

use super::artefacts::Provenance;
use super::pipeline::Identification;
use super::records::{LoopRecord, channels_of};
use super::settings::Prediction;
use super::verdict::ModelVerdict;
use crate::{Error, Result};
use serde::Serialize;
use serde_json::{Value, json};
use youla::linalg::block;
use youla::lti::{Discrete, StateSpace};
use youla::validate::{
    PREDICTION_STEPS, RESIDUAL_LAGS, ResidualCorrelations, k_step_fits, k_step_fits_by_noise, residual_correlations,
};
use youla::{Mat, MatRef};
use youla_report::data as draw;

/// The residual of one model on one record.
#[derive(Debug, Clone, Serialize)]
pub struct RecordResiduals {
    /// Names of the signals with which it is correlated.
    pub excitations: Vec<String>,
    /// Whether these come from outside of the loop. Otherwise they are the inputs, which hold fed-back noise, and judge
    /// nothing.
    pub external: bool,
    /// The correlations.
    pub correlations: ResidualCorrelations,
    /// Fits in percent over the second half: per [`PREDICTION_STEPS`] and last for the simulation, per output.
    pub k_step_fits: Vec<Vec<f64>>,
    /// What foresees the residual of the simulation in them.
    pub predictor: Foresight,
}

/// What foresees the residual of a simulation some steps ahead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Foresight {
    /// The noise model of the model itself, from its Kalman gain or that of S.
    Kalman,
    /// An autoregression of the residual.
    Autoregression,
}

impl Foresight {
    fn words(self) -> &'static str {
        match self {
            Foresight::Kalman => "Kalman gain",
            Foresight::Autoregression => "autoregression",
        }
    }
}

impl RecordResiduals {
    /// Whether the residual does not depend on past excitation; `None` where nothing from outside is known.
    pub fn independent(&self) -> Option<bool> {
        self.external.then_some(self.correlations.independent)
    }
}

/// Tests measured less predicted outputs, samples x p, without the first `skip` samples; `noise` is what the model says of
/// its noise.
pub(super) fn residual_tests(
    found: &Identification,
    record: &LoopRecord,
    noise: Option<&StateSpace<Discrete>>,
    measured: MatRef<'_, f64>,
    predicted: MatRef<'_, f64>,
    skip: usize,
) -> Result<RecordResiduals> {
    let data = &found.settings.data;
    let moving = |x: &Mat<f64>| x.col_iter().all(|c| c.iter().any(|v| *v != c[0]));
    let known = [
        (&record.alpha, &data.alpha),
        (&record.input_excitation, &data.input_excitation),
        (&record.reference, &data.reference),
    ];
    let known: Vec<_> =
        known.into_iter().filter_map(|(x, specs)| x.as_ref().filter(|x| moving(x)).map(|x| (x, specs))).collect();
    // Without feedback the inputs come from outside.
    let external = !known.is_empty() || found.factorisation.controller.is_zero();
    let (x, channels) = match known.is_empty() {
        false => {
            let parts: Vec<MatRef<'_, f64>> = known.iter().map(|(x, _)| x.as_ref()).collect();
            (block(&[&parts]), known.iter().flat_map(|(_, specs)| channels_of(specs)).collect())
        }
        true => (record.u.clone(), found.records.inputs.clone()),
    };
    let rest = |m: MatRef<'_, f64>| m.get(skip.., ..).to_owned();
    let e = rest((measured - predicted).as_ref());
    let (k_step_fits, predictor) = fits_ahead(rest(measured).as_ref(), rest(predicted).as_ref(), noise)?;
    Ok(RecordResiduals {
        excitations: channels.into_iter().map(|c| c.name).collect(),
        external,
        correlations: residual_correlations(e.as_ref(), rest(x.as_ref()).as_ref())?,
        k_step_fits,
        predictor,
    })
}

/// By the noise model where there is one with a stable predictor, else by an autoregression.
fn fits_ahead(
    measured: MatRef<'_, f64>,
    predicted: MatRef<'_, f64>,
    noise: Option<&StateSpace<Discrete>>,
) -> Result<(Vec<Vec<f64>>, Foresight)> {
    match noise.map(|noise| k_step_fits_by_noise(measured, predicted, noise)) {
        Some(Ok(fits)) => Ok((fits, Foresight::Kalman)),
        Some(Err(error)) if !matches!(error, youla::Error::Unstable { .. } | youla::Error::Singular { .. }) => {
            Err(error.into())
        }
        _ => Ok((k_step_fits(measured, predicted)?, Foresight::Autoregression)),
    }
}

/// Keys of the fits some steps ahead.
fn step_keys() -> Vec<String> {
    PREDICTION_STEPS.iter().map(usize::to_string).chain(["simulation".to_owned()]).collect()
}

/// What summary.json says of a model, by record.
pub(super) fn summary_entry(v: &ModelVerdict) -> Value {
    let entry = |r: &RecordResiduals| {
        let fits: serde_json::Map<_, _> = step_keys().into_iter().zip(r.k_step_fits.iter().map(|f| json!(f))).collect();
        json!({
            "independent": r.independent(),
            "largest": r.correlations.largest,
            "k_step_fits": fits,
            "predictor": r.predictor,
        })
    };
    v.records
        .iter()
        .filter_map(|r| Some((r.record.clone(), entry(r.residuals.as_ref()?))))
        .collect::<serde_json::Map<_, _>>()
        .into()
}

/// `7-validate/residuals.json`.
pub(super) fn artefact(found: &Identification, provenance: &Provenance) -> Value {
    let models: serde_json::Map<_, _> = found
        .verdict
        .models
        .iter()
        .map(|v| {
            let records: serde_json::Map<_, _> =
                v.records.iter().filter_map(|r| Some((r.record.clone(), json!(r.residuals.as_ref()?)))).collect();
            (v.method.key().to_owned(), records.into())
        })
        .collect();
    json!({"lags": RESIDUAL_LAGS, "steps": step_keys(), "models": models, "provenance": provenance})
}

/// What the report draws.
pub(super) fn drawn(found: &Identification) -> Option<draw::Residuals> {
    let mut tests = Vec::new();
    for v in &found.verdict.models {
        for record in &v.records {
            let Some(r) = &record.residuals else { continue };
            tests.push(draw::ResidualTest {
                record: record.record.clone(),
                method: v.method.key().into(),
                excitations: r.excitations.clone(),
                independent: r.independent(),
                auto: r
                    .correlations
                    .auto
                    .iter()
                    .map(|values| draw::Correlation::new(values, r.correlations.auto_band))
                    .collect(),
                cross: r.correlations.cross.iter().map(|c| draw::Correlation::new(&c.values, c.band)).collect(),
                k_step_fits: r
                    .k_step_fits
                    .iter()
                    .map(|f| f.iter().map(|f| f.is_finite().then_some(*f)).collect())
                    .collect(),
                predictor: r.predictor.words().into(),
            });
        }
    }
    let of = match found.settings.verification.prediction {
        Prediction::OpenLoop => "the simulation from the measured input",
        Prediction::ClosedLoop => "the simulation under the controller from the known excitations",
    };
    (!tests.is_empty()).then(|| draw::Residuals {
        prediction: of.into(),
        external: found
            .verdict
            .models
            .iter()
            .flat_map(|v| &v.records)
            .filter_map(|r| r.residuals.as_ref())
            .all(|r| r.external),
        steps: PREDICTION_STEPS.to_vec(),
        tests,
    })
}
