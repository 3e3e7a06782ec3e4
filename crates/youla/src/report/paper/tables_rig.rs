//! The rig and what happened on it.

use super::tables::{plain, row};
use super::words::{count, short};
use crate::report::story::{Row, Table};
use crate::rig::{ExperimentRecord, Fidelity};
use crate::study::{Experiment, Paper};
use serde::Deserialize;

/// Every parameter with unit and basis, in the order of the file.
pub(super) fn parameters(paper: &Paper) -> Table {
    let text = toml::to_string(&paper.rig).unwrap_or_default();
    plain(
        "rig-parameters",
        "Parameters of the rig",
        "Every parameter of the digital twin with its unit and where its value comes from.",
        &["parameter", "value", "unit", "basis"],
        text.split("\n[").filter_map(parameter).collect(),
    )
}

/// One parameter as a file has it.
#[derive(Deserialize)]
struct Written {
    value: toml::Value,
    unit: String,
    basis: String,
}

/// `bearing.damping]`, then its value, unit and basis; nothing for a table of tables.
fn parameter(table: &str) -> Option<Row> {
    let (name, body) = table.trim_start_matches('[').split_once(']')?;
    let written: Written = toml::from_str(body).ok()?;
    Some(row([name.to_owned(), value(&written.value), written.unit, written.basis]))
}

fn value(value: &toml::Value) -> String {
    match value {
        toml::Value::Float(v) => short(*v, 6),
        toml::Value::Array(values) => {
            let inner: Vec<String> = values.iter().map(self::value).collect();
            let nested = matches!(values.first(), Some(toml::Value::Array(_)));
            inner.join(if nested { "; " } else { ", " })
        }
        other => other.to_string(),
    }
}

/// How the experiments differ: level of the rig, nominal model, controller.
pub(super) fn experiments(paper: &Paper) -> Table {
    let open_loop =
        row(["open loop, for the nominal model", "instrumented", "0", "", "", "none", "", ""].map(str::to_owned));
    let closed = paper.experiments.list.iter().map(|e| {
        let (level, rpm) = level(e.case.fidelity);
        row([
            e.case.title.clone(),
            level.into(),
            short(rpm, 6),
            short(e.case.a_factor, 4),
            short(e.case.b_factor, 4),
            short(e.design.command_weight, 4),
            short(e.design.peak_nominal, 3),
            short(e.design.peak_plant, 3),
        ])
    });
    plain(
        "conditions",
        "Experiments",
        "Level of the rig, degradation of the nominal model, weight of the command, and peak of the output sensitivity with \
         the nominal model and with the linear part of the rig.",
        &["experiment", "level", "rpm", "factor on A", "factor on B", "weight, 1/V^2", "peak, nominal", "peak, rig"],
        std::iter::once(open_loop).chain(closed).collect(),
    )
}

/// Name and speed of a level of fidelity.
pub(super) fn level(fidelity: Fidelity) -> (&'static str, f64) {
    match fidelity {
        Fidelity::Linear => ("linear", 0.0),
        Fidelity::Instrumented => ("instrumented", 0.0),
        Fidelity::Rotating { rpm } => ("rotating", rpm),
    }
}

/// What the safety of the rig did in every record.
pub(super) fn outcomes(paper: &Paper) -> Table {
    let records = |e: &Experiment| {
        [("estimation", &e.estimation), ("verification", &e.verification)]
            .map(|(name, record)| outcome(&format!("{}, {name}", e.case.title), record, e.settle))
    };
    let open_loop = outcome("open loop", &paper.experiments.nominal.record, 0);
    plain(
        "records",
        "Records",
        "What happened in every record: samples, those at the start that are not used, where it was aborted or the rotor \
         touched, and samples with a limited command or excitation per axis.",
        &["record", "samples", "not used", "aborted", "touched", "command limited", "excitation limited"],
        std::iter::once(open_loop).chain(paper.experiments.list.iter().flat_map(records)).collect(),
    )
}

fn outcome(name: &str, record: &ExperimentRecord, settle: usize) -> Row {
    let sample = |k: Option<usize>| k.map_or_else(|| "no".to_owned(), |k| format!("at sample {k}"));
    let pair = |[h, v]: [usize; 2]| format!("{h} / {v}");
    row([
        name.to_owned(),
        record.y.nrows().to_string(),
        settle.to_string(),
        sample(record.aborted),
        sample(record.touched),
        pair(record.saturated),
        pair(record.excitation_limited),
    ])
}

/// The excitations. What they offer to identification belongs here: rms, crest, order of persistency.
pub(super) fn excitation(paper: &Paper) -> Table {
    let settings = &paper.settings;
    let ts = paper.rig.timing.sample_time.value;
    let rows = [
        ("study and map", &settings.study.excitation, settings.study.samples),
        ("experiments", &settings.experiments.excitation, settings.experiments.samples),
    ]
    .map(|(name, waves, samples)| {
        row([
            name.to_owned(),
            "square waves, random hold".into(),
            short(waves.amplitude, 4),
            format!("{} to {}", waves.hold_min, count(waves.hold_max, "sample", "samples")),
            samples.to_string(),
            short(samples as f64 * ts, 4),
        ])
    });
    plain(
        "excitation",
        "Excitation",
        "The signal alpha of the estimation records, independent on both axes.",
        &["records", "kind", "amplitude, V", "hold", "samples", "duration, s"],
        rows.into(),
    )
}
