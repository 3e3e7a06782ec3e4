//! A redesign in `8-redesign/redesign.json` and summary.json.

use super::certificate::margins;
use super::entries::{BandEntry, IntervalEntry, finite};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::lti::SharedMode;
use youla::validate::ExactCertificate;
use youla_loop::redesign::{LoopFigures, Redesign, RedesignMethod, TriedWeight};

/// A redesign in `8-redesign/redesign.json` and summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RedesignEntry {
    /// What was designed.
    pub method: RedesignMethod,
    /// Weight of the inputs that was taken.
    pub input_weight: f64,
    /// States of the new controller.
    pub order: usize,
    /// The loop with the controller that ran.
    pub present: LoopEntry,
    /// The loop with the new controller, on the model.
    pub predicted: LoopEntry,
    /// The new controller on every model within the region of the plant; `null` without an uncertainty.
    pub band: Option<BandEntry>,
    /// Least damping of the new loop on the plant, with its interval over the region.
    #[serde(default)]
    pub least_damping: Option<IntervalEntry>,
    /// Margins of the new loop on the plant with their intervals, by name.
    #[serde(default)]
    pub margins: BTreeMap<String, IntervalEntry>,
    /// How much better slow loads are rejected than by the running controller: the largest gain from a load at the plant input to y, running over
    /// new controller, at a thousandth of the Nyquist frequency.
    #[serde(default)]
    pub rejection: Option<f64>,
    /// Why it should not be taken without a look at slow loads.
    #[serde(default)]
    pub reservations: Vec<String>,
    /// The exact test of the plant with K(Q), for `youla`.
    pub exact: Option<ExactEntry>,
    /// All weights that were tried.
    pub candidates: Vec<TriedWeight>,
}

/// Figures of a loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopEntry {
    /// Modes with at least 5 % of the response of y to a disturbance at the plant input.
    pub modes: Vec<SharedModeEntry>,
    /// Least damping ratio of these modes.
    pub least_damping: Option<f64>,
    /// Peak of that response, channels in their rms.
    pub peak_response: Option<f64>,
    /// Peak of the output sensitivity.
    pub peak_sensitivity: Option<f64>,
}

/// A mode with its share of the response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SharedModeEntry {
    /// Natural frequency, Hz.
    pub hz: Option<f64>,
    /// Damping ratio.
    pub zeta: Option<f64>,
    /// Share of the response, 0 to 1.
    pub share: Option<f64>,
}

/// The exact test by S and Q.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExactEntry {
    /// Whether the loop is stable.
    pub stable: bool,
    /// Largest relative difference of the two sides of its identity.
    pub identity_residual: Option<f64>,
}

impl From<&Redesign> for RedesignEntry {
    fn from(redesign: &Redesign) -> Self {
        let exact =
            |e: &ExactCertificate| ExactEntry { stable: e.stable, identity_residual: finite(e.identity_residual) };
        RedesignEntry {
            method: redesign.method,
            input_weight: redesign.input_weight,
            order: redesign.controller.system.order(),
            present: LoopEntry::from(&redesign.present),
            predicted: LoopEntry::from(&redesign.predicted),
            band: redesign.band.as_ref().map(BandEntry::from),
            least_damping: redesign
                .intervals
                .as_ref()
                .and_then(|i| Some(IntervalEntry::from(i.least_damping.as_ref()?))),
            margins: redesign.intervals.as_ref().map_or_else(BTreeMap::new, |i| margins(&i.margins)),
            rejection: finite(redesign.rejection),
            reservations: redesign.reservations(),
            exact: redesign.exact.as_ref().map(exact),
            candidates: redesign.candidates.clone(),
        }
    }
}

impl From<&LoopFigures> for LoopEntry {
    fn from(of: &LoopFigures) -> Self {
        let mode = |m: &SharedMode| SharedModeEntry {
            hz: finite(m.mode.hz),
            zeta: finite(m.mode.zeta),
            share: finite(m.share),
        };
        LoopEntry {
            modes: of.modes.iter().filter(|m| m.share >= LoopFigures::LEAST_SHARE).map(mode).collect(),
            least_damping: finite(of.least_damping),
            peak_response: finite(of.peak_response),
            peak_sensitivity: finite(of.peak_sensitivity),
        }
    }
}
