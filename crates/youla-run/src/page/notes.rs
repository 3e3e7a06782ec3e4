//! Remarks of a report, and all warnings of a run as sentences.

use super::further::further_lines;
use super::verdict::verdict_lines;
use crate::method::Method;
use crate::records::segments::RecordSegment;
use crate::result::Identification;
use crate::stages::signals::DeviationSignals;
use crate::summary::Summary;
use youla::identify::likelihood::SHORTEST_RECORD;
use youla::identify::subspace::{SubspaceModel, amplitudes};
use youla::signal::LoopRecord;
use youla_report::data::{LineStatus, Note, ReportPart, Verdict};

/// All warnings of a run as sentences, for the terminal, beside the verdict of the recommended model and its reasons. Those of the check of the
/// data come first.
pub fn cautions(found: &Identification, summary: &Summary) -> Vec<String> {
    let weigh =
        |status: LineStatus, text: String| matches!(status, LineStatus::Caution | LineStatus::Bad).then_some(text);
    // The line on the data counts its findings; here each has its own sentence.
    let said = |line: &Verdict| line.evidence == ReportPart::Recommended && line.status == LineStatus::Bad;
    let trust =
        verdict_lines(found, summary).into_iter().filter(|line| line.evidence != ReportPart::Data && !said(line));
    let lines = trust.chain(further_lines(found, summary)).map(|v| weigh(v.status, v.text));
    let rest = lines.chain(notes(found, summary).into_iter().map(|n| weigh(n.status, n.text))).flatten();
    found.data.sentences().into_iter().chain(rest).collect()
}

/// Remarks: models that are impossible, poles that were moved, predictions that diverged.
pub(crate) fn notes(found: &Identification, summary: &Summary) -> Vec<Note> {
    [
        refusals(found),
        structure(found),
        moved_poles(found),
        diverged(found, summary),
        records(found),
        disturbance(found),
        settling(found),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn info(text: String) -> Note {
    Note { status: LineStatus::Info, text }
}

fn caution(text: String) -> Note {
    Note { status: LineStatus::Caution, text }
}

fn refusals(found: &Identification) -> Vec<Note> {
    found.refusals().iter().map(|r| info(format!("There is no {}: {}.", r.what, r.error))).collect()
}

fn structure(found: &Identification) -> Vec<Note> {
    let Some(model) = found.structure().map(|run| &run.found.model) else { return Vec::new() };
    let undetermined = model.undetermined.sentences().into_iter().map(|s| caution(format!("Grey box: {s}.")));
    let bounds = model.at_bounds.iter();
    let at_bound = bounds.map(|b| caution(format!("Grey box: {} ended at its bound {}.", b.parameter, b.value)));
    undetermined.chain(at_bound).collect()
}

fn moved_poles(found: &Identification) -> Vec<Note> {
    let moved = |name: &str, model: Option<&SubspaceModel>| {
        let count = model.map_or(0, |m| m.stability.moved.len());
        let text = format!("{count} unstable poles of {name} were reflected, because stability = \"constrain\".");
        (count > 0).then(|| caution(text))
    };
    let s = found.scheme().map(|s| &s.deviation);
    [moved("S", s), moved("the direct model", found.direct())].into_iter().flatten().collect()
}

fn diverged(found: &Identification, summary: &Summary) -> Vec<Note> {
    let of = |method: Method| {
        let records = summary.model(method).into_iter().flat_map(|model| &model.diverged);
        records.map(move |(r, reason)| caution(format!("{} has no prediction of {r}: {reason}.", method.label())))
    };
    found.validation.models.iter().flat_map(|v| of(v.method)).collect()
}

/// Records that are parts of files, and those that are too short for the recommended model.
fn records(found: &Identification) -> Vec<Note> {
    let records = &found.records;
    let part = |s: &RecordSegment| format!("{} is rows {} to {} of {}", s.record, s.rows[0], s.rows[1], s.file);
    let parts: Vec<String> = records.segments.iter().map(part).collect();
    let parts = (!parts.is_empty())
        .then(|| info(format!("Parts of files, each identified as a separate experiment: {}.", parts.join("; "))));
    let short = records.estimation.iter().map(LoopRecord::samples).filter(|samples| *samples < SHORTEST_RECORD);
    let (count, samples) = short.fold((0, 0), |(count, sum), samples| (count + 1, sum + samples));
    let left_out = (count > 0 && count < records.estimation.len()).then(|| {
        caution(format!(
            "{count} estimation records with {samples} samples together are shorter than {SHORTEST_RECORD} samples; the recommended model \
             leaves them out."
        ))
    });
    parts.into_iter().chain(left_out).collect()
}

/// The known lines that were removed from beta, with their amplitudes in each output, largest over the records.
fn disturbance(found: &Identification) -> Vec<Note> {
    let (Some(of_data), Some(scheme)) = (&found.settings.data.disturbance, found.scheme()) else { return Vec::new() };
    let all: Vec<_> = scheme.deviation.disturbances.iter().map(|a| amplitudes(a.as_ref())).collect();
    let of_line = |(j, label): (usize, &String)| {
        let largest = |i: usize| all.iter().map(|lines| lines[j][i].amplitude).fold(0.0, f64::max);
        let outputs = found.records.outputs.iter().enumerate();
        let each: Vec<String> = outputs.map(|(i, c)| format!("{:.3} {} in {}", largest(i), c.unit, c.name)).collect();
        format!("{label}: {}", each.join(", "))
    };
    let lines: Vec<String> = of_data.labels().iter().enumerate().map(of_line).collect();
    vec![info(format!(
        "Sinusoids of known frequency were removed before identification, and from measured and predicted outputs before each fit. Their \
         largest amplitudes in beta over the records: {}.",
        lines.join("; ")
    ))]
}

fn settling(found: &Identification) -> Vec<Note> {
    match found.signals() {
        Some(DeviationSignals { settle, .. }) if *settle > 0 && found.records.measured.is_none() => {
            vec![info(format!(
                "The first {settle} samples of alpha and beta of each record were discarded (transient of the signal filter)."
            ))]
        }
        _ => Vec::new(),
    }
}
