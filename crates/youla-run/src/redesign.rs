//! `[redesign]`: a new controller on the model of a run, with what it is worth.

use super::pipeline::Identification;
use super::response::decibel;
use crate::{Error, Result};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use youla::lti::{SharedMode, frequency_response};
use youla_io::export::{ExportedController, FilterData, ObserverData};
use youla_loop::redesign::{Candidate, LoopFigures, Redesign, RedesignProblem, redesign};
use youla_report::data as draw;
use youla_report::figure::{Axis, Content, Curve, Figure, Layout, Panel};

/// Designs on the reduced model where there is one, else on G(S).
///
/// # Errors
/// As [`redesign`].
pub(super) fn redesigned(found: &Identification) -> Option<Result<Redesign>> {
    let options = found.settings.redesign.as_ref()?;
    let reduced = found.reduction.as_ref().and_then(|r| r.as_ref().ok());
    let (input, output) = found.records.sizes();
    let problem = RedesignProblem {
        model: reduced.map_or(&found.hansen.plant, |r| &r.found.reduction.model),
        factors: &found.factorisation.factors,
        deviation: &found.hansen.deviation.model,
        uncertainty: found.hansen.deviation.uncertainty.as_ref(),
        input_size: &input,
        output_size: &output,
    };
    Some(redesign(&problem, options).map_err(|e| Error::from(e).within("[redesign]")))
}

/// The controller as `youla-rt` takes it.
pub(super) fn exported(found: &Identification, redesign: &Redesign) -> ExportedController {
    let (u, y) = (found.records.inputs.clone(), found.records.outputs.clone());
    let new = &redesign.controller;
    ExportedController {
        method: redesign.method.key().into(),
        ts: new.system.time().ts(),
        measured: y,
        commanded: u,
        controller: FilterData::new(&new.system),
        observer: new.gains.as_ref().map(|g| ObserverData::new(&g.model, g.f.as_ref(), g.l.as_ref())),
        q: new.q.as_ref().map(FilterData::new),
    }
}

/// For `8-redesign/redesign.json` and summary.json.
pub(super) fn json(redesign: &Redesign) -> Value {
    json!({
        "method": redesign.method,
        "input_weight": redesign.input_weight,
        "order": redesign.controller.system.order(),
        "present": figures(&redesign.present),
        "predicted": figures(&redesign.predicted),
        "band": redesign.band.map(|band| {
            let mut entry = json!(band);
            entry["holds"] = json!(band.holds());
            entry
        }),
        "exact": redesign.exact.as_ref().map(|e| json!({"stable": e.stable, "identity_residual": e.identity_residual})),
        "candidates": redesign.candidates,
    })
}

/// As JSON: the modes that matter, the least damping and the peaks.
fn figures(of: &LoopFigures) -> Value {
    let shown = |m: &SharedMode| json!({"hz": m.mode.hz, "zeta": m.mode.zeta, "share": m.share});
    let modes: Vec<Value> = of.modes.iter().filter(|m| m.share >= LoopFigures::LEAST_SHARE).map(shown).collect();
    json!({
        "modes": modes, "least_damping": of.least_damping, "peak_response": of.peak_response,
        "peak_sensitivity": of.peak_sensitivity,
    })
}

/// One sentence: what the new controller promises.
pub(super) fn sentence(redesign: &Redesign) -> String {
    let Redesign { present, predicted, .. } = redesign;
    let band = redesign.band.map_or_else(String::new, |b| {
        format!(", and stabilises every one of the {} models within the {:.0} % region of S", b.within, 100.0 * b.level)
    });
    let verb = if redesign.gains_damping() { "raises" } else { "takes" };
    format!(
        "The new controller {verb} the least damping of the loop from {:.3} to {:.3}, with a peak of the response to a disturbance at \
         the input of {:.2} (now {:.2}) and a peak sensitivity of {:.2} (now {:.2}){band}. It has not run yet.",
        present.least_damping,
        predicted.least_damping,
        predicted.peak_response,
        present.peak_response,
        predicted.peak_sensitivity,
        present.peak_sensitivity
    )
}

/// The tables of the report.
pub(super) fn tables(redesign: &Redesign) -> Vec<draw::EvidenceTable> {
    let modes = |figures: &LoopFigures, name: &str| {
        let row = |m: &SharedMode| {
            let share = format!("{:.0} %", 100.0 * m.share);
            vec![name.to_owned(), format!("{:.2}", m.mode.hz), format!("{:.4}", m.mode.zeta), share]
        };
        figures.modes.iter().filter(|m| m.share >= 0.05).map(row).collect::<Vec<_>>()
    };
    let number = |v: Option<f64>| v.map_or("–".to_owned(), |v| format!("{v:.3}"));
    let candidate = |c: &Candidate| {
        let taken = if c.input_weight == redesign.input_weight { "taken" } else { "" };
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
        draw::EvidenceTable {
            title: "Modes of the loop, present and predicted".into(),
            text: sentence(redesign),
            columns: ["Loop", "Hz", "ζ", "Share"].map(String::from).to_vec(),
            rows: [modes(&redesign.present, "present"), modes(&redesign.predicted, "new")].concat(),
            caption: "Modes with at least 5 % of the response of y to a disturbance at the plant input, on the model of the design; channels in their rms."
                .into(),
        },
        draw::EvidenceTable {
            title: "Weights that were tried".into(),
            text: String::new(),
            columns: ["SubspaceMethod of u", "Least damping", "Peak sensitivity", "Small-gain product", ""].map(String::from).to_vec(),
            rows: redesign.candidates.iter().map(candidate).collect(),
            caption: "Of those within the limits the one with the most damping is taken that stabilises every model within the region of S."
                .into(),
        },
    ]
}

/// Points of the responses that are drawn.
const POINTS: usize = 600;

/// The largest gain from a disturbance at the plant input to y over frequency, now and with the new controller.
///
/// # Errors
/// As [`frequency_response`].
pub(super) fn figure(redesign: &Redesign) -> Result<Figure> {
    let nyquist = 0.5 / redesign.controller.system.time().ts();
    let hz: Vec<f64> =
        (0..POINTS).map(|k| nyquist * 10f64.powf(-2.5 * (1.0 - (k + 1) as f64 / POINTS as f64))).collect();
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let curve = |method: &draw::Method, figures: &LoopFigures| {
        let response = frequency_response(&figures.response, &omega)?;
        let gain = response.iter().map(|g| g.singular_values().map_or(f64::NAN, |s| s.first().copied().unwrap_or(0.0)));
        let y = gain.map(decibel).collect();
        Ok::<_, Error>(Curve { method: method.key.clone(), x: hz.clone(), y, ..Curve::default() })
    };
    let [present, new] = loops();
    let axis = |label: &str, unit: &str, log| Axis { label: label.into(), unit: unit.into(), range: None, log };
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
        layout: Layout::Stacked,
        panels: vec![panel],
    })
}

/// The two loops as the figure names them.
pub(super) fn loops() -> [draw::Method; 2] {
    [
        draw::Method::new("present", "controller that ran", draw::Role::Nominal),
        draw::Method::new("new", "new controller", draw::Role::Hansen),
    ]
}
