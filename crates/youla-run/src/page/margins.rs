//! Robustness in the report: a row for each model, and the scales of the channels.

use crate::result::Identification;
use crate::stages::validate::ModelVerdict;
use crate::stages::validate::robustness::basis;
use youla::control::{GainLimit, Margins, PhaseLimit};
use youla_report::{data as draw, pretty_unit};

/// The row of a model in the report.
pub(crate) fn row(v: &ModelVerdict) -> draw::LoopMargins {
    let robustness = &v.robustness;
    let known = robustness.margins.as_ref().ok();
    let disk = known.map(|m| {
        let (input, output) = (m.input_disks.balanced, m.output_disks.balanced);
        if input.alpha < output.alpha { input } else { output }
    });
    let factor = |limit: Option<GainLimit>| limit.map(|g| g.factor);
    draw::LoopMargins {
        method: v.method.key().into(),
        refusal: robustness.margins.as_ref().err().cloned(),
        peak_sensitivity: robustness.peak_sensitivity(),
        zone: robustness.zone().map(|z| z.to_string()),
        lowest_gain: known.and_then(|m| factor(m.lowest_gain())),
        highest_gain: known.and_then(|m| factor(m.highest_gain())),
        phase_deg: known.and_then(Margins::phase).map(|PhaseLimit { degrees, .. }| degrees),
        delay_ms: known.and_then(Margins::delay).map(|d| 1e3 * d.seconds),
        disk: disk.map(|d| d.alpha),
        disk_phase_deg: disk.map(|d| d.phase_degrees),
        coprime: robustness.coprime.as_ref().ok().copied(),
        gap_to_nominal: robustness.gap_to_nominal.as_ref().ok().map(|g| g.value),
        gap_to_hansen: robustness.gap_to_hansen.as_ref().ok().map(|g| g.value),
    }
}

/// The caption of the table: the scales with their channels.
pub(crate) fn caption(found: &Identification) -> String {
    let channels = found.records.inputs.iter().chain(&found.records.outputs);
    match &found.verdict.scales {
        Ok(scales) => {
            let sizes = scales.inputs().iter().chain(scales.outputs());
            let each: Vec<String> = channels
                .zip(sizes)
                .map(|(c, s)| format!("{} {s:.3} {}", c.name, pretty_unit(&c.unit)).trim_end().into())
                .collect();
            format!(
                "For b(G, K) and the nu-gap, channels are scaled by their {}: {}.",
                basis(&found.records),
                each.join(", ")
            )
        }
        Err(reason) => format!("b(G, K) and the nu-gap need scaled channels and are not available: {reason}."),
    }
}
