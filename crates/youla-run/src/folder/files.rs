//! What the JSON files of a run folder hold besides models.

use crate::Result;
use crate::folder::artefacts::Provenance;
use crate::records::RunRecords;
use crate::records::segments::RecordSegment;
use crate::result::Identification;
use crate::stages::validate::ModelValidation;
use crate::stages::validate::residuals::{RecordResiduals, step_keys};
use crate::summary::entries::OrRefused;
use crate::summary::model::ModelEntry;
use crate::summary::robustness::{ScalesEntry, scales};
use serde::Serialize;
use std::collections::BTreeMap;
use youla::control::Margins;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla::signal::LoopRecord;
use youla::validate::RESIDUAL_LAGS;
use youla_io::SystemMatrices;
use youla_io::export::{ExportedController, ObserverData};
use youla_loop::redesign::Redesign;

/// What a stage found, and where it comes from.
#[derive(Serialize)]
pub(crate) struct Artefact<'a, T> {
    #[serde(flatten)]
    pub(crate) content: T,
    pub(crate) provenance: &'a Provenance,
}

/// `1-record/records.json`.
#[derive(Serialize)]
pub(crate) struct RecordsFile<'a> {
    sample_time: f64,
    inputs: &'a [Channel],
    outputs: &'a [Channel],
    estimation: Vec<RecordLength<'a>>,
    verification: Vec<RecordLength<'a>>,
    segments: &'a [RecordSegment],
}

#[derive(Serialize)]
pub(crate) struct RecordLength<'a> {
    name: &'a str,
    samples: usize,
}

impl<'a> From<&'a RunRecords> for RecordsFile<'a> {
    fn from(records: &'a RunRecords) -> Self {
        let lengths = |group: &'a [LoopRecord]| {
            group.iter().map(|r| RecordLength { name: r.name(), samples: r.samples() }).collect()
        };
        RecordsFile {
            sample_time: records.time.ts(),
            inputs: &records.inputs,
            outputs: &records.outputs,
            estimation: lengths(&records.estimation),
            verification: lengths(&records.verification),
            segments: &records.segments,
        }
    }
}

/// `details` of `2-factor/left.json` and `right.json`.
#[derive(Serialize)]
pub(crate) struct FactorDetails {
    pub(crate) bezout_residual: f64,
}

/// `3-signals/signals.json`.
#[derive(Serialize)]
pub(crate) struct SignalsFile {
    pub(crate) dropped_samples: usize,
    pub(crate) controller_mismatch: Option<f64>,
}

/// `7-validate/verdict.json`: the entries of summary.json, and all margins with the frequencies at which they are met.
#[derive(Serialize)]
pub(crate) struct VerdictFile<'a> {
    pub(crate) models: BTreeMap<&'a str, ModelEntry>,
    pub(crate) margins: BTreeMap<&'a str, OrRefused<&'a Margins>>,
    pub(crate) channel_scales: OrRefused<ScalesEntry>,
}

impl<'a> VerdictFile<'a> {
    pub(crate) fn new(found: &'a Identification) -> Result<Self> {
        let models = &found.validation.models;
        let entry = |v: &'a ModelValidation| Ok((v.method.key(), ModelEntry::new(found, v)?));
        let margins = |v: &'a ModelValidation| (v.method.key(), OrRefused::new(v.robustness.margins.as_ref()));
        Ok(VerdictFile {
            models: models.iter().map(entry).collect::<Result<_>>()?,
            margins: models.iter().map(margins).collect(),
            channel_scales: scales(found),
        })
    }
}

/// `7-validate/residuals.json`.
#[derive(Serialize)]
pub(crate) struct ResidualsFile<'a> {
    lags: usize,
    steps: Vec<String>,
    models: BTreeMap<&'a str, BTreeMap<&'a str, &'a RecordResiduals>>,
}

impl<'a> From<&'a [ModelValidation]> for ResidualsFile<'a> {
    fn from(models: &'a [ModelValidation]) -> Self {
        let tests = |v: &'a ModelValidation| {
            v.records.iter().filter_map(|r| Some((r.record.as_str(), r.residuals.as_ref()?))).collect()
        };
        let models = models.iter().map(|v| (v.method.key(), tests(v))).collect();
        ResidualsFile { lags: RESIDUAL_LAGS, steps: step_keys(), models }
    }
}

/// The controller as `youla-rt` takes it.
pub(crate) fn exported(records: &RunRecords, redesign: &Redesign) -> ExportedController {
    let new = &redesign.controller;
    ExportedController {
        observer: new.gains.as_ref().map(|g| ObserverData::new(&g.model, g.f.as_ref(), g.l.as_ref())),
        q: new.q.as_ref().map(SystemMatrices::new),
        ..plain(records, redesign.method.key(), &new.computed)
    }
}

/// A controller that is a system and nothing else.
pub(crate) fn plain(records: &RunRecords, method: &str, system: &StateSpace<Discrete>) -> ExportedController {
    ExportedController {
        method: method.into(),
        ts: system.time().ts(),
        measured: records.outputs.clone(),
        commanded: records.inputs.clone(),
        controller: SystemMatrices::new(system),
        observer: None,
        q: None,
    }
}
