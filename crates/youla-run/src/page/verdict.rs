//! The answer to "Can it be trusted?": the recommended model with its evidence, fit and residuals on fresh data, data and controller,
//! the loop.

use crate::check::OF_SETTINGS;
use crate::method::Method;
use crate::result::Identification;
use crate::stages::nonparametric;
use crate::stages::validate::ModelVerdict;
use crate::stages::validate::residuals::RecordResiduals;
use crate::summary::recommended;
use youla::identify::subspace::DeviationEvidence;
use youla_loop::check::{Finding, Severity};
use youla_report::data::{ReportPart, Status, Verdict};

/// The lines, each with its evidence.
pub(crate) fn verdict_lines(found: &Identification) -> Vec<Verdict> {
    let rest = [unnoticed_line, fit_line, residual_line, data_line, loop_line];
    let of_model = recommended::verdict_lines(found).into_iter().chain(nonparametric::verdict_lines(found));
    of_model.chain(rest.iter().filter_map(|line| line(found))).collect()
}

/// The model that the lines are about: the recommended one, G(S) where there is none.
fn subject(found: &Identification) -> (Method, &'static str) {
    match found.recommended {
        Ok(_) => (Method::Likelihood, "the recommended model"),
        Err(_) => (Method::Hansen, "G(S)"),
    }
}

/// Mean fit over all verification records and outputs.
fn mean_fit(v: &ModelVerdict) -> f64 {
    let all: Vec<f64> = v.records.iter().flat_map(|r| r.fit.iter().copied()).collect();
    all.iter().sum::<f64>() / all.len() as f64
}

fn fit_line(found: &Identification) -> Option<Verdict> {
    if found.records.verification.is_empty() {
        let text = "No verification record was given, so the fit on fresh data is unknown.".into();
        return Some(Verdict { status: Status::Caution, text, evidence: ReportPart::Fits });
    }
    let percent = |fit: f64| if fit.is_finite() { format!("{fit:.1} %") } else { "no prediction".into() };
    let of = |method: Method| found.verdict.of(method).map(mean_fit);
    let (method, name) = subject(found);
    let (fit, nominal) = (of(method)?, of(Method::Nominal)?);
    let mut text =
        format!("On fresh data {name} has a mean fit of {}, the nominal model {}", percent(fit), percent(nominal));
    for (other, name) in [(Method::Hansen, "G(S)"), (Method::Direct, "the direct model")] {
        if let Some(fit) = of(other).filter(|_| other != method) {
            text += &format!(", {name} {}", percent(fit));
        }
    }
    text.push('.');
    // A fit says how much of the output is not noise; a high one is no evidence of a right model.
    let worse = !fit.is_finite() || nominal > fit;
    Some(Verdict { status: if worse { Status::Bad } else { Status::Info }, text, evidence: ReportPart::Fits })
}

/// Without a known excitation: which errors the run has no means to notice.
fn unnoticed_line(found: &Identification) -> Option<Verdict> {
    let of_plant = found.records.measured.as_ref().is_some_and(|m| !m.of_loop);
    let unknown = !found.settings.data.excitation_is_known() && !of_plant && !found.declared.controller.is_zero();
    let text = "No excitation is declared, so these errors could not be noticed: a wrong gain, sign or delay of [controller]; u and y \
                shifted against each other; exchanged channels; noise taken for excitation. Declare `input_excitation` or `reference` \
                in [data].";
    unknown.then(|| Verdict { status: Status::Caution, text: text.into(), evidence: ReportPart::Signals })
}

/// Whether the residual depends on what excited the loop; nothing without a verification record.
fn residual_line(found: &Identification) -> Option<Verdict> {
    let (method, name) = subject(found);
    let records = &found.verdict.of(method)?.records;
    let tested: Vec<_> = records.iter().filter_map(|r| Some((r.record.as_str(), r.residuals.as_ref()?))).collect();
    let dependent = || tested.iter().map(|(_, r)| *r).filter(|r| !r.correlations.independent);
    let (status, text) = match tested.iter().max_by(|a, b| size(a.1).total_cmp(&size(b.1)))? {
        (_, worst) if !worst.external => {
            let text = format!(
                "No external excitation is known, so the residuals of {name} were not tested for dependence on it."
            );
            (Status::Caution, text)
        }
        _ if tested.iter().all(|(_, r)| r.correlations.independent) => (
            Status::Good,
            format!(
                "The residual of {name} on fresh data does not depend on past excitation: no missing dynamics detected."
            ),
        ),
        _ if dependent().all(explained) => {
            let text =
                format!("{name} explains 99.9 % of the output on fresh data; what is left is too small to judge by.");
            (Status::Good, capital(&text))
        }
        (record, worst) => {
            let at = worst.correlations.largest?;
            let (output, input) = (&found.records.outputs[at.output].name, &worst.excitations[at.input]);
            let text = format!(
                "The residual of {name} on fresh data depends on past excitation: the residual of {output} in {record} has a \
                 correlation of {:.3} with {input} at a lag of {} samples ({:.0} standard deviations).",
                size(worst),
                at.lag,
                at.deviations.abs()
            );
            (Status::Caution, text)
        }
    };
    Some(Verdict { status, text, evidence: ReportPart::Residuals })
}

/// Fit of the simulation, in percent, from which a dependence of what is left is of no account: of noise-free records a residual of
/// rounding and of the last digits of the model depends on everything.
/// 60 dB. Chosen, not measured.
const EXPLAINED: f64 = 99.9;

fn explained(residuals: &RecordResiduals) -> bool {
    residuals.k_step_fits.last().is_some_and(|fits| fits.iter().all(|fit| *fit >= EXPLAINED))
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |c| c.to_uppercase().collect::<String>() + letters.as_str())
}

/// The causal correlation that is largest in its standard deviations.
fn size(residuals: &RecordResiduals) -> f64 {
    let tests = &residuals.correlations;
    let Some(at) = tests.largest else { return 0.0 };
    let with = tests.cross.iter().find(|c| (c.output, c.input) == (at.output, at.input));
    with.map_or(0.0, |c| c.values[c.values.len() / 2 + at.lag].abs())
}

/// The result of the check of the data, and whether the declared controller explains the logged input.
fn data_line(found: &Identification) -> Option<Verdict> {
    if found.records.measured.is_some() && found.records.verification.is_empty() {
        return None;
    }
    let (controller, of_controller) = controller_sentence(found);
    let of_data = |f: &Finding, severity: Severity| f.severity == severity && f.record != OF_SETTINGS;
    let count = |severity: Severity| found.data.grouped().iter().filter(|(f, _)| of_data(f, severity)).count();
    let (defects, cautions) = (count(Severity::Defect), count(Severity::Caution));
    let (checked, of_check) = match (defects, cautions) {
        (0, 0) => ("No data problems found".to_owned(), Status::Good),
        (0, n) => (format!("{n} data warning{}", if n == 1 { "" } else { "s" }), Status::Caution),
        (n, _) => (format!("{n} data defect{}", if n == 1 { "" } else { "s" }), Status::Bad),
    };
    let text = format!("{controller} {checked}.");
    let evidence = if of_controller > of_check { ReportPart::Signals } else { ReportPart::Data };
    Some(Verdict { status: of_controller.max(of_check), text, evidence })
}

/// What the check of the data says of the declared controller.
fn controller_sentence(found: &Identification) -> (String, Status) {
    if found.declared.controller.is_zero() {
        return ("No controller ran.".into(), Status::Good);
    }
    let Some(finding) = found.data.controller() else { return of_alpha(found) };
    let status = match finding.severity {
        // a note without a remedy: the controller agrees
        Severity::Note if finding.advice.is_empty() => Status::Good,
        Severity::Note => Status::Info,
        Severity::Caution => Status::Caution,
        Severity::Defect => Status::Bad,
    };
    (capital(&format!("{}.", finding.what)), status)
}

/// The same from the alpha that the factors give, where alpha itself was logged.
fn of_alpha(found: &Identification) -> (String, Status) {
    match found.controller_mismatch() {
        None => {
            let text = "No excitation is declared, so the declared controller could not be verified against the log.";
            (text.into(), Status::Info)
        }
        Some(m) => {
            // The thresholds `controller_caution` and `controller_defect` of the check of the data.
            let (status, words) = match m {
                m if m < 0.01 => (Status::Good, "explains the logged input"),
                m if m < 0.1 => (Status::Caution, "explains the logged input only roughly"),
                _ => (Status::Bad, "does not explain the logged input; check its sign, delay and saturation"),
            };
            (format!("The declared controller {words} (relative error of alpha {m:.1e})."), status)
        }
    }
}

/// Order and fit of S and, where its uncertainty is computed, whether it differs from noise.
pub(crate) fn deviation_line(found: &Identification) -> Option<Verdict> {
    let hansen = &found.scheme()?.hansen;
    let s = &hansen.deviation;
    let stable = if s.stability.stable { "stable" } else { "unstable" };
    let fit: Vec<String> = s.fit.percent.iter().map(|f| format!("{f:.1} %")).collect();
    let text = format!("S has order {}, is {stable} and fits beta to {}", s.model.order(), fit.join(", "));
    // Stability of S is no evidence that S is right.
    let of_stability = if s.stability.stable { Status::Info } else { Status::Bad };
    let (more, of_evidence) = match hansen.evidence.as_ref().and_then(|e| e.as_ref().ok()) {
        Some(evidence) => information(evidence),
        None => (".".into(), Status::Info),
    };
    Some(Verdict { status: of_stability.max(of_evidence), text: text + &more, evidence: ReportPart::Order })
}

fn information(evidence: &DeviationEvidence) -> (String, Status) {
    let figures = format!(
        "t = {:.1}, threshold {:.1} at {:.0} %",
        evidence.statistic,
        evidence.threshold,
        100.0 * evidence.level
    );
    if evidence.against_nominal() {
        (
            format!("; models from each half of the data agree: the data contradict the nominal model ({figures})."),
            Status::Good,
        )
    } else {
        let text = format!(
            "; models from each half of the data do not agree: S may be noise, there is no evidence against the nominal model ({figures})."
        );
        (text, Status::Caution)
    }
}

/// Whether the controller stabilises the model.
fn loop_line(found: &Identification) -> Option<Verdict> {
    let (method, name) = subject(found);
    let v = found.verdict.of(method)?;
    let worst = v.certificate.worst_pole.map_or(0.0, |p| p.norm());
    let (of_loop, verb, adjective) = match v.certificate.stable {
        true => (Status::Good, "stabilises", "stable"),
        false => (Status::Bad, "does not stabilise", "unstable"),
    };
    let text = match found.declared.controller.is_zero() {
        true => format!("Stability: {name} is {adjective}; its largest pole has |z| = {worst:.5}."),
        false => format!("The controller that ran {verb} {name}: the largest pole of the loop has |z| = {worst:.5}."),
    };
    Some(Verdict { status: of_loop, text, evidence: ReportPart::Certificate })
}

/// Whether the controller stabilises every model within the region of S, where an uncertainty was asked for.
pub(crate) fn region_line(found: &Identification) -> Option<Verdict> {
    let certificate = &found.scheme()?.certificate;
    let (text, band) = certificate.band_sentence().zip(certificate.band.as_ref())?;
    let status = if band.holds() { Status::Good } else { Status::Caution };
    Some(Verdict { status, text, evidence: ReportPart::Certificate })
}
