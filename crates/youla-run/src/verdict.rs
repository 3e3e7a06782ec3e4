//! The evidence on every model of a run: fit (26) on verification records, loop certificate, modes.

use super::disturbance::without_lines;
use super::factorise::Factorisation;
use super::noise_models::noise_model;
use super::pipeline::Identification;
use super::records::LoopRecord;
use super::residual_tests::{RecordResiduals, residual_tests};
use super::robustness::{Robustness, channel_scales, robustness};
use super::settings::Prediction;
use crate::{Error, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use youla::control::{ChannelScales, with_input_port};
use youla::lti::{Discrete, Mode, StateSpace};
use youla::validate::{LoopCertificate, LoopExcitation, certify, fit, predict_closed_loop, predict_open_loop, vaf};
use youla::{Mat, MatRef, c64};

/// A model of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// G(0).
    Nominal,
    /// Subspace identification from (u, y).
    Direct,
    /// G(S).
    Hansen,
    /// `G_red(S)`.
    HansenReduced,
    /// The physical structure, by the prediction-error method.
    GreyBox,
    /// The simulated plant itself; in simulations only.
    TruePlant,
}

impl Method {
    /// Key in summary.json and in file names.
    pub fn key(self) -> &'static str {
        match self {
            Method::Nominal => "nominal",
            Method::Direct => "direct",
            Method::Hansen => "hansen",
            Method::HansenReduced => "hansen_reduced",
            Method::GreyBox => "grey_box",
            Method::TruePlant => "true_plant",
        }
    }

    /// Name in tables and figures.
    pub fn label(self) -> &'static str {
        match self {
            Method::Nominal => "nominal G(0)",
            Method::Direct => "direct N4SID",
            Method::Hansen => "Hansen G(S)",
            Method::HansenReduced => "reduced G_red(S)",
            Method::GreyBox => "grey-box PEM",
            Method::TruePlant => "true plant",
        }
    }
}

/// Prediction of one verification record by one model.
#[derive(Debug, Clone)]
pub struct RecordVerdict {
    /// Name of the record.
    pub record: String,
    /// Predicted outputs, samples x p, without known lines, or why there are none (a model that diverges).
    pub predicted: Result<Mat<f64>, String>,
    /// Fit (26) per output, percent, where lines are known without the best of them on either side; NaN where there is no prediction.
    pub fit: Vec<f64>,
    /// Variance accounted for per output, percent, likewise; NaN where there is no prediction.
    pub vaf: Vec<f64>,
    /// Tests of measured less predicted outputs; `None` where there is no prediction.
    pub residuals: Option<RecordResiduals>,
}

/// What is known of one model.
#[derive(Debug, Clone)]
pub struct ModelVerdict {
    /// Which model.
    pub method: Method,
    /// The model.
    pub model: StateSpace<Discrete>,
    /// Its poles.
    pub poles: Vec<c64>,
    /// Its modes.
    pub modes: Vec<Mode>,
    /// Its loop with the controller that ran.
    pub certificate: LoopCertificate,
    /// Margins of that loop, and distances from other models.
    pub robustness: Robustness,
    /// One entry per verification record.
    pub records: Vec<RecordVerdict>,
}

/// The evidence on all models, in the order nominal, direct, Hansen, reduced, grey box.
#[derive(Debug, Clone, Default)]
pub struct Verdict {
    /// One entry per model that exists.
    pub models: Vec<ModelVerdict>,
    /// The sizes by which channels are scaled for b(G, K) and the nu-gap, or why there are none; `None` before any model.
    pub scales: Option<Result<ChannelScales, String>>,
}

impl Verdict {
    /// The entry of a method, `None` where there is no such model.
    pub fn of(&self, method: Method) -> Option<&ModelVerdict> {
        self.models.iter().find(|m| m.method == method)
    }
}

/// Holds every model of a run against the verification records and the controller; models in parallel.
///
/// # Errors
/// Ports or numerical conditions; a prediction that diverges is an outcome, not an error.
pub(super) fn verify(found: &Identification) -> Result<Verdict> {
    let mut models = vec![(Method::Nominal, &found.factorisation.nominal)];
    if let Some(Ok(direct)) = &found.direct {
        models.push((Method::Direct, &direct.model));
    }
    models.push((Method::Hansen, &found.hansen.plant));
    if let Some(Ok(reduction)) = &found.reduction {
        models.push((Method::HansenReduced, &reduction.found.reduction.model));
    }
    if let Some(Ok(grey_box)) = &found.grey_box {
        models.push((Method::GreyBox, &grey_box.found.model.model));
    }
    if let Some(plant) = &found.records.true_plant {
        models.push((Method::TruePlant, plant));
    }
    let scales = channel_scales(&found.records.estimation).map_err(|e| e.to_string());
    let verdicts: Vec<Result<ModelVerdict>> =
        models.par_iter().map(|(method, model)| verify_model(found, &scales, *method, model)).collect();
    Ok(Verdict { models: verdicts.into_iter().collect::<Result<_>>()?, scales: Some(scales) })
}

fn verify_model(
    found: &Identification,
    scales: &Result<ChannelScales, String>,
    method: Method,
    model: &StateSpace<Discrete>,
) -> Result<ModelVerdict> {
    let noise = noise_model(found, method, model)?;
    let verify = |r: &LoopRecord| verify_record(found, model, noise.as_ref(), r);
    let records = found.records.verification.iter().map(verify).collect::<Result<_>>()?;
    Ok(ModelVerdict {
        method,
        model: model.clone(),
        poles: model.poles()?,
        modes: model.modes()?,
        certificate: certify(model, &found.factorisation.controller)?,
        robustness: robustness(found, scales, model),
        records,
    })
}

/// One model on one verification record; `noise` is what it says of its noise.
pub(super) fn verify_record(
    found: &Identification,
    model: &StateSpace<Discrete>,
    noise: Option<&StateSpace<Discrete>>,
    record: &LoopRecord,
) -> Result<RecordVerdict> {
    let lines = record.disturbance.as_ref().map(|w| w.as_ref());
    let measured = without_lines(record.y.as_ref(), lines)?;
    let predicted = match found.settings.verification.prediction {
        Prediction::OpenLoop => predict_open_loop(model, record.u.as_ref(), measured.as_ref()),
        Prediction::ClosedLoop => {
            let Factorisation { factors, controller, .. } = &found.factorisation;
            let ports = if record.alpha.is_some() { factors.j_k()? } else { with_input_port(controller)? };
            let excitation = LoopExcitation {
                input: record.alpha.as_ref().or(record.input_excitation.as_ref()).map(|v| v.as_ref()),
                reference: record.reference.as_ref().map(|r| r.as_ref()),
            };
            predict_closed_loop(model, &ports, excitation, measured.as_ref())
        }
    };
    let skip = found.settings.verification.skip;
    if record.samples() <= skip {
        let what = format!("record {}, of which `skip` in [verification] drops the first {skip}", record.name);
        return Err(Error::Method(youla::Error::TooFewSamples { what, found: record.samples(), needed: skip + 1 }));
    }
    let record_name = record.name.clone();
    match predicted {
        Ok(predicted) => {
            let counted = |m: MatRef<'_, f64>| m.get(skip.., ..).to_owned();
            let lines = lines.map(counted);
            let rest = |m: &Mat<f64>| without_lines(counted(m.as_ref()).as_ref(), lines.as_ref().map(|w| w.as_ref()));
            let (y, yp) = (rest(&record.y)?, rest(&predicted)?);
            let (fit, vaf) = (fit(y.as_ref(), yp.as_ref())?, vaf(y.as_ref(), yp.as_ref())?);
            let residuals = Some(residual_tests(found, record, noise, measured.as_ref(), predicted.as_ref(), skip)?);
            Ok(RecordVerdict { record: record_name, predicted: Ok(predicted), fit, vaf, residuals })
        }
        Err(e @ youla::Error::Diverged { .. }) => {
            let none = vec![f64::NAN; record.y.ncols()];
            let predicted = Err(e.to_string());
            Ok(RecordVerdict { record: record_name, predicted, fit: none.clone(), vaf: none, residuals: None })
        }
        Err(e) => Err(e.into()),
    }
}
