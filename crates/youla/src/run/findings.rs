//! What a run says in words: the answer to "can I trust it?" and the remarks besides.

use super::pipeline::Identification;
use super::segments::RecordSegment;
use super::verdict::{Method, ModelVerdict};
use crate::control::IsoZone;
use crate::identify::greybox::Stop;
use crate::identify::hansen_pem::PemStart;
use crate::identify::innovation_form::Settling;
use crate::identify::refine::RefineNoise;
use crate::identify::subspace::{Uncertainty, amplitudes};
use crate::report::data::{Evidence, Note, Status, Verdict};

/// The answer to "can I trust it?", a few lines, each with its evidence.
pub(super) fn verdict_lines(found: &Identification) -> Vec<Verdict> {
    [
        fit_line(found),
        loop_line(found),
        margin_line(found),
        band_line(found),
        redesign_line(found),
        deviation_line(found),
        evidence_line(found),
        reduction_line(found),
        grey_box_line(found),
        controller_line(found),
        factor_line(found),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// What speaks against the result or asks for a look, in sentences: for a terminal that shows no report.
///
/// What the check of the data says at least as a caution comes first.
pub fn cautions(found: &Identification) -> Vec<String> {
    let weigh = |status: Status, text: String| matches!(status, Status::Caution | Status::Bad).then_some(text);
    let lines = verdict_lines(found).into_iter().map(|v| weigh(v.status, v.text));
    let rest = lines.chain(notes(found).into_iter().map(|n| weigh(n.status, n.text))).flatten();
    found.data.sentences().into_iter().chain(rest).collect()
}

/// Remarks that a user should know: methods that could not be had, poles that were moved, predictions that diverged.
pub(super) fn notes(found: &Identification) -> Vec<Note> {
    let mut all = Vec::new();
    let mut add = |status: Status, text: String| all.push(Note { status, text });
    for refusal in found.refusals() {
        add(Status::Info, format!("There is no {}: {}.", refusal.what, refusal.error));
    }
    let refused = found.hansen.uncertainty.as_ref().and_then(Uncertainty::refusal);
    if let Some(reason) = refused {
        add(Status::Caution, format!("There is no uncertainty of S and G(S): {reason}."));
    }
    if let Some(Err(reason)) = &found.hansen.evidence {
        add(Status::Caution, format!("Nothing is said on S = 0: {reason}."));
    }
    if let Some(Uncertainty::Bootstrap(bootstrap)) = &found.hansen.deviation.uncertainty {
        let (unstable, failed) = (bootstrap.unstable, bootstrap.failed);
        if unstable + failed > 0 {
            let text = format!("Of the resampled records {unstable} gave an unstable S and {failed} none.");
            add(Status::Info, text);
        }
    }
    if let Some(Ok(run)) = &found.grey_box {
        let model = &run.found.model;
        for sentence in model.undetermined.sentences() {
            add(Status::Caution, format!("Grey box: {sentence}."));
        }
        for bound in &model.at_bounds {
            add(Status::Caution, format!("Grey box: {} ended at its bound {}.", bound.parameter, bound.value));
        }
    }
    for (name, model) in [("S", Some(&found.hansen.deviation)), ("the direct model", direct(found))] {
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
    if let Some(form) = &found.hansen.innovation_form {
        let (status, settled) = match form.stop {
            Settling::Settled => (Status::Info, "settled"),
            Settling::Iterations => (Status::Caution, "had not settled"),
        };
        let kalman = form.from_kalman.map_or(String::new(), |x| {
            format!(" It differs from the Kalman gain of the subspace method by {:.0} % of its size.", 100.0 * x)
        });
        let text = format!(
            "S is in innovation form: its gain K_s {settled} after {} refits (last change {:.1e}) and misses the response of \
             beta to output noise by {:.1} %.{kalman}",
            form.iterations,
            form.change,
            100.0 * form.misfit
        );
        add(status, text);
    }
    if let Some(refined) = &found.hansen.refinement {
        let (status, ended) = match refined.stop {
            Stop::Iterations => (Status::Caution, " and stopped at the limit"),
            _ => (Status::Info, ""),
        };
        let noise = match refined.noise {
            RefineNoise::OutputError => "the simulated beta",
            RefineNoise::Innovation => "beta predicted one step ahead",
        };
        let fits = |fit: &[f64]| fit.iter().map(|f| format!("{f:.2}")).collect::<Vec<_>>().join(" and ");
        let text = format!(
            "S was refined on {noise}: {} steps{ended} took the criterion from {:.5e} to {:.5e}, and the fit of the simulated \
             beta from {} % to {} %. S is {}.",
            refined.iterations,
            refined.cost_before,
            refined.cost,
            fits(&refined.fit_before),
            fits(&refined.fit),
            if refined.stable { "stable, so that the controller stabilises G(S)" } else { "not stable" },
        );
        add(status, text);
    }
    if !found.records.segments.is_empty() {
        let part = |s: &RecordSegment| format!("{} is rows {} to {} of {}", s.record, s.rows[0], s.rows[1], s.file);
        let parts: Vec<String> = found.records.segments.iter().map(part).collect();
        add(
            Status::Info,
            format!("Records that are parts of a file, each an experiment by itself: {}.", parts.join("; ")),
        );
    }
    if let Some(text) = disturbance_note(found) {
        add(Status::Info, text);
    }
    let settle = found.signals.settle;
    if settle > 0 {
        let text = format!(
            "The first {settle} samples of alpha and beta of each record were dropped (settling of the filter)."
        );
        add(Status::Info, text);
    }
    all
}

/// The known lines that were taken out of beta, with their amplitudes in each output, largest over the records.
fn disturbance_note(found: &Identification) -> Option<String> {
    let labels = found.settings.data.disturbance.as_ref()?.labels();
    let all: Vec<_> = found.hansen.deviation.disturbances.iter().map(|a| amplitudes(a.as_ref())).collect();
    let of_line = |(j, label): (usize, &String)| {
        let largest = |i: usize| all.iter().map(|lines| lines[j][i].amplitude).fold(0.0, f64::max);
        let outputs = found.records.outputs.iter().enumerate();
        let each: Vec<String> = outputs.map(|(i, c)| format!("{:.3} {} in {}", largest(i), c.unit, c.name)).collect();
        format!("{label}: {}", each.join(", "))
    };
    let lines: Vec<String> = labels.iter().enumerate().map(of_line).collect();
    Some(format!(
        "Known lines were taken out before identification, and out of measured and predicted outputs alike before each fit; \
         their amplitudes in beta, largest over the records: {}.",
        lines.join("; ")
    ))
}

fn direct(found: &Identification) -> Option<&crate::identify::subspace::SubspaceModel> {
    found.direct.as_ref()?.as_ref().ok()
}

/// Mean fit over all verification records and outputs.
fn mean_fit(v: &ModelVerdict) -> f64 {
    let all: Vec<f64> = v.records.iter().flat_map(|r| r.fit.iter().copied()).collect();
    all.iter().sum::<f64>() / all.len() as f64
}

fn fit_line(found: &Identification) -> Option<Verdict> {
    if found.records.verification.is_empty() {
        let text = "No verification record was given: nothing shows how the model does on fresh data.".into();
        return Some(Verdict { status: Status::Caution, text, evidence: Evidence::Fits });
    }
    let percent = |fit: f64| if fit.is_finite() { format!("{fit:.1} %") } else { "no prediction".into() };
    let of = |method: Method| found.verdict.of(method).map(mean_fit);
    let (hansen, nominal) = (of(Method::Hansen)?, of(Method::Nominal)?);
    let mut text =
        format!("On fresh data G(S) has a mean fit of {}, the nominal model {}", percent(hansen), percent(nominal));
    if let Some(direct) = of(Method::Direct) {
        text += &format!(", direct identification {}", percent(direct));
    }
    text.push('.');
    let better = hansen.is_finite() && (!nominal.is_finite() || hansen > nominal);
    Some(Verdict { status: if better { Status::Good } else { Status::Bad }, text, evidence: Evidence::Fits })
}

fn loop_line(found: &Identification) -> Option<Verdict> {
    let v = found.verdict.of(Method::Hansen)?;
    let worst = v.certificate.worst_pole.map_or(0.0, |p| p.norm());
    let (status, verb) =
        if v.certificate.stable { (Status::Good, "stabilises") } else { (Status::Bad, "does not stabilise") };
    let text = format!(
        "The controller that ran {verb} G(S); the closed-loop pole of largest magnitude is at |z| = {worst:.5}."
    );
    Some(Verdict { status, text, evidence: Evidence::Certificate })
}

/// Whether the controller stabilises every model within the region of S, where its uncertainty was asked for.
fn band_line(found: &Identification) -> Option<Verdict> {
    let certificate = found.certificate.as_ref()?;
    let text = certificate.band_sentence()?;
    let status = if certificate.band?.holds() { Status::Good } else { Status::Caution };
    Some(Verdict { status, text, evidence: Evidence::Certificate })
}

fn redesign_line(found: &Identification) -> Option<Verdict> {
    let new = found.redesign.as_ref()?.as_ref().ok()?;
    let status = if new.gains_damping() { Status::Good } else { Status::Caution };
    Some(Verdict { status, text: super::redesign::sentence(new), evidence: Evidence::Redesign })
}

/// What the loop of G(S) can bear; nothing where it is unstable, which the line before says.
fn margin_line(found: &Identification) -> Option<Verdict> {
    let robustness = &found.verdict.of(Method::Hansen)?.robustness;
    let margins = robustness.margins.as_ref().ok()?;
    let zone = margins.zone()?;
    let worst = margins.outputs.iter().map(|c| c.sensitivity.value).fold(0.0, f64::max);
    let disk = margins.output_disks.balanced;
    let highest = disk.highest_gain.map_or("any higher factor".into(), |g| format!("{g:.2}"));
    let text = format!(
        "With G(S) the peak sensitivity of the loop is {worst:.2} at the worst output (zone {zone} of ISO 14839-3) and {:.2} for \
         all outputs at once; the gains of all outputs may change by factors from {:.2} to {highest}, or their phases by {:.0} \
         degrees.",
        margins.output_sensitivity.value, disk.lowest_gain, disk.phase_degrees
    );
    let status = match zone {
        IsoZone::A | IsoZone::B => Status::Good,
        IsoZone::C => Status::Caution,
        IsoZone::D => Status::Bad,
    };
    Some(Verdict { status, text, evidence: Evidence::Margins })
}

fn deviation_line(found: &Identification) -> Option<Verdict> {
    let s = &found.hansen.deviation;
    let stable = if s.stability.stable { "stable" } else { "unstable" };
    let fit: Vec<String> = s.fit.percent.iter().map(|f| format!("{f:.1} %")).collect();
    let text = format!(
        "S has order {} and is {stable}; it reproduces beta with a fit of {} per channel (the rest is noise or unmodelled).",
        s.model.order(),
        fit.join(", "),
    );
    let status = if s.stability.stable { Status::Good } else { Status::Bad };
    Some(Verdict { status, text, evidence: Evidence::Order })
}

/// Whether S carries information, where its uncertainty was asked for.
fn evidence_line(found: &Identification) -> Option<Verdict> {
    let evidence = found.hansen.evidence.as_ref()?.as_ref().ok()?;
    let figures =
        format!("t = {:.1}, {:.1} at {:.0} %", evidence.statistic, evidence.threshold, 100.0 * evidence.level);
    let (status, text) = if evidence.against_nominal() {
        let text =
            format!("S from each half of the data predicts the other half: the nominal model is refuted ({figures}).");
        (Status::Good, text)
    } else {
        let text = format!(
            "There is no evidence against the nominal model: S from each half of the data does not predict the other half \
             ({figures}), so that S may be noise."
        );
        (Status::Caution, text)
    };
    Some(Verdict { status, text, evidence: Evidence::Frequency })
}

/// Whether the controller stabilises the reduced model, and what the reduction costs in the loop.
fn reduction_line(found: &Identification) -> Option<Verdict> {
    Some(found.reduction.as_ref()?.as_ref().ok()?.verdict())
}

/// Whether the physical structure explains what G(S) explains.
fn grey_box_line(found: &Identification) -> Option<Verdict> {
    let run = found.grey_box.as_ref()?.as_ref().ok()?;
    let fit = |values: &[f64]| values.iter().map(|f| format!("{f:.1} %")).collect::<Vec<_>>().join(", ");
    let (model, plant) = (fit(&run.found.model.fit), fit(&run.found.fit_of_plant));
    let start = match run.found.won {
        PemStart::Projection => "the projection of G(S)",
        PemStart::Nominal => "its initial values",
        PemStart::Direct => "the projection of a model of u and y by PBSIDopt",
    };
    let text = format!(
        "The physical structure explains the estimation records with a fit of {model} per output, G(S) {plant} (found from {start})."
    );
    let (status, text) = match run.found.lost() {
        true => (
            Status::Caution,
            text + " It stays behind: the search is lost, or the structure does not describe the plant.",
        ),
        false => (Status::Good, text),
    };
    let (doubt, residuals) = match &run.intervals {
        Ok(known) => (!known.residuals.independent() || known.coloured == known.residuals.white(), known.verdict()),
        Err(reason) => (true, format!("There are no intervals: {reason}.")),
    };
    let status = if doubt { Status::Caution } else { status };
    Some(Verdict { status, text: format!("{text} {residuals}"), evidence: Evidence::Fits })
}

fn controller_line(found: &Identification) -> Option<Verdict> {
    let mismatch = found.signals.controller_mismatch?;
    let (status, words) = match mismatch {
        m if m < 0.01 => (Status::Good, "the declared controller is the one that ran"),
        m if m < 0.1 => (Status::Caution, "the declared controller nearly explains the logged input"),
        _ => {
            (Status::Bad, "the declared controller does not explain the logged input; check sign, delay and saturation")
        }
    };
    let text = format!("Known excitations explain alpha to {mismatch:.1e} (relative): {words}.");
    Some(Verdict { status, text, evidence: Evidence::Signals })
}

fn factor_line(found: &Identification) -> Option<Verdict> {
    let residual = found.factorisation.bezout_residual;
    let status = if residual < 1e-8 { Status::Good } else { Status::Bad };
    let text = format!("The coprime factors satisfy the Bezout identity to {residual:.1e} (relative).");
    Some(Verdict { status, text, evidence: Evidence::Certificate })
}
