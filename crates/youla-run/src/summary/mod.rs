//! summary.json: the contract for scripts, as one type.

pub(crate) mod certificate;
pub(crate) mod entries;
pub(crate) mod model;
pub(crate) mod physical;
pub(crate) mod pid;
pub(crate) mod recommended;
pub(crate) mod redesign;
pub(crate) mod reduction;
pub(crate) mod robustness;

use crate::check::DataCheckEntry;
use crate::method::Method;
use crate::result::Identification;
use crate::stages::clock::StageTimes;
use crate::{Error, Result};
use certificate::CertificateEntry;
use entries::{OrRefused, finite};
use model::ModelEntry;
use pid::PidEntry;
use recommended::RecommendedEntry;
use redesign::RedesignEntry;
use reduction::ReductionEntry;
use robustness::ScalesEntry;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Version of the layout of summary.json.
const SUMMARY_SCHEMA: u32 = 4;

/// summary.json. A number that does not exist is `null`.
///
/// A method or an indirect response that is impossible is listed under `refused` with its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// Version of this layout: 4.
    pub schema: u32,
    /// Name of the machine or experiment.
    pub name: String,
    /// The model that the run recommends; `null` where no candidate survives (the reason is under `refused`).
    pub recommended: Option<RecommendedEntry>,
    /// The nominal model G(0).
    pub nominal: Option<ModelEntry>,
    /// The identified models by method: `likelihood`, `hansen`, `hansen_reduced`, `direct`, `grey_box`.
    pub methods: BTreeMap<String, ModelEntry>,
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
    pub true_plant: Option<ModelEntry>,
    /// The sizes by which channels are scaled for `coprime_margin` and the nu-gaps.
    pub channel_scales: OrRefused<ScalesEntry>,
    /// The loop of G(S); `null` where the scheme gave none.
    pub certificate: Option<CertificateEntry>,
    /// What speaks against a new controller that is designed on this run, a sentence each.
    #[serde(default)]
    pub doubts: Vec<String>,
    /// The new controller, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub redesign: Option<RedesignEntry>,
    /// The new PID, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pid: Option<PidEntry>,
    /// The reduction, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduction: Option<ReductionEntry>,
}

/// The summary of a run.
///
/// # Errors
/// Those of the frequency responses, modes and derived quantities.
pub fn summary(run: &Identification, seconds: &StageTimes) -> Result<Summary> {
    let mut methods = BTreeMap::new();
    for v in &run.validation.models {
        methods.insert(v.method.key().to_owned(), ModelEntry::new(run, v)?);
    }
    let [nominal, true_plant] = [Method::Nominal, Method::TruePlant].map(|given| methods.remove(given.key()));
    Ok(Summary {
        schema: SUMMARY_SCHEMA,
        name: run.settings.name.clone(),
        recommended: run.recommended.as_ref().ok().map(RecommendedEntry::from),
        nominal,
        methods,
        refused: run.refusals().into_iter().map(|r| (r.key.to_owned(), r.error.to_string())).collect(),
        data: run.data.entry(),
        bezout_residual: run.filtered.as_ref().ok().and_then(|f| finite(f.factorisation.bezout_residual)),
        controller_mismatch: run.controller_mismatch().and_then(finite),
        seconds: seconds.iter().map(|(stage, seconds)| (stage.name().to_owned(), *seconds)).collect(),
        true_plant,
        channel_scales: robustness::scales(run),
        certificate: run.certified().map(CertificateEntry::from),
        doubts: run.doubts(),
        redesign: run.new_controller().map(RedesignEntry::from),
        pid: run.new_pid().map(PidEntry::from),
        reduction: run.reduced().map(ReductionEntry::from),
    })
}

impl Summary {
    /// The entry of a model, where the run has it.
    pub fn model(&self, method: Method) -> Option<&ModelEntry> {
        match method {
            Method::Nominal => self.nominal.as_ref(),
            Method::TruePlant => self.true_plant.as_ref(),
            identified => self.methods.get(identified.key()),
        }
    }

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
