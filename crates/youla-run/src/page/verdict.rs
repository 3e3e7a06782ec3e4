//! The answer to "Can it be trusted?": the recommended model with its evidence, fit and residuals on fresh data, data and controller,
//! the loop.

use super::nonparametric;
use crate::check::OF_SETTINGS;
use crate::method::Method;
use crate::result::Identification;
use crate::summary::Summary;
use crate::summary::model::{ModelEntry, ResidualEntry};
use youla::identify::likelihood::{Evidence, Outcome};
use youla_loop::check::{Finding, Severity};
use youla_report::data::{ReportPart, Status, Verdict};
use youla_report::numbers;

/// The lines, each with its evidence.
pub(crate) fn verdict_lines(found: &Identification, summary: &Summary) -> Vec<Verdict> {
    let rest = [unnoticed_line(found), fit_line(found, summary), residual_line(found, summary)];
    let last = [data_line(found), loop_line(found, summary)];
    let of_model = recommended_lines(found).into_iter().chain(nonparametric::verdict_lines(found));
    of_model.chain(rest.into_iter().chain(last).flatten()).collect()
}

/// The line on the recommended model, then one line for each question that its evidence fails.
fn recommended_lines(found: &Identification) -> Vec<Verdict> {
    let line = |status, text: String| Verdict { status, text, evidence: ReportPart::Recommended };
    let model = match &found.recommended {
        Ok(model) => model,
        Err(reason) => return vec![line(Status::Bad, format!("No model is recommended: {reason}."))],
    };
    let dead_time = match &model.dead_time[..] {
        delays if delays.iter().all(|d| *d == 0) => String::new(),
        [1] => " and a dead time of 1 sample".to_owned(),
        delays => {
            let delays: Vec<String> = delays.iter().map(usize::to_string).collect();
            format!(" and a dead time of {} samples", delays.join(", "))
        }
    };
    let what = format!("The recommended model has order {}{dead_time}", model.order);
    let failed: Vec<&Evidence> = model.evidence.iter().filter(|e| !e.holds()).collect();
    let status = if failed.is_empty() { Status::Good } else { Status::Bad };
    let first = line(status, format!("{} {what}.", model.sentence()));
    let named = model.evidence.iter().filter(|e| !e.required && e.outcome == Outcome::Failed);
    let named = named.map(|e| line(Status::Caution, format!("{e}.")));
    let failed = failed.into_iter().map(|e| line(Status::Bad, format!("{e}.")));
    std::iter::once(first).chain(failed).chain(named).collect()
}

/// The model that the lines are about: the recommended one, else the first that was identified.
fn subject<'a>(found: &Identification, summary: &'a Summary) -> Option<(Method, &'a ModelEntry)> {
    let given = [Method::Nominal, Method::TruePlant];
    let method = found.validation.models.iter().map(|v| v.method).find(|method| !given.contains(method))?;
    Some((method, summary.model(method)?))
}

/// The name of a model in a sentence.
fn name(method: Method) -> &'static str {
    match method {
        Method::Likelihood => "the recommended model",
        Method::Hansen => "G(S)",
        Method::HansenReduced => "the reduced model",
        Method::Direct => "the direct model",
        Method::GreyBox => "the physical structure",
        Method::Nominal => "the nominal model",
        Method::TruePlant => "the true plant",
    }
}

/// Residual of the model over that of the nominal model, from which the fit is called worse: two good models differ by chance.
/// 5 %. Chosen, not measured.
const WORSE: f64 = 1.05;

fn fit_line(found: &Identification, summary: &Summary) -> Option<Verdict> {
    if found.records.verification.is_empty() {
        let text = "No verification record was given, so the fit on fresh data is unknown.".into();
        return Some(Verdict { status: Status::Caution, text, evidence: ReportPart::Fits });
    }
    let percent =
        |fit: f64| if fit.is_finite() { format!("{} %", numbers::fit(fit, 1)) } else { "no prediction".into() };
    let of = |method: Method| summary.model(method)?.mean_fit();
    let (method, model) = subject(found, summary)?;
    let (fit, nominal) = (model.mean_fit()?, of(Method::Nominal));
    let mut text = format!("On fresh data {} has a mean fit of {}", name(method), percent(fit));
    for other in [Method::Nominal, Method::Hansen, Method::Direct] {
        if let Some(fit) = of(other).filter(|_| other != method) {
            text += &format!(", {} {}", name(other), percent(fit));
        }
    }
    text.push('.');
    let taken = |e: &Evidence| e.question.contains("(lines)");
    if found.recommended.as_ref().is_ok_and(|model| model.evidence.iter().any(taken)) {
        text += " The measured outputs hold the lines that no model here predicts.";
    }
    // A fit says how much of the output is not noise; a high one is no evidence of a right model.
    let worse = !fit.is_finite() || nominal.is_some_and(|nominal| 100.0 - fit > WORSE * (100.0 - nominal));
    Some(Verdict { status: if worse { Status::Bad } else { Status::Info }, text, evidence: ReportPart::Fits })
}

/// Without a known excitation: which errors the run has no means to notice.
fn unnoticed_line(found: &Identification) -> Option<Verdict> {
    let of_plant = found.records.measured.as_ref().is_some_and(|m| !m.of_loop);
    let unknown = !found.settings.data.excitation_is_known() && !of_plant && !found.declared.controller().is_zero();
    let text = "No excitation is declared, so these errors could not be noticed: a wrong gain, sign or delay of [controller]; u and y \
                shifted against each other; exchanged channels; noise taken for excitation. Declare `input_excitation` or `reference` \
                in [data].";
    unknown.then(|| Verdict { status: Status::Caution, text: text.into(), evidence: ReportPart::Signals })
}

/// Whether the residual depends on what excited the loop; nothing without a verification record.
fn residual_line(found: &Identification, summary: &Summary) -> Option<Verdict> {
    let (method, model) = subject(found, summary)?;
    let name = name(method);
    let dependent = || model.residuals.values().filter(|r| r.independent == Some(false));
    let deviations = |r: &ResidualEntry| r.largest.as_ref().and_then(|l| l.correlation).map_or(0.0, f64::abs);
    let (record, worst) = model.residuals.iter().max_by(|a, b| deviations(a.1).total_cmp(&deviations(b.1)))?;
    let (status, text) = if worst.independent.is_none() {
        let text = format!(
            "No external excitation is known, so the residuals of {name} were not tested for dependence on it."
        );
        (Status::Caution, text)
    } else if dependent().next().is_none() {
        let text = format!(
            "The residual of {name} on fresh data does not depend on past excitation: no missing dynamics detected."
        );
        (Status::Good, text)
    } else if dependent().all(explained) {
        let text =
            format!("{name} explains 99.9 % of the output on fresh data; what is left is too small to judge by.");
        (Status::Good, capital(&text))
    } else {
        let at = worst.largest.as_ref()?;
        let (output, input) = (&found.records.outputs[at.output].name, &worst.excitations[at.input]);
        let text = format!(
            "The residual of {name} on fresh data depends on past excitation: the residual of {output} in {record} has a correlation of \
             {:.3} with {input} at a lag of {} samples ({:.0} standard deviations).",
            deviations(worst),
            at.lag,
            at.deviations.map_or(f64::NAN, f64::abs)
        );
        (Status::Caution, text)
    };
    Some(Verdict { status, text, evidence: ReportPart::Residuals })
}

/// Fit of the simulation, in percent, from which a dependence of what is left is of no account: of noise-free records a residual of
/// rounding and of the last digits of the model depends on everything.
/// 60 dB. Chosen, not measured.
const EXPLAINED: f64 = 99.9;

fn explained(residual: &ResidualEntry) -> bool {
    let fits = residual.k_step_fits.get("simulation");
    fits.is_some_and(|fits| fits.iter().all(|fit| fit.is_some_and(|fit| fit >= EXPLAINED)))
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |c| c.to_uppercase().collect::<String>() + letters.as_str())
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
    if found.declared.controller().is_zero() {
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

/// Whether the controller stabilises the model.
fn loop_line(found: &Identification, summary: &Summary) -> Option<Verdict> {
    let (method, model) = subject(found, summary)?;
    let (name, worst) = (name(method), model.worst_closed_loop_pole().map_or(0.0, |[re, im]| re.hypot(im)));
    let (status, verb, adjective) = match model.stabilised_by_controller {
        true => (Status::Good, "stabilises", "stable"),
        false => (Status::Bad, "does not stabilise", "unstable"),
    };
    let text = match found.declared.controller().is_zero() {
        true => format!("Stability: {name} is {adjective}; its largest pole has |z| = {worst:.5}."),
        false => format!("The controller that ran {verb} {name}: the largest pole of the loop has |z| = {worst:.5}."),
    };
    Some(Verdict { status, text, evidence: ReportPart::Certificate })
}
