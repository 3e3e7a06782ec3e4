//! How far the models of the runs are from each other: the nu-gap in scaled channels.

use super::run::FinishedRun;
use crate::Result;
use serde::Serialize;
use youla::control::nu_gap;
use youla_report::data::EvidenceTable;

/// The nu-gap of the models of two runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distance {
    /// The first run.
    pub from: String,
    /// The second run.
    pub to: String,
    /// The nu-gap, 0 to 1; absent where it cannot be had.
    pub nu_gap: Option<f64>,
    /// Why not.
    pub refusal: Option<String>,
}

/// All pairs.
pub(super) fn distances(runs: &[FinishedRun]) -> Vec<Distance> {
    let pairs = (0..runs.len()).flat_map(|i| (i + 1..runs.len()).map(move |j| (i, j)));
    pairs.map(|(i, j)| distance(&runs[0], &runs[i], &runs[j])).collect()
}

/// In the scales of the first run of all.
fn distance(scale: &FinishedRun, from: &FinishedRun, to: &FinishedRun) -> Distance {
    let gap = || -> Result<f64> {
        let (a, b) = match &scale.scales {
            Some(scales) => (scales.plant(&from.model.system)?, scales.plant(&to.model.system)?),
            None => (from.model.system.clone(), to.model.system.clone()),
        };
        Ok(nu_gap(&a, &b)?.value)
    };
    let (nu_gap, refusal) = match gap() {
        Ok(value) => (Some(value), None),
        Err(reason) => (None, Some(reason.to_string())),
    };
    Distance { from: from.name.clone(), to: to.name.clone(), nu_gap, refusal }
}

/// The pairs as a table.
pub(super) fn table(runs: &[FinishedRun], distances: &[Distance]) -> EvidenceTable {
    let cell = |from: &FinishedRun, to: &FinishedRun| {
        let found = distances.iter().find(|d| (&d.from, &d.to) == (&from.name, &to.name));
        match found.map(|d| (d.nu_gap, &d.refusal)) {
            Some((Some(gap), _)) => format!("{gap:.4}"),
            Some((_, Some(reason))) => reason.clone(),
            _ => String::new(),
        }
    };
    let row = |from: &FinishedRun| -> Vec<String> {
        std::iter::once(from.name.clone()).chain(runs[1..].iter().map(|to| cell(from, to))).collect()
    };
    let scaled = match runs[0].scales {
        Some(_) => format!("Channels are scaled by their root mean square in {}", runs[0].name),
        None => "Channels are not scaled".into(),
    };
    EvidenceTable {
        title: "Distance of the models".into(),
        text: "The nu-gap: 0 for equal models, 1 for models that no common controller can serve. A controller whose margin b(G, K) is larger than the gap stabilises both.".into(),
        columns: std::iter::once(String::new()).chain(runs[1..].iter().map(|r| r.name.clone())).collect(),
        rows: runs[..runs.len() - 1].iter().map(row).collect(),
        caption: format!("{scaled}."),
    }
}
