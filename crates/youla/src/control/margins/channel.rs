//! Margins of one channel, the other loops closed: with its sensitivity S = 1 / (1 - L) on the stability boundary,
//!
//! ```text
//! k L = 1             where S is real:          k = S / (S - 1)
//! |L| = 1             where Re S = 1/2:         phase margin |arg L|, delay margin (arg L mod 2 pi) / omega
//! ```

use super::disk::{DiskMargin, of_gain};
use super::{IsoZone, peak_of, shifted};
use crate::lti::{Curve, Part, PeakGain, StateSpace, TimeDomain, crossings};
use crate::{Result, c64};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Gain of a loop that is none.
const NO_GAIN: f64 = 1e-9;

/// A factor on the gain of a channel at which the loop has a pole on the stability boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GainLimit {
    /// The factor.
    pub factor: f64,
    /// Where that pole lies, rad/s; infinite for a loop with direct feedthrough that stops to be well posed.
    pub frequency: f64,
}

/// A shift of phase at which the loop has a pole on the stability boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PhaseLimit {
    /// The shift, either way, degrees.
    pub degrees: f64,
    /// The crossover at which it happens, rad/s.
    pub frequency: f64,
}

/// A delay at which the loop has a pole on the stability boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DelayLimit {
    /// The delay, seconds.
    pub seconds: f64,
    /// The crossover at which it happens, rad/s.
    pub frequency: f64,
}

/// Margins of one channel, the other loops closed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ChannelMargins {
    /// The loop is stable for factors between this, below 1 and maybe negative, and `highest_gain`; `None`: no factor is too low.
    pub lowest_gain: Option<GainLimit>,
    /// Above 1; `None`: no factor is too high. A loop gain below 1e-9 counts as none.
    pub highest_gain: Option<GainLimit>,
    /// Smallest shift of phase; `None` where the loop never has a gain of 1.
    pub phase: Option<PhaseLimit>,
    /// Smallest delay, in discrete time of whole samples; `None` where the loop never has a gain of 1. Zero where it has one of 1 or
    /// more at infinite or Nyquist frequency.
    pub delay: Option<DelayLimit>,
    /// Disk margin of the balanced sensitivity (sigma = 0): changes of gain and phase together.
    pub disk: DiskMargin,
    /// Disk margin of the sensitivity (sigma = 1); its size is the distance to the critical point.
    pub sensitivity_disk: DiskMargin,
    /// Peak of the sensitivity of this channel.
    pub sensitivity: PeakGain,
    /// Zone of that peak.
    pub zone: IsoZone,
}

/// The margins of each channel of a stable sensitivity.
pub(super) fn each<T: TimeDomain>(sensitivity: &StateSpace<T>) -> Result<Vec<ChannelMargins>> {
    let all = (0..sensitivity.inputs()).into_par_iter();
    all.map(|i| of_channel(&sensitivity.part(i..i + 1, i..i + 1))).collect()
}

fn of_channel<T: TimeDomain>(s: &StateSpace<T>) -> Result<ChannelMargins> {
    let curve = Curve::new(&s.balanced()?)?;
    let at = |frequency: f64| -> Result<c64> { Ok(curve.at(frequency)?[(0, 0)]) };
    let [lowest_gain, highest_gain] = gain_limits(&crossings(s, Part::Imaginary)?, at)?;
    let crossovers = crossings(s, Part::RealLess(0.5))?;
    let sensitivity = peak_of(s)?;
    Ok(ChannelMargins {
        lowest_gain,
        highest_gain,
        phase: phase_limit(&crossovers, at)?,
        delay: delay_limit(&crossovers, curve.end(), at)?,
        disk: of_gain(peak_of(&shifted(s, -0.5)?)?, 0.0),
        sensitivity_disk: of_gain(sensitivity, 1.0),
        sensitivity,
        zone: IsoZone::of(sensitivity.value),
    })
}

/// The nearest factors below and above 1.
fn gain_limits(real: &[f64], at: impl Fn(f64) -> Result<c64>) -> Result<[Option<GainLimit>; 2]> {
    let (mut lowest, mut highest): (Option<GainLimit>, Option<GainLimit>) = (None, None);
    for &frequency in real {
        let s = at(frequency)?.re;
        // S = 1: the loop has no gain there, and no factor gives it any.
        if (s - 1.0).abs() < NO_GAIN {
            continue;
        }
        let factor = s / (s - 1.0);
        let limit = Some(GainLimit { factor, frequency });
        if factor < 1.0 && lowest.is_none_or(|l| factor > l.factor) {
            lowest = limit;
        } else if factor > 1.0 && highest.is_none_or(|h| factor < h.factor) {
            highest = limit;
        }
    }
    Ok([lowest, highest])
}

/// `arg L`, from `L = 1 - 1 / S`, within (-pi, pi].
pub(super) fn loop_phase(s: c64) -> f64 {
    let l = c64::new(1.0, 0.0) - c64::new(1.0, 0.0) / s;
    l.im.atan2(l.re)
}

fn phase_limit(crossovers: &[f64], at: impl Fn(f64) -> Result<c64>) -> Result<Option<PhaseLimit>> {
    let mut least: Option<PhaseLimit> = None;
    for &frequency in crossovers {
        let degrees = loop_phase(at(frequency)?).abs().to_degrees();
        if least.is_none_or(|l| degrees < l.degrees) {
            least = Some(PhaseLimit { degrees, frequency });
        }
    }
    Ok(least)
}

/// A gain of 1 or more up to the end of all frequencies bears no delay; only below it does the shift by a delay tell all.
fn delay_limit(crossovers: &[f64], end: f64, at: impl Fn(f64) -> Result<c64>) -> Result<Option<DelayLimit>> {
    if (c64::new(1.0, 0.0) - c64::new(1.0, 0.0) / at(end)?).norm() >= 1.0 {
        return Ok(Some(DelayLimit { seconds: 0.0, frequency: end }));
    }
    let mut least: Option<DelayLimit> = None;
    for &frequency in crossovers.iter().filter(|w| **w > 0.0) {
        let seconds = loop_phase(at(frequency)?).rem_euclid(TAU) / frequency;
        if least.is_none_or(|l| seconds < l.seconds) {
            least = Some(DelayLimit { seconds, frequency });
        }
    }
    Ok(least)
}
