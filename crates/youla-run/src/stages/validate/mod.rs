//! The evidence on every model of a run: fit (26) on verification records, loop certificate, modes.

pub(crate) mod noise_models;
pub(crate) mod residuals;
pub(crate) mod robustness;

use crate::method::Method;
use crate::records::disturbance::without_lines;
use crate::settings::PredictionKind;
use crate::stages::context::RunContext;
use crate::stages::grey_box::GreyBoxRun;
use crate::stages::reduction::RunReduction;
use crate::stages::validate::noise_models::{
    noise_of_direct, noise_of_hansen, noise_of_recommended, noise_of_structure,
};
use crate::stages::validate::residuals::{RecordResiduals, residual_tests};
use crate::stages::validate::robustness::{LoopRobustness, channel_scales, robustness};
use crate::{Error, Result};
use rayon::prelude::*;
use youla::control::{ChannelScales, with_input_port};
use youla::identify::hansen::HansenModel;
use youla::identify::likelihood::Recommendation;
use youla::identify::subspace::SubspaceModel;
use youla::lti::{Discrete, Mode, StateSpace, VisibleMode, VisibleModes};
use youla::signal::LoopRecord;
use youla::validate::{LoopCertificate, LoopExcitation, certify, fit, predict_closed_loop, predict_open_loop, vaf};
use youla::{Mat, MatRef, c64};

/// Prediction of one verification record by one model.
#[derive(Debug, Clone)]
pub struct RecordValidation {
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
pub struct ModelValidation {
    /// Which model.
    pub method: Method,
    /// The model.
    pub model: StateSpace<Discrete>,
    /// Its poles.
    pub poles: Vec<c64>,
    /// Its modes.
    pub modes: Vec<Mode>,
    /// Those that its response shows; absent where its eigenvectors were not found.
    pub visible: Option<VisibleModes>,
    /// Its loop with the controller that ran.
    pub certificate: LoopCertificate,
    /// Margins of that loop, and distances from other models.
    pub robustness: LoopRobustness,
    /// One entry per verification record.
    pub records: Vec<RecordValidation>,
}

impl ModelValidation {
    /// The mode of a pole and its residue, where the response shows it.
    pub(crate) fn visible_residue(&self, pole: c64) -> Option<&[c64]> {
        match &self.visible {
            None => Some(&[]),
            Some(visible) => residue_at(visible, pole),
        }
    }
}

/// Two computations of one pole differ by less, two poles by more; close to a double pole neither holds.
const ONE_POLE: f64 = 1e-5;

/// Residue of the visible mode of this pole.
pub(crate) fn residue_at(visible: &VisibleModes, pole: c64) -> Option<&[c64]> {
    let at = |mode: &&VisibleMode| (mode.mode.pole - pole).norm() < ONE_POLE;
    visible.modes.iter().find(at).map(|mode| mode.residue.as_slice())
}

/// The evidence on all models, in the order nominal, direct, Hansen, reduced, grey box.
#[derive(Debug, Clone)]
pub struct Validation {
    /// What drove the models on the verification records.
    pub prediction: PredictionKind,
    /// One entry per model that exists.
    pub models: Vec<ModelValidation>,
    /// The sizes by which channels are scaled for b(G, K) and the nu-gap, or why there are none.
    pub scales: Result<ChannelScales, String>,
}

impl Validation {
    /// The entry of a method, `None` where there is no such model.
    pub fn of(&self, method: Method) -> Option<&ModelValidation> {
        self.models.iter().find(|m| m.method == method)
    }
}

/// The models that a run identified; nominal model and true plant are in its records and factors.
pub(crate) struct Candidates<'a> {
    /// The recommended model, where there is one.
    pub(crate) recommended: Option<&'a Recommendation>,
    /// S and G(S), where the scheme gave them.
    pub(crate) hansen: Option<&'a HansenModel>,
    /// The direct model, where there is one.
    pub(crate) direct: Option<&'a SubspaceModel>,
    /// The reduced model, where there is one.
    pub(crate) reduction: Option<&'a RunReduction>,
    /// The physical structure, where it has an estimate.
    pub(crate) grey_box: Option<&'a GreyBoxRun>,
}

/// A model with what it states of its noise.
struct Candidate<'a> {
    method: Method,
    model: &'a StateSpace<Discrete>,
    noise: Option<StateSpace<Discrete>>,
}

impl<'a> Candidates<'a> {
    /// The models that were identified.
    pub(crate) fn identified(&self) -> Vec<&'a StateSpace<Discrete>> {
        let recommended = self.recommended.map(|r| &r.plant);
        let direct = self.direct.map(|d| &d.model);
        let reduced = self.reduction.map(|r| &r.found.reduction.model);
        let physical = self.grey_box.map(|g| &g.found.model.model);
        [recommended, self.hansen.map(|h| &h.plant), direct, reduced, physical].into_iter().flatten().collect()
    }

    /// In the order recommended, nominal, direct, Hansen, reduced, grey box, true plant.
    fn all(&self, run: RunContext<'a>) -> Result<Vec<Candidate<'a>>> {
        let prediction = run.prediction();
        let plain = |method, model| Candidate { method, model, noise: None };
        let mut all = Vec::new();
        if let Some(found) = self.recommended {
            let noise = noise_of_recommended(prediction, found)?;
            all.push(Candidate { method: Method::Likelihood, model: &found.plant, noise });
        }
        all.extend(run.declared.nominal.as_ref().map(|nominal| plain(Method::Nominal, nominal)));
        if let Some(direct) = self.direct {
            let noise = noise_of_direct(prediction, direct)?;
            all.push(Candidate { method: Method::Direct, model: &direct.model, noise });
        }
        if let Some((hansen, factorisation)) = self.hansen.zip(run.factorisation) {
            let noise = noise_of_hansen(prediction, &factorisation.factors, hansen)?;
            all.push(Candidate { method: Method::Hansen, model: &hansen.plant, noise });
        }
        all.extend(self.reduction.map(|r| plain(Method::HansenReduced, &r.found.reduction.model)));
        if let Some(GreyBoxRun { found, .. }) = self.grey_box {
            let noise = noise_of_structure(prediction, &found.model)?;
            all.push(Candidate { method: Method::GreyBox, model: &found.model.model, noise });
        }
        all.extend(run.records.true_plant.as_ref().map(|plant| plain(Method::TruePlant, plant)));
        Ok(all)
    }
}

/// Compares every model of a run with the verification records and closes its loop with the controller; models in parallel.
///
/// # Errors
/// Ports or numerical conditions; a prediction that diverges is an outcome, not an error.
pub(crate) fn verify(run: RunContext<'_>, candidates: &Candidates<'_>) -> Result<Validation> {
    let scales = channel_scales(run.records).map_err(|e| e.to_string());
    let recommended = candidates.recommended.map(|r| &r.plant);
    let all = candidates.all(run)?;
    let models: Vec<Result<ModelValidation>> =
        all.par_iter().map(|candidate| verify_model(run, &scales, recommended, candidate)).collect();
    Ok(Validation { prediction: run.prediction(), models: models.into_iter().collect::<Result<_>>()?, scales })
}

fn verify_model(
    run: RunContext<'_>,
    scales: &Result<ChannelScales, String>,
    recommended: Option<&StateSpace<Discrete>>,
    Candidate { method, model, noise }: &Candidate<'_>,
) -> Result<ModelValidation> {
    let verify = |r: &LoopRecord| verify_record(run, model, noise.as_ref(), r);
    let records = run.records.verification.iter().map(verify).collect::<Result<_>>()?;
    Ok(ModelValidation {
        method: *method,
        model: (*model).clone(),
        poles: model.poles()?,
        modes: model.modes()?,
        visible: model.visible_modes().ok(),
        certificate: certify(model, run.declared.controller())?,
        robustness: robustness(run.declared, scales, recommended, model),
        records,
    })
}

/// One model on one verification record; `noise` is what it says of its noise.
pub(crate) fn verify_record(
    run: RunContext<'_>,
    model: &StateSpace<Discrete>,
    noise: Option<&StateSpace<Discrete>>,
    record: &LoopRecord,
) -> Result<RecordValidation> {
    let lines = record.disturbance();
    let measured = without_lines(record.y(), lines)?;
    let predicted = match run.prediction() {
        PredictionKind::OpenLoop => predict_open_loop(model, record.u(), measured.as_ref()),
        PredictionKind::ClosedLoop => {
            let factors = run.factorisation.filter(|_| record.alpha().is_some()).map(|f| &f.factors);
            let ports = factors.map_or_else(|| with_input_port(run.declared.controller()), |f| f.j_k())?;
            let excitation =
                LoopExcitation { input: record.alpha().or(record.input_excitation()), reference: record.reference() };
            predict_closed_loop(model, &ports, excitation, measured.as_ref())
        }
    };
    let skip = run.settings.verification.skip;
    if record.samples() <= skip {
        let what = format!("record {}, of which `skip` in [verification] drops the first {skip}", record.name());
        return Err(Error::Method(youla::Error::TooFewSamples { what, found: record.samples(), needed: skip + 1 }));
    }
    let record_name = record.name().to_owned();
    match predicted {
        Ok(predicted) => {
            let lines = lines.map(|w| w.get(skip.., ..));
            let rest = |m: MatRef<'_, f64>| without_lines(m.get(skip.., ..), lines);
            let (y, yp) = (rest(record.y())?, rest(predicted.as_ref())?);
            let (fit, vaf) = (fit(y.as_ref(), yp.as_ref())?, vaf(y.as_ref(), yp.as_ref())?);
            let residuals = Some(residual_tests(run, record, noise, measured.as_ref(), predicted.as_ref())?);
            Ok(RecordValidation { record: record_name, predicted: Ok(predicted), fit, vaf, residuals })
        }
        Err(e @ youla::Error::Diverged { .. }) => {
            let none = vec![f64::NAN; record.outputs()];
            let predicted = Err(e.to_string());
            Ok(RecordValidation { record: record_name, predicted, fit: none.clone(), vaf: none, residuals: None })
        }
        Err(e) => Err(e.into()),
    }
}
