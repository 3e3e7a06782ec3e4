//! What the JSON files of a run folder hold besides models.

use crate::folder::artefacts::Provenance;
use crate::records::segments::RecordSegment;
use crate::records::{LoopRecord, RunRecords};
use crate::stages::validate::residuals::{RecordResiduals, step_keys};
use crate::stages::validate::robustness::{RobustnessFile, ScalesEntry};
use crate::stages::validate::{ModelVerdict, RecordVerdict};
use crate::summary::entries::{ModeEntry, OrRefused, finite_all, pairs};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::signal::Channel;
use youla::validate::RESIDUAL_LAGS;

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
            group.iter().map(|r| RecordLength { name: &r.name, samples: r.samples() }).collect()
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

/// `7-validate/verdict.json`.
#[derive(Serialize)]
pub(crate) struct VerdictFile<'a> {
    pub(crate) models: BTreeMap<String, VerdictEntry<'a>>,
    pub(crate) channel_scales: OrRefused<ScalesEntry>,
}

#[derive(Serialize)]
pub(crate) struct VerdictEntry<'a> {
    #[serde(flatten)]
    facts: ModelFacts,
    robustness: RobustnessFile<'a>,
}

/// A model in `7-validate/verdict.json`, without its robustness.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct ModelFacts {
    pub(crate) order: usize,
    pub(crate) poles: Vec<[f64; 2]>,
    pub(crate) modes: Vec<ModeEntry>,
    pub(crate) stabilised_by_controller: bool,
    pub(crate) closed_loop_poles: Vec<[f64; 2]>,
    pub(crate) records: Vec<RecordFacts>,
}

/// A model on a record.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct RecordFacts {
    pub(crate) record: String,
    pub(crate) fit: Vec<Option<f64>>,
    pub(crate) vaf: Vec<Option<f64>>,
    pub(crate) failure: Option<String>,
}

impl<'a> From<&'a ModelVerdict> for VerdictEntry<'a> {
    fn from(v: &'a ModelVerdict) -> Self {
        let record = |r: &RecordVerdict| RecordFacts {
            record: r.record.clone(),
            fit: finite_all(&r.fit),
            vaf: finite_all(&r.vaf),
            failure: r.predicted.as_ref().err().cloned(),
        };
        let facts = ModelFacts {
            order: v.model.order(),
            poles: pairs(&v.poles),
            modes: v.modes.iter().map(ModeEntry::from).collect(),
            stabilised_by_controller: v.certificate.stable,
            closed_loop_poles: pairs(&v.certificate.poles),
            records: v.records.iter().map(record).collect(),
        };
        VerdictEntry { facts, robustness: RobustnessFile::from(&v.robustness) }
    }
}

/// `7-validate/residuals.json`.
#[derive(Serialize)]
pub(crate) struct ResidualsFile<'a> {
    lags: usize,
    steps: Vec<String>,
    models: BTreeMap<&'a str, BTreeMap<&'a str, &'a RecordResiduals>>,
}

impl<'a> From<&'a [ModelVerdict]> for ResidualsFile<'a> {
    fn from(models: &'a [ModelVerdict]) -> Self {
        let tests = |v: &'a ModelVerdict| {
            v.records.iter().filter_map(|r| Some((r.record.as_str(), r.residuals.as_ref()?))).collect()
        };
        let models = models.iter().map(|v| (v.method.key(), tests(v))).collect();
        ResidualsFile { lags: RESIDUAL_LAGS, steps: step_keys(), models }
    }
}
