//! Margins of the loop of a model, with the intervals that its region gives them.

use crate::Result;
use crate::control::{ChannelScales, LinearMargins, MARGIN_NAMES, Margins};
use crate::identify::likelihood::{Interval, Region};
use crate::lti::{Discrete, StateSpace};
use std::f64::consts::TAU;

/// A margin of a loop with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarginInterval {
    /// Name with its unit.
    pub name: &'static str,
    /// Value, standard deviation and bounds.
    pub interval: Interval,
}

/// Margins of a plant under `u = K y`, those of [`margins`](fn@crate::control::margins), each of its worst channel, with intervals at a level, to first order in the error of the
/// response at the frequency where the margin is critical (equations at [`LinearMargins`]). Margins that do not exist, and those
/// without a derivative there, are left out.
///
/// # Errors
/// [`crate::Error::NotStabilising`] with the pole; ports, sample times.
pub fn margin_intervals(
    margins: &Margins,
    plant: &StateSpace<Discrete>,
    controller: &StateSpace<Discrete>,
    region: &Region,
    scales: Option<&ChannelScales>,
    level: f64,
) -> Result<Vec<MarginInterval>> {
    let linear = LinearMargins::new(margins, plant, controller, scales)?;
    let nyquist = 0.5 / plant.time().ts();
    let figures = linear.deviations(|omega, slopes| region.at((omega / TAU).min(nyquist)).along(slopes))?;
    let named = MARGIN_NAMES.iter().zip(figures).filter_map(|(name, figure)| {
        let (value, deviation) = figure?;
        Some(MarginInterval { name, interval: Interval::normal(value, deviation, level) })
    });
    Ok(named.filter(|m| m.interval.value.is_finite() && m.interval.deviation.is_finite()).collect())
}
