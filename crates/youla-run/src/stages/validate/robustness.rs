//! What the loop of each model with the controller that ran tolerates, and how far the models are from each other in the
//! nu-gap.
//!
//! Margins are in the units of the record; they do not depend on them. The normalised coprime margin and the nu-gap do: both are
//! taken in channels that are divided by their root mean square over the estimation records, about the mean of each record.

use crate::Result;
use crate::records::{LoopRecord, RunRecords};
use crate::result::Identification;
use crate::stages::factors::DeclaredLoop;
use crate::summary::entries::{OrRefused, finite};
use serde::{Deserialize, Serialize};
use youla::Mat;
use youla::control::{ChannelScales, DiskMargin, IsoZone, Margins, NuGap, coprime_margin, margins, nu_gap};
use youla::lti::{Discrete, StateSpace};

/// The robustness of one model. A reason is where a figure cannot be had.
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
pub(crate) fn channel_scales(records: &RunRecords) -> Result<ChannelScales> {
    if records.measured.is_some() {
        let (u, y) = records.sizes();
        return Ok(ChannelScales::new(u, y)?);
    }
    let records = &records.estimation;
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

/// The robustness of one model of a run; `plant` is G(S).
pub(crate) fn robustness(
    DeclaredLoop { nominal, controller, .. }: &DeclaredLoop,
    scales: &Result<ChannelScales, String>,
    plant: Option<&StateSpace<Discrete>>,
    model: &StateSpace<Discrete>,
) -> Robustness {
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
        gap_to_hansen: plant.map_or_else(|| Err("the scheme gave no model".to_owned()), gap_to),
    }
}

/// The entry `robustness` of a model in summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RobustnessEntry {
    /// Why there are no margins.
    pub refused: Option<String>,
    /// Normalised coprime margin b(G, K), 0 to 1, in scaled channels.
    pub coprime_margin: Option<f64>,
    /// nu-gap to G(0), 0 to 1, in scaled channels.
    pub nu_gap_to_nominal: Option<f64>,
    /// nu-gap to G(S), 0 to 1, in scaled channels.
    pub nu_gap_to_hansen: Option<f64>,
    /// Peak of the output sensitivity, all outputs at once.
    pub peak_sensitivity: Option<f64>,
    /// Peak of the input sensitivity.
    pub peak_input_sensitivity: Option<f64>,
    /// Peak of the complementary sensitivity.
    pub peak_complementary_sensitivity: Option<f64>,
    /// Peak of the sensitivity of each output by itself.
    pub output_peak_sensitivities: Option<Vec<Option<f64>>>,
    /// Zone of ISO 14839-3: A to D.
    #[schemars(with = "Option<String>")]
    pub iso_14839_zone: Option<IsoZone>,
    /// Factor below 1 on the gain of one channel at which the loop becomes unstable.
    pub lowest_gain: Option<f64>,
    /// Factor above 1 at which it does.
    pub highest_gain: Option<f64>,
    /// Smallest phase margin of one channel, degrees.
    pub phase_margin_deg: Option<f64>,
    /// Smallest delay margin of one channel, seconds.
    pub delay_margin_s: Option<f64>,
    /// Balanced disk margin of all inputs at once.
    pub input_disk_margin: Option<DiskEntry>,
    /// Balanced disk margin of all outputs at once.
    pub output_disk_margin: Option<DiskEntry>,
}

/// A balanced disk margin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct DiskEntry {
    /// Its size.
    pub alpha: Option<f64>,
    /// Lowest factor on the gain that it allows.
    pub lowest_gain: Option<f64>,
    /// Highest factor on the gain that it allows; `null` where no factor is too high.
    pub highest_gain: Option<f64>,
    /// Change of phase that it allows, degrees.
    pub phase_deg: Option<f64>,
}

impl From<&DiskMargin> for DiskEntry {
    fn from(disk: &DiskMargin) -> Self {
        DiskEntry {
            alpha: finite(disk.alpha),
            lowest_gain: finite(disk.lowest_gain),
            highest_gain: disk.highest_gain,
            phase_deg: finite(disk.phase_degrees),
        }
    }
}

impl From<&Robustness> for RobustnessEntry {
    fn from(robustness: &Robustness) -> Self {
        let gap = |gap: &Result<NuGap, String>| gap.as_ref().ok().and_then(|g| finite(g.value));
        let known = robustness.margins.as_ref().ok();
        let figure = |of: &dyn Fn(&Margins) -> Option<f64>| known.and_then(of).and_then(finite);
        let each = |m: &Margins| m.outputs.iter().map(|c| finite(c.sensitivity.value)).collect();
        RobustnessEntry {
            refused: robustness.margins.as_ref().err().cloned(),
            coprime_margin: robustness.coprime.as_ref().ok().copied().and_then(finite),
            nu_gap_to_nominal: gap(&robustness.gap_to_nominal),
            nu_gap_to_hansen: gap(&robustness.gap_to_hansen),
            peak_sensitivity: figure(&|m| Some(m.output_sensitivity.value)),
            peak_input_sensitivity: figure(&|m| Some(m.input_sensitivity.value)),
            peak_complementary_sensitivity: figure(&|m| Some(m.output_complementary.value)),
            output_peak_sensitivities: known.map(each),
            iso_14839_zone: robustness.zone(),
            lowest_gain: figure(&|m| m.lowest_gain().map(|g| g.factor)),
            highest_gain: figure(&|m| m.highest_gain().map(|g| g.factor)),
            phase_margin_deg: figure(&|m| m.phase().map(|p| p.degrees)),
            delay_margin_s: figure(&|m| m.delay().map(|d| d.seconds)),
            input_disk_margin: known.map(|m| DiskEntry::from(&m.input_disks.balanced)),
            output_disk_margin: known.map(|m| DiskEntry::from(&m.output_disks.balanced)),
        }
    }
}

/// All of it, in `7-validate/verdict.json`.
#[derive(Serialize)]
pub(crate) struct RobustnessFile<'a> {
    margins: OrRefused<&'a Margins>,
    coprime_margin: OrRefused<f64>,
    nu_gap_to_nominal: OrRefused<&'a NuGap>,
    nu_gap_to_hansen: OrRefused<&'a NuGap>,
}

impl<'a> From<&'a Robustness> for RobustnessFile<'a> {
    fn from(robustness: &'a Robustness) -> Self {
        RobustnessFile {
            margins: OrRefused::new(robustness.margins.as_ref()),
            coprime_margin: OrRefused::new(robustness.coprime.as_ref().copied()),
            nu_gap_to_nominal: OrRefused::new(robustness.gap_to_nominal.as_ref()),
            nu_gap_to_hansen: OrRefused::new(robustness.gap_to_hansen.as_ref()),
        }
    }
}

/// The sizes by which channels are scaled for b(G, K) and the nu-gaps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ScalesEntry {
    /// Of each input, in its unit.
    pub inputs: Vec<f64>,
    /// Of each output, in its unit.
    pub outputs: Vec<f64>,
    /// How they were found.
    pub basis: String,
}

/// The scales of summary.json and of the artefact.
pub(crate) fn scales_entry(found: &Identification) -> OrRefused<ScalesEntry> {
    OrRefused::new(found.verdict.scales.as_ref().map(|scales| ScalesEntry {
        inputs: scales.inputs().to_vec(),
        outputs: scales.outputs().to_vec(),
        basis: basis(&found.records).to_owned(),
    }))
}

/// What the scales are.
const BASIS: &str = "root mean square over the estimation records, about the mean of each";

/// The same for a measured response.
const BASIS_OF_RESPONSE: &str = "root mean square over the frequencies of the response";

/// What the scales of the channels are.
pub(crate) fn basis(records: &RunRecords) -> &'static str {
    if records.measured.is_some() { BASIS_OF_RESPONSE } else { BASIS }
}
