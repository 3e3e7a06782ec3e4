//! What the loop of each model with the controller that ran can bear, and how far the models are from each other in the
//! nu-gap.
//!
//! Margins are in the units of the record; they do not depend on them. The normalised coprime margin and the nu-gap do: both are
//! taken in channels that are divided by their root mean square over the estimation records, about the mean of each record.

use super::pipeline::Identification;
use super::records::LoopRecord;
use super::verdict::ModelVerdict;
use crate::{Error, Result};
use serde_json::{Value, json};
use youla::Mat;
use youla::control::{ChannelScales, GainLimit, IsoZone, Margins, NuGap, PhaseLimit, coprime_margin, margins, nu_gap};
use youla::lti::{Discrete, StateSpace};
use youla_report::{data as draw, pretty_unit};

/// The robustness of one model. A reason stands where a figure cannot be had.
#[derive(Debug, Clone)]
pub struct Robustness {
    /// Margins with the controller that ran.
    pub margins: Result<Margins, String>,
    /// b(G, K) in scaled channels; 0 where the loop is unstable.
    pub coprime: Result<f64, String>,
    /// The nu-gap to the nominal model, in scaled channels.
    pub gap_to_nominal: Result<NuGap, String>,
    /// The nu-gap to G(S), in scaled channels.
    pub gap_to_hansen: Result<NuGap, String>,
}

impl Robustness {
    /// Peak of the output sensitivity, all channels at once.
    pub fn peak_sensitivity(&self) -> Option<f64> {
        self.margins.as_ref().ok().map(|m| m.output_sensitivity.value)
    }

    /// Zone of ISO 14839-3: that of the worst output, one at a time.
    pub fn zone(&self) -> Option<IsoZone> {
        self.margins.as_ref().ok()?.zone()
    }
}

/// The sizes by which channels are scaled, or why there are none (a channel that never moves).
///
/// # Errors
/// [`youla::Error::OutOfRange`] for a channel that is constant in all estimation records.
pub(super) fn channel_scales(records: &[LoopRecord]) -> Result<ChannelScales> {
    Ok(ChannelScales::new(rms(records, |r| &r.u), rms(records, |r| &r.y))?)
}

/// Root mean square of each channel about the mean of its record.
fn rms(records: &[LoopRecord], signal: impl Fn(&LoopRecord) -> &Mat<f64>) -> Vec<f64> {
    let channels = records.first().map_or(0, |r| signal(r).ncols());
    let mut energy = vec![0.0; channels];
    let mut samples = 0;
    for record in records {
        let values = signal(record);
        samples += values.nrows();
        for (j, energy) in energy.iter_mut().enumerate() {
            let mean = values.col(j).iter().sum::<f64>() / values.nrows() as f64;
            *energy += values.col(j).iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        }
    }
    energy.into_iter().map(|e| (e / samples as f64).sqrt()).collect()
}

/// The robustness of one model of a run.
pub(super) fn robustness(
    found: &Identification,
    scales: &Result<ChannelScales, String>,
    model: &StateSpace<Discrete>,
) -> Robustness {
    let (nominal, controller) = (&found.factorisation.nominal, &found.factorisation.controller);
    let scaled = |plant: &StateSpace<Discrete>| -> Result<StateSpace<Discrete>, String> {
        scales.as_ref().map_err(Clone::clone)?.plant(plant).map_err(|e| e.to_string())
    };
    let gap_to = |other: &StateSpace<Discrete>| -> Result<NuGap, String> {
        nu_gap(&scaled(other)?, &scaled(model)?).map_err(|e| e.to_string())
    };
    let coprime = || -> Result<f64, String> {
        let controller = scales.as_ref().map_err(Clone::clone)?.controller(controller).map_err(|e| e.to_string())?;
        coprime_margin(&scaled(model)?, &controller).map_err(|e| e.to_string())
    };
    Robustness {
        margins: margins(model, controller).map_err(|e| match e {
            youla::Error::NotStabilising { pole, .. } => {
                format!("the loop is unstable, with the pole {}", youla::error::Pole(pole))
            }
            other => other.to_string(),
        }),
        coprime: coprime(),
        gap_to_nominal: gap_to(nominal),
        gap_to_hansen: gap_to(&found.hansen.plant),
    }
}

/// The entry `robustness` of a model in summary.json.
pub(super) fn summary_entry(robustness: &Robustness) -> Value {
    let gap = |gap: &Result<NuGap, String>| gap.as_ref().ok().map(|g| g.value);
    let mut entry = json!({
        "refused": robustness.margins.as_ref().err(),
        "coprime_margin": robustness.coprime.as_ref().ok(),
        "nu_gap_to_nominal": gap(&robustness.gap_to_nominal),
        "nu_gap_to_hansen": gap(&robustness.gap_to_hansen),
    });
    let shown = robustness.margins.as_ref().ok();
    let of = |value: &dyn Fn(&Margins) -> Value| shown.map_or(Value::Null, value);
    entry["peak_sensitivity"] = of(&|m| json!(m.output_sensitivity.value));
    entry["peak_input_sensitivity"] = of(&|m| json!(m.input_sensitivity.value));
    entry["peak_complementary_sensitivity"] = of(&|m| json!(m.output_complementary.value));
    entry["output_peak_sensitivities"] =
        of(&|m| json!(m.outputs.iter().map(|c| c.sensitivity.value).collect::<Vec<_>>()));
    entry["iso_14839_zone"] = of(&|m| json!(m.zone()));
    entry["lowest_gain"] = of(&|m| json!(m.lowest_gain().map(|g| g.factor)));
    entry["highest_gain"] = of(&|m| json!(m.highest_gain().map(|g| g.factor)));
    entry["phase_margin_deg"] = of(&|m| json!(m.phase().map(|p| p.degrees)));
    entry["delay_margin_s"] = of(&|m| json!(m.delay().map(|d| d.seconds)));
    for (name, disks) in [("input_disk_margin", 0), ("output_disk_margin", 1)] {
        entry[name] = of(&|m| {
            let disk = if disks == 0 { m.input_disks.balanced } else { m.output_disks.balanced };
            json!({
                "alpha": disk.alpha,
                "lowest_gain": disk.lowest_gain,
                "highest_gain": disk.highest_gain,
                "phase_deg": disk.phase_degrees,
            })
        });
    }
    entry
}

/// All of it, for the artefact of the stage.
pub(super) fn artefact(robustness: &Robustness) -> Value {
    fn or_reason<T: serde::Serialize>(part: &Result<T, String>) -> Value {
        match part {
            Ok(value) => json!(value),
            Err(reason) => json!({"refused": reason}),
        }
    }
    json!({
        "margins": or_reason(&robustness.margins),
        "coprime_margin": or_reason(&robustness.coprime),
        "nu_gap_to_nominal": or_reason(&robustness.gap_to_nominal),
        "nu_gap_to_hansen": or_reason(&robustness.gap_to_hansen),
    })
}

/// The scales of summary.json and of the artefact.
pub(super) fn scales_entry(scales: &Result<ChannelScales, String>) -> Value {
    match scales {
        Ok(scales) => json!({"inputs": scales.inputs(), "outputs": scales.outputs(), "basis": BASIS}),
        Err(reason) => json!({"refused": reason}),
    }
}

/// What the scales are.
const BASIS: &str = "root mean square over the estimation records, about the mean of each";

/// The row of a model in the report.
pub(super) fn row(v: &ModelVerdict) -> draw::LoopMargins {
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
pub(super) fn caption(found: &Identification) -> String {
    let channels = found.records.inputs.iter().chain(&found.records.outputs);
    match &found.verdict.scales {
        Some(Ok(scales)) => {
            let sizes = scales.inputs().iter().chain(scales.outputs());
            let each: Vec<String> = channels
                .zip(sizes)
                .map(|(c, s)| format!("{} {s:.3} {}", c.name, pretty_unit(&c.unit)).trim_end().into())
                .collect();
            format!("Channels are scaled for b(G, K) and the nu-gap by their {BASIS}: {}.", each.join(", "))
        }
        Some(Err(reason)) => format!("There is no b(G, K) and no nu-gap, which need scaled channels: {reason}."),
        None => String::new(),
    }
}
