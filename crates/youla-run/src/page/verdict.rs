//! The answer to "Can it be trusted?": the recommended model with its evidence, fit and residuals on fresh data, data and controller,
//! the loop.

use super::{fit, loops, nonparametric};
use crate::Error;
use crate::check::OF_SETTINGS;
use crate::method::Method;
use crate::result::Identification;
use crate::summary::Summary;
use crate::summary::model::{ModelEntry, ResidualEntry};
use youla::identify::likelihood::{Evidence, TestOutcome};
use youla_loop::check::{Finding, Severity, Test};
use youla_report::data::{LineStatus, ReportPart, Verdict};
use youla_report::numbers;

/// The lines, each with its evidence.
pub(crate) fn verdict_lines(found: &Identification, summary: &Summary) -> Vec<Verdict> {
    let rest = [unnoticed_line(found), fit::line(found, summary), residual_line(found, summary)];
    let last = [data_line(found), loop_line(found, summary)];
    let of_model = recommended_lines(found).into_iter().chain(nonparametric::verdict_lines(found));
    let of_loop = loops::lines(found, summary).into_iter().filter(loops::warns);
    of_model.chain(rest.into_iter().chain(last).flatten()).chain(of_loop).collect()
}

/// The line on the recommended model, then one line for each question that its evidence fails.
fn recommended_lines(found: &Identification) -> Vec<Verdict> {
    let line = |status, text: String| Verdict { status, text, evidence: ReportPart::Recommended };
    let model = match &found.recommended {
        Ok(model) => model,
        Err(reason) => return vec![line(LineStatus::Bad, no_model(found, reason))],
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
    let status = if failed.is_empty() { LineStatus::Good } else { LineStatus::Bad };
    let first = line(status, format!("{} {what}.", model.sentence()));
    let named = model.evidence.iter().filter(|e| !e.required && e.outcome == TestOutcome::Failed);
    let named = named.map(|e| line(LineStatus::Caution, format!("{e}.")));
    let failed = failed.into_iter().map(|e| line(LineStatus::Bad, format!("{e}.")));
    std::iter::once(first).chain(failed).chain(named).collect()
}

/// Why no model is recommended, and what would give one.
fn no_model(found: &Identification, reason: &Error) -> String {
    let Some(root @ youla::Error::ConstantChannel { what, value }) = reason.root() else {
        return format!("No model is recommended: {reason}.");
    };
    let named =
        what.strip_prefix("input ").and_then(|n| found.records.inputs.get(n.parse::<usize>().ok()?.checked_sub(1)?));
    match named {
        Some(channel) => format!(
            "No model is recommended: the input {:?} is {value} in every record, so its effect cannot be told from the offset of the outputs. \
             Take it out of `inputs` in [data] where no physical structure needs it, or record an experiment in which it changes.",
            channel.name
        ),
        None => format!(
            "No model is recommended: {root}. Check that the column is the right one, and record an experiment in which it changes."
        ),
    }
}

/// The model that the lines are about: the recommended one, else the first that was identified.
pub(super) fn subject<'a>(found: &Identification, summary: &'a Summary) -> Option<(Method, &'a ModelEntry)> {
    let given = [Method::Nominal, Method::TruePlant];
    let method = found.validation.models.iter().map(|v| v.method).find(|method| !given.contains(method))?;
    Some((method, summary.model(method)?))
}

/// The name of a model in a sentence.
pub(super) fn name(method: Method) -> &'static str {
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

/// Without a known excitation: which errors the run has no means to notice.
fn unnoticed_line(found: &Identification) -> Option<Verdict> {
    let of_plant = found.records.measured.as_ref().is_some_and(|m| !m.of_loop);
    let unknown = !found.settings.data.excitation_is_known() && !of_plant && !found.declared.controller().is_zero();
    let text = "No excitation is declared, so these errors could not be noticed: a wrong gain, sign or delay of [controller]; u and y \
                shifted against each other; exchanged channels; noise taken for excitation. Declare `input_excitation` or `reference` \
                in [data].";
    unknown.then(|| Verdict { status: LineStatus::Caution, text: text.into(), evidence: ReportPart::Signals })
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
        (LineStatus::Caution, text)
    } else if dependent().next().is_none() {
        let text = format!(
            "The residual of {name} on fresh data does not depend on past excitation: it shows no missing dynamics above its noise."
        );
        (LineStatus::Good, text)
    } else if dependent().all(explained) {
        let text =
            format!("{name} explains 99.9 % of the output on fresh data; what is left is too small to judge by.");
        (LineStatus::Good, capital(&text))
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
        (LineStatus::Caution, text)
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
    let count = |severity: Severity, of_settings: bool| {
        let counted = |f: &Finding| f.severity == severity && (f.record == OF_SETTINGS) == of_settings;
        found.data.grouped().iter().filter(|(f, _)| counted(f)).count()
    };
    let (defects, warnings) = (count(Severity::Defect, false), count(Severity::Caution, false));
    let of_check = match (defects, warnings) {
        (0, 0) => LineStatus::Good,
        (0, _) => LineStatus::Caution,
        _ => LineStatus::Bad,
    };
    let checked = counts([
        (defects, "data defect"),
        (warnings, "data warning"),
        (count(Severity::Caution, true), "warning about the settings"),
    ]);
    // The gravest of them; that of the controller has its sentence.
    let others = found.data.findings.iter().filter(|f| f.test != Test::Controller && f.severity >= Severity::Caution);
    let gravest = others.max_by_key(|f| f.severity);
    let which = gravest.map_or(String::new(), |f| format!(": {}", f.what));
    let text = format!("{controller} {checked}{which}.");
    let evidence = if of_controller > of_check { ReportPart::Signals } else { ReportPart::Data };
    Some(Verdict { status: of_controller.max(of_check), text, evidence })
}

/// Findings of each kind as they are listed.
fn counts(kinds: [(usize, &str); 3]) -> String {
    let [(defects, _), (warnings, _), _] = kinds;
    let none = (defects + warnings == 0).then(|| "No data problems found".to_owned());
    let plural = |name: &str| match name.split_once(' ') {
        Some(("warning", rest)) => format!("warnings {rest}"),
        _ => format!("{name}s"),
    };
    let some = kinds.into_iter().filter(|(n, _)| *n > 0);
    let words = some.map(|(n, name)| if n == 1 { format!("1 {name}") } else { format!("{n} {}", plural(name)) });
    none.into_iter().chain(words).collect::<Vec<_>>().join(", ")
}

/// What the check of the data says of the declared controller.
fn controller_sentence(found: &Identification) -> (String, LineStatus) {
    if found.declared.controller().is_zero() {
        return ("No controller ran.".into(), LineStatus::Good);
    }
    let Some(finding) = found.data.controller() else { return of_alpha(found) };
    let status = match finding.severity {
        // a note without a remedy: the controller agrees
        Severity::Note if finding.advice.is_empty() => LineStatus::Good,
        Severity::Note => LineStatus::Info,
        Severity::Caution => LineStatus::Caution,
        Severity::Defect => LineStatus::Bad,
    };
    let told = finding.numbers.contains_key("residual_after");
    let advice = if told { format!(" {}.", finding.advice) } else { String::new() };
    (capital(&format!("{}.{advice}", finding.what)), status)
}

/// The same from the alpha that the factors give, where alpha itself was logged.
fn of_alpha(found: &Identification) -> (String, LineStatus) {
    match found.controller_mismatch() {
        None => {
            let text = "No excitation is declared, so the declared controller could not be verified against the log.";
            (text.into(), LineStatus::Info)
        }
        Some(m) => {
            // The thresholds `controller_caution` and `controller_defect` of the check of the data.
            let (status, words) = match m {
                m if m < 0.01 => (LineStatus::Good, "explains the logged input"),
                m if m < 0.1 => (LineStatus::Caution, "explains the logged input only roughly"),
                _ => (LineStatus::Bad, "does not explain the logged input; check its sign, delay and saturation"),
            };
            (format!("The declared controller {words} (relative error of alpha {m:.1e})."), status)
        }
    }
}

/// Distance of a pole from the unit circle that rounding may make: half of the digits of double precision, of a double pole.
const ROUNDING: f64 = 1e-8;

/// Whether the records do not distinguish the largest pole of the loop of the recommended model from one inside of the unit circle: its test passes.
pub fn undecided(found: &Identification, method: Method) -> bool {
    let outside = |e: &Evidence| e.question.ends_with("(stability)") && e.figure >= e.limit;
    let passed = |e: &Evidence| outside(e) && e.outcome == TestOutcome::Passed;
    method == Method::Likelihood && found.recommended.as_ref().is_ok_and(|model| model.evidence.iter().any(passed))
}

/// Whether the controller stabilises the model.
fn loop_line(found: &Identification, summary: &Summary) -> Option<Verdict> {
    let (method, model) = subject(found, summary)?;
    let (name, size) = (name(method), model.worst_closed_loop_pole().map_or(0.0, |[re, im]| re.hypot(im)));
    let (status, verb, adjective) = match model.stabilised_by_controller {
        true if 1.0 - size < ROUNDING => (LineStatus::Caution, "stabilises", "stable"),
        true => (LineStatus::Good, "stabilises", "stable"),
        false => (LineStatus::Bad, "does not stabilise", "unstable"),
    };
    let worst = numbers::radius(size);
    let near = match status {
        LineStatus::Caution => ", which rounding does not tell from 1: the loop may have a mode that does not decay",
        _ => "",
    };
    if undecided(found, method) {
        let text = format!(
            "The records do not distinguish the largest pole of the loop of {name}, |z| = {worst}, from one inside of the unit circle, where it \
             was while the machine ran with this controller."
        );
        return Some(Verdict { status: LineStatus::Caution, text, evidence: ReportPart::Certificate });
    }
    let text = match found.declared.controller().is_zero() {
        true => format!("Stability: {name} is {adjective}; its largest pole has |z| = {worst}{near}."),
        false => {
            format!("The controller that ran {verb} {name}: the largest pole of the loop has |z| = {worst}{near}.")
        }
    };
    Some(Verdict { status, text, evidence: ReportPart::Certificate })
}
