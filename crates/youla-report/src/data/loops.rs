//! The loop of each model with the controller: certificate, margins, redesign.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use youla::control::IsoZone;

use super::{DrawnMethod, EvidenceTable};
use crate::figure::Figure;

/// The loop of one model with the controller that ran.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Key of the method.
    pub method: String,
    /// Order of the model.
    pub order: usize,
    /// Whether the controller that ran stabilises this model; `None` where that was not computed.
    pub stabilised_by_controller: Option<bool>,
    /// Closed-loop pole nearest to or farthest beyond the boundary of stability.
    pub worst_closed_loop_pole: Option<[f64; 2]>,
}

/// A new controller beside the one that ran.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawnRedesign {
    /// The present loop and the new one, by the keys that the figure uses.
    pub loops: Vec<DrawnMethod>,
    /// Response of both loops to a disturbance at the plant input.
    pub figure: Figure,
    /// Modes of both loops, and the weights that were tried.
    pub tables: Vec<EvidenceTable>,
}

/// Margins of one model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopMargins {
    /// Key of the method.
    pub method: String,
    /// Margins and distances.
    #[serde(flatten)]
    pub robustness: Robustness,
}

/// What the loop of a model with the controller that ran tolerates, and how far the model is from others. A number that does not exist
/// is `null`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Robustness {
    /// Why there are no margins.
    pub refused: Option<String>,
    /// Normalised coprime margin b(G, K), 0 to 1, in scaled channels.
    pub coprime_margin: Option<f64>,
    /// nu-gap to the nominal model G(0), 0 to 1, in scaled channels.
    pub nu_gap_to_nominal: Option<f64>,
    /// nu-gap to the recommended model, 0 to 1, in scaled channels.
    pub nu_gap_to_recommended: Option<f64>,
    /// Peak of the output sensitivity, all outputs at once.
    pub peak_sensitivity: Option<f64>,
    /// Peak of the input sensitivity.
    pub peak_input_sensitivity: Option<f64>,
    /// Peak of the complementary sensitivity.
    pub peak_complementary_sensitivity: Option<f64>,
    /// Peak of the sensitivity of each output by itself.
    pub output_peak_sensitivities: Option<Vec<Option<f64>>>,
    /// Zone of ISO 14839-3 of the worst output by itself: A to D.
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
    pub input_disk_margin: Option<DrawnDiskMargin>,
    /// Balanced disk margin of all outputs at once.
    pub output_disk_margin: Option<DrawnDiskMargin>,
}

/// A balanced disk margin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DrawnDiskMargin {
    /// Its size.
    pub alpha: Option<f64>,
    /// Lowest factor on the gain that it allows.
    pub lowest_gain: Option<f64>,
    /// Highest factor on the gain that it allows; `null` where no factor is too high.
    pub highest_gain: Option<f64>,
    /// Change of phase that it allows, degrees.
    pub phase_deg: Option<f64>,
}
