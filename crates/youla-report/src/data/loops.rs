//! The loop of each model with the controller: certificate, margins, redesign.

use serde::{Deserialize, Serialize};

use super::{EvidenceTable, Method};
use crate::figure::Figure;

/// Stability of one model in the loop with the controller of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Key of the method.
    pub method: String,
    /// Order of the model.
    pub order: usize,
    /// Order of S where the model came from one.
    pub s_order: Option<usize>,
    /// Whether S is stable.
    pub s_stable: Option<bool>,
    /// Whether the controller of the log stabilises the model.
    pub stabilised_by_controller: Option<bool>,
    /// Closed-loop pole nearest to or farthest beyond the boundary of stability.
    pub worst_closed_loop_pole: Option<[f64; 2]>,
}

/// A new controller: its loop beside the present one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Redesign {
    /// The loops that the figure compares.
    pub loops: Vec<Method>,
    /// Their responses.
    pub figure: Figure,
    /// Modes, and the weights that were tried.
    pub tables: Vec<EvidenceTable>,
}

/// Margins of the loop of one model with the controller of the log, and distances to other models.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopMargins {
    /// Key of the method.
    pub method: String,
    /// Why there are no margins: the loop is unstable, or not well posed.
    pub refusal: Option<String>,
    /// Peak of the output sensitivity, all outputs at once.
    pub peak_sensitivity: Option<f64>,
    /// Zone of ISO 14839-3 by the worst output, one at a time: A to D.
    pub zone: Option<String>,
    /// Highest factor below 1 on the gain of one channel at which the loop is no longer stable; absent where no factor is too low.
    pub lowest_gain: Option<f64>,
    /// Lowest factor above 1 at which it is no longer stable; absent where no factor is too high.
    pub highest_gain: Option<f64>,
    /// Smallest phase margin of one channel, degrees.
    pub phase_deg: Option<f64>,
    /// Smallest delay margin of one channel, milliseconds.
    pub delay_ms: Option<f64>,
    /// Balanced disk margin of all inputs or all outputs at once, the smaller one.
    pub disk: Option<f64>,
    /// Change of phase that it allows, degrees.
    pub disk_phase_deg: Option<f64>,
    /// Normalised coprime margin b(G, K) in scaled channels; 0 where the loop is unstable.
    pub coprime: Option<f64>,
    /// nu-gap to the nominal model, in scaled channels.
    pub gap_to_nominal: Option<f64>,
    /// nu-gap to G(S), in scaled channels.
    pub gap_to_hansen: Option<f64>,
}
