//! The residual of every model on every verification record: correlations with what excites the loop, fits some steps ahead.

use crate::Result;
use crate::records::channels_of;
use crate::stages::context::RunContext;
use serde::{Deserialize, Serialize};
use youla::MatRef;
use youla::linalg::block;
use youla::lti::{Discrete, StateSpace};
use youla::signal::LoopRecord;
use youla::validate::{
    PREDICTION_STEPS, ResidualCorrelations, k_step_fits, k_step_fits_by_noise, residual_correlations,
};

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
    /// Fits in percent over the second half: per [`youla::validate::PREDICTION_STEPS`] and last for the simulation, per output.
    pub k_step_fits: Vec<Vec<f64>>,
    /// What predicts the residual of the simulation in them.
    pub predictor: ResidualPredictor,
}

/// What predicts the residual of a simulation some steps ahead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ResidualPredictor {
    /// The noise model of the model itself, from its Kalman gain or that of S.
    Kalman,
    /// An autoregression of the residual.
    Autoregression,
}

impl RecordResiduals {
    /// Whether the residual does not depend on past excitation; `None` where nothing from outside is known.
    pub(crate) fn independent(&self) -> Option<bool> {
        self.external.then_some(self.correlations.independent)
    }
}

/// Tests measured less predicted outputs, samples x p, without the first samples that do not count; `noise` is what the model
/// states of its noise.
pub(crate) fn residual_tests(
    run: RunContext<'_>,
    record: &LoopRecord,
    noise: Option<&StateSpace<Discrete>>,
    measured: MatRef<'_, f64>,
    predicted: MatRef<'_, f64>,
) -> Result<RecordResiduals> {
    let (data, skip) = (&run.settings.data, run.settings.verification.skip);
    let moving = |x: &MatRef<'_, f64>| x.col_iter().all(|c| c.iter().any(|v| *v != c[0]));
    let known = [
        (record.alpha(), &data.alpha),
        (record.input_excitation(), &data.input_excitation),
        (record.reference(), &data.reference),
    ];
    let known: Vec<_> = known.into_iter().filter_map(|(x, specs)| Some((x.filter(moving)?, specs))).collect();
    // Without feedback the inputs come from outside.
    let external = !known.is_empty() || run.declared.controller().is_zero();
    let (x, channels) = match known.is_empty() {
        false => {
            let parts: Vec<MatRef<'_, f64>> = known.iter().map(|(x, _)| *x).collect();
            (block(&[&parts]), known.iter().flat_map(|(_, specs)| channels_of(specs)).collect())
        }
        true => (record.u().to_owned(), run.records.inputs.clone()),
    };
    let (measured, predicted) = (measured.get(skip.., ..), predicted.get(skip.., ..));
    let e = measured - predicted;
    let (k_step_fits, predictor) = fits_ahead(measured, predicted, noise)?;
    Ok(RecordResiduals {
        excitations: channels.into_iter().map(|c| c.name).collect(),
        external,
        correlations: residual_correlations(e.as_ref(), x.as_ref().get(skip.., ..))?,
        k_step_fits,
        predictor,
    })
}

/// By the noise model where there is one with a stable predictor, else by an autoregression.
fn fits_ahead(
    measured: MatRef<'_, f64>,
    predicted: MatRef<'_, f64>,
    noise: Option<&StateSpace<Discrete>>,
) -> Result<(Vec<Vec<f64>>, ResidualPredictor)> {
    match noise.map(|noise| k_step_fits_by_noise(measured, predicted, noise)) {
        Some(Ok(fits)) => Ok((fits, ResidualPredictor::Kalman)),
        Some(Err(error)) if !matches!(error, youla::Error::Unstable { .. } | youla::Error::Singular { .. }) => {
            Err(error.into())
        }
        _ => Ok((k_step_fits(measured, predicted)?, ResidualPredictor::Autoregression)),
    }
}

/// Keys of the fits some steps ahead, the simulation last.
pub(crate) fn step_keys() -> Vec<String> {
    PREDICTION_STEPS.iter().map(usize::to_string).chain(["simulation".to_owned()]).collect()
}
