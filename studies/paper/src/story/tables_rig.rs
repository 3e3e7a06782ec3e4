//! The rig and what happened on it.

use super::tables::{plain, row};
use super::words::short;
use crate::study::ExcitedChannel;
use crate::study::{Paper, StudyExperiment};
use serde::Deserialize;
use std::f64::consts::TAU;
use youla_report::story::{Table, TableRow};
use youla_twin::rig::{ExperimentRecord, Fidelity};

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
fn parameter(table: &str) -> Option<TableRow> {
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
    let records = |e: &StudyExperiment| {
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

fn outcome(name: &str, record: &ExperimentRecord, settle: usize) -> TableRow {
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

/// The excitations of the experiments, and what they offer to identification.
pub(super) fn excitation(paper: &Paper) -> Table {
    let rows = paper.experiments.list.iter().map(|e| {
        let report = &e.excitation;
        let per_axis = |f: &dyn Fn(&ExcitedChannel) -> f64| {
            let [h, v] = [0, 1].map(|j| report.channels.get(j).map_or(f64::NAN, f));
            format!("{} / {}", short(h, 3), short(v, 3))
        };
        let persistency = &report.persistency;
        row([
            e.case.title.clone(),
            short(e.estimation.alpha.nrows() as f64 * e.estimation.time.ts(), 4),
            per_axis(&|c| c.rms),
            per_axis(&|c| c.crest),
            per_axis(&|c| c.band.omega_max / TAU),
            format!("{} of {}", report.order, persistency.block_rows),
            short(persistency.condition, 2),
        ])
    });
    plain(
        "excitation",
        "Excitation",
        "The signal alpha of the estimation records, per axis: rms, crest, frequency below which 95 % of the power lies; order of \
         persistent excitation of both axes together, of the number of block rows that the identification of S needs, and \
         condition number of that block-Hankel matrix.",
        &["experiment", "duration, s", "rms, V", "crest", "95 % below, Hz", "persistent order", "condition"],
        rows.collect(),
    )
}
