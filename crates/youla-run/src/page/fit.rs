//! The line on the fit on fresh data, with the reason where the fit is low: an offset or travel, noise, or none that the run knows.

use super::verdict::{name, subject};
use crate::method::Method;
use crate::result::Identification;
use crate::summary::Summary;
use crate::summary::entries::RealPoleEntry;
use crate::summary::model::ModelEntry;
use youla::identify::likelihood::Evidence;
use youla_report::data::{LineStatus, ReportPart, Verdict};
use youla_report::numbers;

/// Residual of the model over that of the nominal model, from which the fit is called worse: two good models differ by chance.
/// 5 %. Chosen, not measured.
const WORSE: f64 = 1.05;
/// Mean fit in percent below which the line says what is left: half of the size of the output. Chosen, not measured.
const LOW: f64 = 50.0;
/// Share of the power of what is left from which a constant and a straight line are the reason. Chosen, not measured.
const MOSTLY: f64 = 0.5;

pub(super) fn line(found: &Identification, summary: &Summary) -> Option<Verdict> {
    if found.records.verification.is_empty() {
        let text = "No verification record was given, so the fit on fresh data is unknown.".into();
        return Some(Verdict { status: LineStatus::Caution, text, evidence: ReportPart::Fits });
    }
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
    let reason = (fit < LOW).then(|| reason(left(found, method), model));
    text += reason.as_ref().map_or("", |(_, words)| words);
    // A fit says how much of the output is not noise; a high one is no evidence of a right model.
    let worse = !fit.is_finite() || nominal.is_some_and(|nominal| 100.0 - fit > WORSE * (100.0 - nominal));
    // Beside a model that passed its tests the fits of two models differ by travel or noise that both leave.
    let trusted = found.recommended.as_ref().is_ok_and(|model| model.trusted());
    let status = match worse {
        true if trusted => LineStatus::Caution,
        true => LineStatus::Bad,
        false => reason.map_or(LineStatus::Info, |(status, _)| status),
    };
    Some(Verdict { status, text, evidence: ReportPart::Fits })
}

/// The same as a sentence for the terminal, where the fit is low and not a warning, which is among those of the run.
pub fn low_fit(found: &Identification, summary: &Summary) -> Option<String> {
    let (_, model) = subject(found, summary)?;
    model.mean_fit().filter(|fit| *fit < LOW)?;
    line(found, summary).filter(|line| line.status == LineStatus::Info).map(|line| line.text)
}

fn percent(fit: f64) -> String {
    if fit.is_finite() { format!("{} %", numbers::fit(fit, 1)) } else { "no prediction".into() }
}

/// What a model leaves of the fresh outputs, over all records and outputs in parts of their variance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Left {
    /// Share of a constant and a straight line in the power of what is left.
    slow: f64,
    /// Mean fit without them, percent.
    fit: f64,
}

/// `None` where the model has no prediction.
fn left(found: &Identification, method: Method) -> Option<Left> {
    let model = found.validation.models.iter().find(|v| v.method == method)?;
    let skip = found.settings.verification.skip;
    let (mut slow, mut all, mut fits) = (0.0, 0.0, Vec::new());
    for (record, of) in found.records.verification.iter().zip(&model.records) {
        let predicted = of.predicted.as_ref().ok()?;
        for output in 0..record.outputs() {
            let measured: Vec<f64> = record.y().col(output).iter().skip(skip).copied().collect();
            let rest: Vec<f64> =
                measured.iter().zip(predicted.col(output).iter().skip(skip)).map(|(y, p)| y - p).collect();
            let variance = Moments::of(&measured).variance;
            let of_rest = Moments::of(&rest);
            if !(variance > 0.0 && of_rest.power.is_finite()) {
                continue;
            }
            all += of_rest.power / variance;
            slow += (of_rest.power - of_rest.beside_line) / variance;
            fits.push(100.0 * (1.0 - (of_rest.beside_line / variance).sqrt()));
        }
    }
    (all > 0.0).then(|| Left { slow: slow / all, fit: fits.iter().sum::<f64>() / fits.len() as f64 })
}

/// Mean squares of a signal: about zero, about its mean, and about its straight line.
struct Moments {
    power: f64,
    variance: f64,
    beside_line: f64,
}

impl Moments {
    /// With the time `t` centred, the line through the mean takes `(mean of t x)^2 / (mean of t^2)` off the variance.
    fn of(signal: &[f64]) -> Self {
        let n = signal.len() as f64;
        let centred = |k: usize| k as f64 - 0.5 * (n - 1.0);
        let mean = signal.iter().sum::<f64>() / n;
        let power = signal.iter().map(|x| x * x).sum::<f64>() / n;
        let variance = signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        let along = signal.iter().enumerate().map(|(k, x)| centred(k) * (x - mean)).sum::<f64>() / n;
        let of_time = (n * n - 1.0) / 12.0;
        let line = if of_time > 0.0 { along * along / of_time } else { 0.0 };
        Moments { power, variance, beside_line: (variance - line).max(0.0) }
    }
}

/// Why a fit is low, and whether that is a warning.
fn reason(left: Option<Left>, model: &ModelEntry) -> (LineStatus, String) {
    let slow = left.filter(|left| left.slow >= MOSTLY);
    let mut text = slow.map_or_else(String::new, |left| of_offset(left, model));
    if slow.is_some_and(|left| left.fit >= LOW) {
        return (LineStatus::Info, text);
    }
    let rest = if slow.is_some() { "The rest of it" } else { "What is left" };
    let (status, words) = match independent(model) {
        Some(true) => (LineStatus::Info, "does not depend on past excitation: it is noise and disturbance"),
        Some(false) => (LineStatus::Info, "depends on past excitation: see the line on the residual"),
        None => (
            LineStatus::Caution,
            "is not explained: no excitation is known that would tell noise from missing dynamics",
        ),
    };
    text += &format!(" {rest} {words}.");
    (status, text)
}

fn of_offset(left: Left, model: &ModelEntry) -> String {
    let level = match model.real_poles.iter().any(may_integrate) {
        true => {
            " The plant has a real pole that is not told from an integrator, so that the level of its output is not determined by the input."
        }
        false => "",
    };
    format!(
        " A constant and a straight line over the record, an offset or travel at which the model does not aim, make {:.0} % of the power of what \
         is left; without them the mean fit is {}.{level}",
        100.0 * left.slow,
        percent(left.fit)
    )
}

/// Whether two standard deviations of the frequency of a real pole reach zero.
fn may_integrate(pole: &RealPoleEntry) -> bool {
    pole.hz.is_some_and(|hz| hz <= 2.0 * pole.hz_deviation.unwrap_or(0.0))
}

/// Whether what is left depends on past excitation, in any record; `None` where that was not tested.
fn independent(model: &ModelEntry) -> Option<bool> {
    let tested: Vec<bool> = model.residuals.values().filter_map(|r| r.independent).collect();
    (!tested.is_empty()).then(|| tested.iter().all(|independent| *independent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_leaves_nothing_beside_itself() {
        let line: Vec<f64> = (0..50).map(|k| 3.0 - 0.2 * f64::from(k)).collect();
        let moments = Moments::of(&line);
        assert!(moments.beside_line < 1e-12 * moments.power && moments.variance > 1.0);
        let swing: Vec<f64> = (0..50).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let moments = Moments::of(&swing);
        assert!((moments.beside_line - 1.0).abs() < 0.01, "{}", moments.beside_line);
    }
}
