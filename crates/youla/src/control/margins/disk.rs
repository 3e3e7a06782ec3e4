//! Disk margins (P. Seiler, A. Packard and P. Gahinet, An introduction to disk margins, IEEE Control Syst. Mag. 40 (2020), no. 5,
//! 78): the loop is stable for every complex factor f on a channel, however it changes with frequency, within the disk
//!
//! ```text
//! f = (1 + (1 - sigma)/2 delta) / (1 - (1 + sigma)/2 delta),   |delta| < alpha,      alpha = 1 / || S + (sigma - 1)/2 ||
//! ```
//!
//! sigma = 0 balances more and less gain (the balanced sensitivity `(S + T) / 2` of `S - 1/2`); sigma = 1 is the sensitivity. For
//! several channels, each with a factor of its own, the norm is the structured singular value for a diagonal delta.

use super::structured::structured_peak;
use super::{peak_of, shifted};
use crate::Result;
use crate::lti::{PeakGain, StateSpace, TimeDomain};

/// A disk of factors for which a loop is stable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DiskMargin {
    /// Size of the disk, alpha.
    pub alpha: f64,
    /// Skew sigma: 0 balanced, 1 the sensitivity.
    pub sigma: f64,
    /// Lowest factor of the gain, phase unchanged.
    pub lowest_gain: f64,
    /// Highest factor of the gain, phase unchanged; `None` where no factor is too high.
    pub highest_gain: Option<f64>,
    /// Largest change of phase either way, gain unchanged, degrees; 180: any.
    pub phase_degrees: f64,
    /// Where the loop is nearest to the disk, rad/s.
    pub frequency: f64,
}

/// Disk margins of several channels at once.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DiskMargins {
    /// sigma = 0.
    pub balanced: DiskMargin,
    /// sigma = 1.
    pub sensitivity: DiskMargin,
}

/// The disk margin that belongs to the peak of `S + (sigma - 1)/2`, by its upper bound.
pub(super) fn of_gain(peak: PeakGain, sigma: f64) -> DiskMargin {
    let alpha = if peak.upper > 0.0 { 1.0 / peak.upper } else { f64::MAX };
    let (a, b) = (0.5 * alpha * (1.0 - sigma), 0.5 * alpha * (1.0 + sigma));
    let cosine = (2.0 - a * a - b * b) / (2.0 * (1.0 + a * b));
    DiskMargin {
        alpha,
        sigma,
        lowest_gain: (1.0 - a) / (1.0 + b),
        highest_gain: (b < 1.0).then(|| (1.0 + a) / (1.0 - b)),
        phase_degrees: cosine.clamp(-1.0, 1.0).acos().to_degrees(),
        frequency: peak.frequency,
    }
}

/// The disk margins of all channels of a stable sensitivity at once. Exact (to 1e-4) up to three channels, where the bound
/// of the structured singular value is tight; a guarantee beyond.
pub(super) fn all_channels<T: TimeDomain>(sensitivity: &StateSpace<T>) -> Result<DiskMargins> {
    let margin = |sigma: f64| -> Result<DiskMargin> {
        let system = shifted(sensitivity, 0.5 * (sigma - 1.0))?;
        let peak = if system.inputs() < 2 { peak_of(&system)? } else { structured_peak(&system, 0.5 * (1.0 + sigma))? };
        Ok(of_gain(peak, sigma))
    };
    Ok(DiskMargins { balanced: margin(0.0)?, sensitivity: margin(1.0)? })
}
