//! Margins and distances of a model, and the sizes by which its channels are scaled.

use super::entries::{OrRefused, finite};
use crate::records::RunRecords;
use crate::result::Identification;
use crate::stages::validate::robustness::LoopRobustness;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use youla::control::{self, Margins, NuGap};
use youla_report::data::{DrawnDiskMargin, Robustness};

/// The entry `robustness` of a model.
pub(crate) fn robustness(of: &LoopRobustness) -> Robustness {
    let gap = |gap: &Result<NuGap, String>| gap.as_ref().ok().and_then(|g| finite(g.value));
    let known = of.margins.as_ref().ok();
    let figure = |value: &dyn Fn(&Margins) -> Option<f64>| known.and_then(value).and_then(finite);
    let each = |m: &Margins| m.outputs.iter().map(|c| finite(c.sensitivity.value)).collect();
    Robustness {
        refused: of.margins.as_ref().err().cloned(),
        coprime_margin: of.coprime.as_ref().ok().copied().and_then(finite),
        nu_gap_to_nominal: gap(&of.gap_to_nominal),
        nu_gap_to_recommended: gap(&of.gap_to_recommended),
        peak_sensitivity: figure(&|m| Some(m.output_sensitivity.value)),
        peak_input_sensitivity: figure(&|m| Some(m.input_sensitivity.value)),
        peak_complementary_sensitivity: figure(&|m| Some(m.output_complementary.value)),
        output_peak_sensitivities: known.map(each),
        iso_14839_zone: known.and_then(Margins::zone),
        lowest_gain: figure(&|m| m.lowest_gain().map(|g| g.factor)),
        highest_gain: figure(&|m| m.highest_gain().map(|g| g.factor)),
        phase_margin_deg: figure(&|m| m.phase().map(|p| p.degrees)),
        delay_margin_s: figure(&|m| m.delay().map(|d| d.seconds)),
        input_disk_margin: known.map(|m| disk(&m.input_disks.balanced)),
        output_disk_margin: known.map(|m| disk(&m.output_disks.balanced)),
    }
}

fn disk(disk: &control::DiskMargin) -> DrawnDiskMargin {
    DrawnDiskMargin {
        alpha: finite(disk.alpha),
        lowest_gain: finite(disk.lowest_gain),
        highest_gain: disk.highest_gain,
        phase_deg: finite(disk.phase_degrees),
    }
}

/// The sizes by which channels are scaled for b(G, K) and the nu-gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ScalesEntry {
    /// Of each input, in its unit.
    pub inputs: Vec<f64>,
    /// Of each output, in its unit.
    pub outputs: Vec<f64>,
    /// How they were found.
    pub basis: String,
}

/// The scales of a run.
pub(crate) fn scales(found: &Identification) -> OrRefused<ScalesEntry> {
    OrRefused::new(found.validation.scales.as_ref().map(|scales| ScalesEntry {
        inputs: scales.inputs().to_vec(),
        outputs: scales.outputs().to_vec(),
        basis: basis(&found.records).to_owned(),
    }))
}

fn basis(records: &RunRecords) -> &'static str {
    match records.measured {
        Some(_) => "root mean square over the frequencies of the response",
        None => "root mean square over the estimation records, about the mean of each",
    }
}
