//! `[redesign]`: a new controller on the model of a run, with what it is worth.

use super::pipeline::Identification;
use crate::lti::SharedMode;
use crate::redesign::{Candidate, ExportedController, LoopFigures, Redesign, RedesignProblem, redesign};
use crate::report::data as draw;
use crate::{Error, Result};
use serde_json::{Value, json};

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
    Some(redesign(&problem, options).map_err(|e: Error| e.within("[redesign]")))
}

/// The controller as `youla-rt` takes it.
pub(super) fn exported(found: &Identification, redesign: &Redesign) -> ExportedController {
    let (u, y) = (found.records.inputs.clone(), found.records.outputs.clone());
    ExportedController::new(&redesign.controller, redesign.method, u, y)
}

/// For `8-redesign/redesign.json` and summary.json.
pub(super) fn json(redesign: &Redesign) -> Value {
    json!({
        "method": redesign.method,
        "input_weight": redesign.input_weight,
        "order": redesign.controller.system.order(),
        "present": redesign.present.json(),
        "predicted": redesign.predicted.json(),
        "band": redesign.band.map(|band| {
            let mut entry = json!(band);
            entry["holds"] = json!(band.holds());
            entry
        }),
        "exact": redesign.exact.as_ref().map(|e| json!({"stable": e.stable, "identity_residual": e.identity_residual})),
        "candidates": redesign.candidates,
    })
}

/// One sentence: what the new controller promises.
pub(super) fn sentence(redesign: &Redesign) -> String {
    let Redesign { present, predicted, .. } = redesign;
    let band = redesign.band.map_or_else(String::new, |b| {
        format!(", and stabilises every one of the {} models within the {:.0} % region of S", b.within, 100.0 * b.level)
    });
    let verb = if redesign.gains_damping() { "raises" } else { "does not raise" };
    format!(
        "The new controller {verb} the least damping of the loop: {:.3} instead of {:.3}, a peak of the response to a disturbance at \
         the input of {:.2} instead of {:.2}, a peak sensitivity of {:.2} instead of {:.2}{band}. It has not run yet.",
        predicted.least_damping,
        present.least_damping,
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
            columns: ["Weight of u", "Least damping", "Peak sensitivity", "Small-gain product", ""].map(String::from).to_vec(),
            rows: redesign.candidates.iter().map(candidate).collect(),
            caption: "Of those within the limits the one with the most damping is taken that stabilises every model within the region of S."
                .into(),
        },
    ]
}
