//! Remarks of a report, and all warnings of a run as sentences.

use crate::page::further::further_lines;
use crate::page::verdict::verdict_lines;
use crate::records::LoopRecord;
use crate::records::segments::RecordSegment;
use crate::result::Identification;
use youla::identify::innovation_form::Convergence;
use youla::identify::likelihood::SHORTEST_RECORD;
use youla::identify::subspace::{Uncertainty, amplitudes};
use youla_report::data::{Note, ReportPart, Status};

/// All warnings of a run as sentences, for the terminal. Those of the check of the data come first.
pub fn cautions(found: &Identification) -> Vec<String> {
    let weigh = |status: Status, text: String| matches!(status, Status::Caution | Status::Bad).then_some(text);
    // The line on the data counts its findings; here each has its own sentence.
    let trust = verdict_lines(found).into_iter().filter(|line| line.evidence != ReportPart::Data);
    let lines = trust.chain(further_lines(found)).map(|v| weigh(v.status, v.text));
    let rest = lines.chain(notes(found).into_iter().map(|n| weigh(n.status, n.text))).flatten();
    found.data.sentences().into_iter().chain(rest).collect()
}

/// Remarks: models that are impossible, poles that were moved, predictions that diverged.
pub(crate) fn notes(found: &Identification) -> Vec<Note> {
    let mut all = Vec::new();
    let mut add = |status: Status, text: String| all.push(Note { status, text });
    for refusal in found.refusals() {
        add(Status::Info, format!("There is no {}: {}.", refusal.what, refusal.error));
    }
    let scheme = found.scheme();
    let refused = scheme.and_then(|s| s.hansen.uncertainty.as_ref()).and_then(Uncertainty::refusal);
    if let Some(reason) = refused {
        add(Status::Caution, format!("There is no uncertainty of S and G(S): {reason}."));
    }
    if let Some(Some(Err(reason))) = scheme.map(|s| &s.hansen.evidence) {
        add(Status::Caution, format!("S = 0 was not tested: {reason}."));
    }
    if let Some(Some(Uncertainty::Bootstrap(bootstrap))) = scheme.map(|s| &s.hansen.deviation.uncertainty) {
        let (unstable, failed) = (bootstrap.unstable, bootstrap.failed);
        if unstable + failed > 0 {
            let text = format!("Of the resampled records, {unstable} gave an unstable S and {failed} no S.");
            add(Status::Info, text);
        }
    }
    if let Some(run) = found.structure() {
        let model = &run.found.model;
        for sentence in model.undetermined.sentences() {
            add(Status::Caution, format!("Grey box: {sentence}."));
        }
        for bound in &model.at_bounds {
            add(Status::Caution, format!("Grey box: {} ended at its bound {}.", bound.parameter, bound.value));
        }
    }
    for (name, model) in [("S", scheme.map(|s| &s.hansen.deviation)), ("the direct model", found.direct())] {
        let moved = model.map_or(0, |m| m.stability.moved.len());
        if moved > 0 {
            add(
                Status::Caution,
                format!("{moved} unstable poles of {name} were reflected, because stability = \"constrain\"."),
            );
        }
    }
    for v in &found.verdict.models {
        for r in &v.records {
            if let Err(reason) = &r.predicted {
                add(Status::Caution, format!("{} has no prediction of {}: {reason}.", v.method.label(), r.record));
            }
        }
    }
    if let Some(form) = scheme.and_then(|s| s.hansen.innovation_form.as_ref()) {
        let (status, converged) = match form.stop {
            Convergence::Converged => (Status::Info, "converged"),
            Convergence::Iterations => (Status::Caution, "did not converge"),
        };
        let kalman = form.from_kalman.map_or(String::new(), |x| {
            format!(" The Kalman gain of the subspace method differs from K_s by {:.0} %.", 100.0 * x)
        });
        let text = format!(
            "S is in innovation form: its gain K_s {converged} within {} refits (last relative change {:.1e}); it differs from the \
             response of beta to output noise by {:.1} %.{kalman}",
            form.iterations,
            form.change,
            100.0 * form.misfit
        );
        add(status, text);
    }
    if !found.records.segments.is_empty() {
        let part = |s: &RecordSegment| format!("{} is rows {} to {} of {}", s.record, s.rows[0], s.rows[1], s.file);
        let parts: Vec<String> = found.records.segments.iter().map(part).collect();
        add(Status::Info, format!("Parts of files, each identified as a separate experiment: {}.", parts.join("; ")));
    }
    let short = found.records.estimation.iter().map(LoopRecord::samples).filter(|samples| *samples < SHORTEST_RECORD);
    let (count, samples) = short.fold((0, 0), |(count, sum), samples| (count + 1, sum + samples));
    if count > 0 && count < found.records.estimation.len() {
        let text = format!(
            "{count} estimation records with {samples} samples together are shorter than {SHORTEST_RECORD} samples; the recommended model \
             leaves them out."
        );
        add(Status::Caution, text);
    }
    if let Some(text) = disturbance_note(found) {
        add(Status::Info, text);
    }
    let settle = found.filtered.as_ref().map_or(0, |f| f.signals.settle);
    if settle > 0 && found.records.measured.is_none() {
        let text = format!(
            "The first {settle} samples of alpha and beta of each record were discarded (transient of the signal filter)."
        );
        add(Status::Info, text);
    }
    all
}

/// The known lines that were removed from beta, with their amplitudes in each output, largest over the records.
fn disturbance_note(found: &Identification) -> Option<String> {
    let labels = found.settings.data.disturbance.as_ref()?.labels();
    let all: Vec<_> = found.scheme()?.hansen.deviation.disturbances.iter().map(|a| amplitudes(a.as_ref())).collect();
    let of_line = |(j, label): (usize, &String)| {
        let largest = |i: usize| all.iter().map(|lines| lines[j][i].amplitude).fold(0.0, f64::max);
        let outputs = found.records.outputs.iter().enumerate();
        let each: Vec<String> = outputs.map(|(i, c)| format!("{:.3} {} in {}", largest(i), c.unit, c.name)).collect();
        format!("{label}: {}", each.join(", "))
    };
    let lines: Vec<String> = labels.iter().enumerate().map(of_line).collect();
    Some(format!(
        "Sinusoids of known frequency were removed before identification, and from measured and predicted outputs before each fit. \
         Their largest amplitudes in beta over the records: {}.",
        lines.join("; ")
    ))
}
