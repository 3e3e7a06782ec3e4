//! The runs and their modes as tables, and what makes them hard to compare.

use super::run::FinishedRun;
use crate::page::models;
use youla::error::Seconds;
use youla::signal::Channel;
use youla_report::data::{DrawnMode, EvidenceTable, LineStatus, Note, ReportData, Verdict};
use youla_report::match_modes;
use youla_report::numbers::fit;

/// One row per run: verdict, order, fit.
pub(super) fn overview(runs: &[FinishedRun]) -> EvidenceTable {
    let row = |run: &FinishedRun| {
        vec![
            run.name.clone(),
            run.summary.name.clone(),
            verdict(&run.report),
            run.entry().map_or_else(|| run.model.system.order(), |model| model.order).to_string(),
            format!("{} s", run.model.system.time().ts()),
            mean_fit(run).map_or("\u{2013}".into(), |of| format!("{} %", fit(of, 1))),
        ]
    };
    let columns = ["Run", "Machine", "Can it be trusted?", "Order", "Sample time", "Mean fit"];
    let caption = "The mean fit is that over all verification records and outputs of a run.".into();
    EvidenceTable { caption, ..EvidenceTable::new("Runs", &columns, runs.iter().map(row).collect()) }
}

fn verdict(report: &ReportData) -> String {
    let of = |status: LineStatus| report.verdict.iter().filter(|v| v.status == status).collect::<Vec<&Verdict>>();
    let (bad, caution) = (of(LineStatus::Bad), of(LineStatus::Caution));
    match (bad.first(), caution.len()) {
        (Some(line), _) => line.text.clone(),
        (None, 0) if report.verdict.is_empty() => "no verdict".into(),
        (None, 0) => "no warning".into(),
        (None, n) => format!("{n} of {} lines are warnings: {}", report.verdict.len(), caution[0].text),
    }
}

fn mean_fit(run: &FinishedRun) -> Option<f64> {
    run.entry()?.mean_fit().filter(|fit| fit.is_finite())
}

/// The oscillating modes of the first run, and how far those of the others are from them.
pub(super) fn modes(runs: &[FinishedRun]) -> EvidenceTable {
    let all: Vec<Vec<DrawnMode>> = runs.iter().map(oscillating).collect();
    let first: Vec<&DrawnMode> = all[0].iter().collect();
    let partners: Vec<Vec<Option<&DrawnMode>>> = all[1..]
        .iter()
        .map(|modes| {
            let places = match_modes(&first, &modes.iter().collect::<Vec<_>>());
            places.into_iter().map(|place| place.and_then(|k| modes.get(k))).collect()
        })
        .collect();
    let row = |(k, mode): (usize, &DrawnMode)| -> Vec<String> {
        let others = partners.iter().map(|of| of[k].map_or("\u{2013}".into(), |other| difference(mode, other)));
        [format!("{:.2} Hz, \u{3b6} {:.4}", mode.hz, mode.zeta)].into_iter().chain(others).collect()
    };
    EvidenceTable {
        title: "Differences of modes".into(),
        text: format!("Oscillating modes of {}, and how those of the other runs differ.", runs[0].name),
        columns: runs.iter().map(|r| r.name.clone()).collect(),
        rows: all[0].iter().enumerate().map(row).collect(),
        caption: "Modes agree by frequency (10 %), damping ratio and residue, each with one of the other run at most. In brackets: the difference of frequency and of damping in standard deviations of both runs together, where they are known.".into(),
    }
}

fn oscillating(run: &FinishedRun) -> Vec<DrawnMode> {
    let all = run.entry().map_or_else(Vec::new, |model| models::modes(&run.key, model));
    let mut modes: Vec<DrawnMode> = all.into_iter().filter(|m| m.hz > 0.0 && m.zeta.abs() < 1.0).collect();
    modes.sort_by(|a, b| a.hz.total_cmp(&b.hz));
    modes
}

fn difference(from: &DrawnMode, to: &DrawnMode) -> String {
    let text = format!(
        "{:+.2} Hz ({:+.2} %), \u{3b6} {:+.4}",
        to.hz - from.hz,
        100.0 * (to.hz / from.hz - 1.0),
        to.zeta - from.zeta
    );
    match (from.deviation, to.deviation) {
        (Some(a), Some(b)) => {
            let sigmas = |d: f64, k: usize| d.abs() / a[k].hypot(b[k]);
            format!("{text} [{:.1}, {:.1}]", sigmas(to.hz - from.hz, 0), sigmas(to.zeta - from.zeta, 1))
        }
        _ => text,
    }
}

/// What makes the runs hard to compare.
pub(super) fn notes(runs: &[FinishedRun]) -> Vec<Note> {
    let first = &runs[0];
    let mut all = Vec::new();
    let channels =
        |r: &ReportData| r.inputs.iter().chain(&r.outputs).map(Channel::label).collect::<Vec<_>>().join(", ");
    let time = |r: &ReportData| r.sample_time.map_or("no".into(), |ts| Seconds(ts).to_string());
    let mut add = |text: String| all.push(Note { status: LineStatus::Caution, text });
    for run in &runs[1..] {
        let (a, b) = (&first.report, &run.report);
        if (&a.inputs, &a.outputs) != (&b.inputs, &b.outputs) {
            add(format!(
                "{} has the channels {}, {} has {}: they are compared by their position.",
                run.name,
                channels(b),
                first.name,
                channels(a)
            ));
        }
        if a.sample_time != b.sample_time {
            add(format!(
                "{} has a sample time of {} s, {} has {} s: poles are drawn in the s plane, and there is no nu-gap.",
                run.name,
                time(b),
                first.name,
                time(a)
            ));
        }
        let files = |r: &ReportData| {
            r.sources.iter().filter(|s| s.purpose == "verification").map(|s| s.sha256.clone()).collect::<Vec<_>>()
        };
        if files(a) != files(b) {
            add(format!(
                "{} was verified on other files than {}: the fits differ by the records as well as by the models.",
                run.name, first.name
            ));
        }
    }
    all
}
