//! A new controller on the page.

use super::decibels::decibel;
use crate::{Error, Result};
use std::f64::consts::TAU;
use youla::identify::likelihood::figure as digits;
use youla::lti::SharedMode;
use youla_loop::redesign::{LoopFigures, Redesign, TriedWeight};
use youla_report::data::{self, DrawnMethod, EvidenceTable, LineStatus, MethodRole, ReportPart, Verdict};
use youla_report::figure::{Axis, Content, Curve, Figure, Panel};

/// The section of the page.
pub(super) fn drawn(redesign: &Redesign) -> Result<data::DrawnRedesign> {
    Ok(data::DrawnRedesign { loops: loops().to_vec(), figure: figure(redesign)?, tables: tables(redesign) })
}

/// What the new controller promises.
pub(super) fn line(redesign: &Redesign, reservation: Option<String>) -> Verdict {
    let good = redesign.gains_damping() && reservation.is_none();
    let status = if good { LineStatus::Good } else { LineStatus::Caution };
    let kept = reservation.map_or_else(String::new, |why| format!(" Do not take it as it is: {why}."));
    Verdict { status, text: sentence(redesign) + &kept, evidence: ReportPart::Redesign }
}

fn sentence(redesign: &Redesign) -> String {
    let Redesign { present, predicted, intervals, .. } = redesign;
    let interval = intervals.as_ref().and_then(|i| i.least_damping);
    let interval =
        interval.map_or_else(String::new, |i| format!(" (95 % interval {:.3} to {:.3})", i.bounds[0], i.bounds[1]));
    let band = redesign.band.map_or_else(String::new, |b| {
        format!(
            "; it stabilises all {} models drawn from the {:.0} % confidence region of the plant",
            b.within,
            100.0 * b.level
        )
    });
    let verb = if redesign.gains_damping() { "raises" } else { "lowers" };
    format!(
        "The new controller {verb} the minimum damping of the loop from {:.3} to {:.3}{interval}. The peak response to a disturbance at the \
         plant input is {:.2} (present controller: {:.2}), that to a slow load {} times as large as now, and the peak sensitivity {:.2} \
         (present: {:.2}){band}. These are predictions: the controller has not run yet.",
        present.least_damping,
        predicted.least_damping,
        predicted.peak_response,
        present.peak_response,
        digits(1.0 / redesign.rejection),
        predicted.peak_sensitivity,
        present.peak_sensitivity
    )
}

fn tables(redesign: &Redesign) -> Vec<EvidenceTable> {
    let of = |figures: &LoopFigures, name: &str| {
        let row = |m: &SharedMode| {
            let share = format!("{:.0} %", 100.0 * m.share);
            vec![name.to_owned(), format!("{:.2}", m.mode.hz), format!("{:.4}", m.mode.zeta), share]
        };
        figures.modes.iter().filter(|m| m.share >= LoopFigures::LEAST_SHARE).map(row).collect::<Vec<_>>()
    };
    let modes = [of(&redesign.present, "present"), of(&redesign.predicted, "new")].concat();
    let number = |v: Option<f64>| v.map_or("–".to_owned(), |v| format!("{v:.3}"));
    let candidate = |c: &TriedWeight| {
        let taken = if c.input_weight == redesign.input_weight { "selected" } else { "" };
        let remark = c.refused.clone().unwrap_or_else(|| taken.into());
        vec![
            c.input_weight.to_string(),
            number(c.least_damping),
            number(c.peak_sensitivity),
            number(c.small_gain),
            remark,
        ]
    };
    vec![
        EvidenceTable {
            text: sentence(redesign),
            caption: "Modes that contribute at least 5 % to the response of y to a disturbance at the plant input, on the design model; channels scaled by their rms."
                .into(),
            ..EvidenceTable::new("Modes of the loop, present and predicted", &["Loop", "Hz", "ζ", "Share"], modes)
        },
        EvidenceTable {
            caption: "Among the candidates within the limits that stabilise all drawn models, the one with the largest minimum damping is selected."
                .into(),
            ..EvidenceTable::new(
                "Weights that were tried",
                &["Weight of u", "Minimum damping", "Peak sensitivity", "Small-gain product", ""],
                redesign.candidates.iter().map(candidate).collect(),
            )
        },
    ]
}

/// Points of the responses that are drawn.
/// Chosen, not measured.
const POINTS: usize = 600;

/// The largest gain from a disturbance at the plant input to y over frequency, now and with the new controller.
///
/// # Errors
/// As [`frequency_response`].
pub(crate) fn figure(redesign: &Redesign) -> Result<Figure> {
    let nyquist = 0.5 / redesign.controller.system.time().ts();
    let hz: Vec<f64> =
        (0..POINTS).map(|k| nyquist * 10f64.powf(-2.5 * (1.0 - (k + 1) as f64 / POINTS as f64))).collect();
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let curve = |method: &DrawnMethod, figures: &LoopFigures| {
        let y = figures.gain(&omega)?.into_iter().map(decibel).collect();
        Ok::<_, Error>(Curve { method: method.key.clone(), x: hz.clone(), y, ..Curve::default() })
    };
    let [present, new] = loops();
    let axis = |label: &str, unit: &str, log| Axis { label: label.into(), unit: unit.into(), log, ..Axis::default() };
    let panel = Panel {
        title: String::new(),
        x: axis("Frequency", "Hz", true),
        y: axis("Largest gain", "dB", false),
        content: Content::Curves(vec![curve(&present, &redesign.present)?, curve(&new, &redesign.predicted)?]),
        ..Panel::default()
    };
    Ok(Figure {
        key: "response".into(),
        title: "The loop, present and predicted".into(),
        caption: "Largest gain from a disturbance at the plant input to y, channels in their rms.".into(),
        panels: vec![panel],
        ..Figure::default()
    })
}

/// The two loops as the figure names them.
pub(crate) fn loops() -> [DrawnMethod; 2] {
    [
        DrawnMethod::new("present", "controller that ran", MethodRole::Nominal),
        DrawnMethod::new("new", "new controller", MethodRole::Hansen),
    ]
}
