//! summary.json: the contract for scripts, as one type.

pub(crate) mod entries;
pub(crate) mod recommended;

use crate::check::DataCheckEntry;
use crate::method::Method;
use crate::result::{Identification, found};
use crate::stages::certificate::CertificateEntry;
use crate::stages::clock::StageTimes;
use crate::stages::grey_box::PhysicalEntry;
use crate::stages::nonparametric::LinesEntry;
use crate::stages::redesign::{self, RedesignEntry};
use crate::stages::reduction::ReductionEntry;
use crate::stages::responses::{decibel, model_responses, ports};
use crate::stages::uncertainty::UncertaintyEntry;
use crate::stages::validate::ModelVerdict;
use crate::stages::validate::residuals::ResidualEntry;
use crate::stages::validate::robustness::{RobustnessEntry, ScalesEntry, scales_entry};
use crate::summary::entries::{Fits, ModeEntry, OrRefused, finite, finite_all, pairs};
use crate::summary::recommended::RecommendedEntry;
use crate::{Error, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;
use youla::lti::FrequencyResponse;

/// Version of the layout of summary.json.
pub const SUMMARY_SCHEMA: u32 = 3;

/// summary.json. A number that does not exist is `null`.
///
/// A method or an indirect response that is impossible is listed under `refused` with its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// Version of this layout: 3.
    pub schema: u32,
    /// Name of the machine or experiment.
    pub name: String,
    /// The model that the run recommends; `null` where no candidate survives (the reason is under `refused`).
    pub recommended: Option<RecommendedEntry>,
    /// The nominal model G(0).
    pub nominal: Option<ReferenceEntry>,
    /// The identified models by method: `likelihood`, `hansen`, `hansen_reduced`, `direct`, `grey_box`.
    pub methods: BTreeMap<String, MethodEntry>,
    /// What was asked for but is impossible, with the reason.
    pub refused: BTreeMap<String, String>,
    /// The check of the data.
    pub data: DataCheckEntry,
    /// Largest relative residual of the Bezout identity (15) up to Nyquist.
    pub bezout_residual: Option<f64>,
    /// Relative difference of alpha from what the known excitations cause; `null` where none is known.
    pub controller_mismatch: Option<f64>,
    /// Seconds of each stage.
    pub seconds: BTreeMap<String, f64>,
    /// The simulated plant itself, in simulations only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub true_plant: Option<ReferenceEntry>,
    /// The sizes by which channels are scaled for `coprime_margin` and the nu-gaps.
    pub channel_scales: OrRefused<ScalesEntry>,
    /// The loop of G(S); `null` where the scheme gave none.
    pub certificate: Option<CertificateEntry>,
    /// The new controller, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub redesign: Option<RedesignEntry>,
    /// The reduction, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduction: Option<ReductionEntry>,
    /// The uncertainty of S, where it was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<UncertaintyEntry>,
}

/// A model that was given, not identified.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReferenceEntry {
    /// Fit (26) in percent, per verification record and output.
    pub fit: Fits,
    /// Margins and distances.
    pub robustness: RobustnessEntry,
}

/// An identified model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MethodEntry {
    /// Number of states.
    pub order: usize,
    /// Whether the controller that ran stabilises this model.
    pub stabilised_by_controller: bool,
    /// Fit (26) in percent, per verification record and output.
    pub fit: Fits,
    /// Modes.
    pub modes: Vec<ModeEntry>,
    /// Poles in z, `[re, im]`.
    pub poles: Vec<[f64; 2]>,
    /// Margins and distances.
    pub robustness: RobustnessEntry,
    /// Tests of the residual, per verification record.
    pub residuals: BTreeMap<String, ResidualEntry>,
    /// States of S; `hansen` and `hansen_reduced` only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub s_order: Option<usize>,
    /// Whether S is stable; `hansen` and `hansen_reduced` only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub s_stable: Option<bool>,
    /// The physical structure; `grey_box` only.
    #[serde(flatten)]
    pub physical: Option<PhysicalEntry>,
}

/// One number per frequency, `[output][input][frequency]`.
pub type PortCurves = Vec<Vec<Vec<Option<f64>>>>;

/// response.json: magnitudes of the frequency responses of all models on one grid, in dB; `[output][input][frequency]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResponsesEntry {
    /// Frequencies, Hz.
    pub hz: Vec<f64>,
    /// The non-parametric response, where an excitation is known; `hz` is then its grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub indirect_db: Option<PortCurves>,
    /// Its coherence, `[output][frequency]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coherence: Option<Vec<Vec<Option<f64>>>>,
    /// The plant without a model, where an excitation is known: at its lines, or in windows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lines: Option<LinesEntry>,
    /// `<method>_db` of each model.
    #[serde(flatten)]
    pub models: BTreeMap<String, PortCurves>,
}

/// The summary of a run.
///
/// # Errors
/// Those of the frequency responses, modes and derived quantities.
pub fn summary(run: &Identification, seconds: &StageTimes) -> Result<Summary> {
    let identified = |v: &&ModelVerdict| !matches!(v.method, Method::Nominal | Method::TruePlant);
    let methods = run.verdict.models.iter().filter(identified);
    let methods = methods.map(|v| Ok((v.method.key().to_owned(), method_entry(run, v)?)));
    Ok(Summary {
        schema: SUMMARY_SCHEMA,
        name: run.settings.name.clone(),
        recommended: run.recommended.as_ref().ok().map(RecommendedEntry::from),
        nominal: run.verdict.of(Method::Nominal).map(reference_entry),
        methods: methods.collect::<Result<_>>()?,
        refused: run.refusals().into_iter().map(|r| (r.key.to_owned(), r.error.to_string())).collect(),
        data: run.data.entry(),
        bezout_residual: run.filtered.as_ref().ok().and_then(|f| finite(f.factorisation.bezout_residual)),
        controller_mismatch: run.controller_mismatch().and_then(finite),
        seconds: seconds.iter().map(|(stage, seconds)| (stage.name().to_owned(), *seconds)).collect(),
        true_plant: run.verdict.of(Method::TruePlant).map(reference_entry),
        channel_scales: scales_entry(run),
        certificate: run.scheme().map(|s| s.certificate.entry()),
        redesign: run.new_controller().map(redesign::entry),
        reduction: run.reduced().map(|reduction| reduction.entry()),
        uncertainty: run.scheme().and_then(|s| UncertaintyEntry::new(&s.hansen, &run.settings.hansen.uncertainty)),
    })
}

impl Summary {
    /// Reads the summary.json of a run folder.
    ///
    /// # Errors
    /// [`youla_io::Error::MissingFile`], [`youla_io::Error::Io`]; [`Error::NotASummary`] for another layout.
    pub fn read(run: &Path) -> Result<Self> {
        let path = run.join("summary.json");
        let text = youla_io::read_text(&path)?;
        serde_json::from_str(&text).map_err(|source| Error::NotASummary { path, source })
    }
}

/// As JSON on one line.
impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&serde_json::to_string(self).map_err(|_| std::fmt::Error)?)
    }
}

fn reference_entry(v: &ModelVerdict) -> ReferenceEntry {
    ReferenceEntry { fit: fits(v), robustness: RobustnessEntry::from(&v.robustness) }
}

fn method_entry(run: &Identification, v: &ModelVerdict) -> Result<MethodEntry> {
    let recommended = run.recommended.as_ref().ok().filter(|_| v.method == Method::Likelihood);
    let shown = |mode: &youla::lti::Mode| v.visible_residue(mode.pole).is_some();
    let modes = match (recommended, run.uncertainty(v.method)) {
        (Some(found), _) => RecommendedEntry::from(found).modes,
        (_, Some(known)) => known.modes.iter().filter(|m| shown(&m.mode)).map(ModeEntry::from).collect(),
        _ => v.modes.iter().filter(|m| shown(m)).map(ModeEntry::from).collect(),
    };
    let residuals = v.records.iter().filter_map(|r| Some((r.record.clone(), r.residuals.as_ref()?.into())));
    let s = matches!(v.method, Method::Hansen | Method::HansenReduced)
        .then(|| run.scheme())
        .flatten()
        .map(|s| &s.hansen.deviation);
    let structure = run.structure().filter(|_| v.method == Method::GreyBox);
    Ok(MethodEntry {
        order: v.model.order(),
        stabilised_by_controller: v.certificate.stable,
        fit: fits(v),
        modes,
        poles: pairs(&v.poles),
        robustness: RobustnessEntry::from(&v.robustness),
        residuals: residuals.collect(),
        s_order: s.map(|s| s.model.order()),
        s_stable: s.map(|s| s.stability.stable),
        physical: structure.map(|structure| structure.entry()).transpose()?,
    })
}

fn fits(v: &ModelVerdict) -> Fits {
    v.records.iter().map(|r| (r.record.clone(), finite_all(&r.fit))).collect()
}

/// The frequency responses of a run.
///
/// # Errors
/// As [`youla::lti::frequency_response`].
pub fn responses(run: &Identification) -> Result<ResponsesEntry> {
    let measured = run.indirect.as_ref().and_then(|r| r.as_ref().ok());
    let hz = measured.map_or_else(|| run.hz.clone(), |m| m.response.omega.iter().map(|w| w / TAU).collect());
    let models = model_responses(&run.verdict, &hz)?;
    let outputs = 0..run.records.outputs.len();
    Ok(ResponsesEntry {
        indirect_db: measured.map(|m| curves(&m.response)),
        lines: found(run.lines.as_ref()).map(|lines| LinesEntry::from(&lines.plant)),
        coherence: measured.map(|m| outputs.map(|i| finite_all(m.coherence_y.col_as_slice(i))).collect()),
        models: models.iter().map(|(method, r)| (format!("{}_db", method.key()), curves(r))).collect(),
        hz,
    })
}

/// Magnitudes in dB, `[output][input][frequency]`.
fn curves(response: &FrequencyResponse) -> PortCurves {
    let first = response.at(0);
    let mut all = vec![Vec::new(); first.nrows()];
    for (output, input) in ports(first.nrows(), first.ncols()) {
        let db = response.entry(output, input).iter().map(|v| finite(decibel(v.norm()))).collect();
        all[output].push(db);
    }
    all
}
