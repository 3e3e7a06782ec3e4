//! The margins of a loop in one figure each, of the worst channel, with the places where it is critical.

use super::{ChannelMargins, GainLimit, Loop, channel};
use crate::Result;
use crate::control::ChannelScales;
use crate::lti::{StateSpace, TimeDomain};
use std::cmp::Ordering;
use std::ops::Range;

/// Margins of a loop, each of its worst channel; `None` where there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorstMargins {
    /// Largest peak of the sensitivity of one output.
    pub output_sensitivity: Option<f64>,
    /// Peak of the sensitivity of all outputs.
    pub all_outputs_sensitivity: Option<f64>,
    /// The limit of the gain of a channel below 1 that is highest.
    pub lowest_gain: Option<f64>,
    /// The limit of the gain of a channel above 1 that is lowest.
    pub highest_gain: Option<f64>,
    /// Smallest phase margin, degrees.
    pub phase_degrees: Option<f64>,
    /// Smallest delay margin, seconds.
    pub delay: Option<f64>,
    /// Normalised coprime margin in scaled channels; `None` without scales.
    pub coprime: Option<f64>,
}

impl WorstMargins {
    pub(super) fn of_figures(figures: [Option<f64>; FIGURES]) -> Self {
        let [output_sensitivity, all_outputs_sensitivity, lowest_gain, highest_gain, phase_degrees, delay, coprime] =
            figures;
        WorstMargins {
            output_sensitivity,
            all_outputs_sensitivity,
            lowest_gain,
            highest_gain,
            phase_degrees,
            delay,
            coprime,
        }
    }

    /// Of a plant under `u = K y`, exactly.
    ///
    /// # Errors
    /// As [`super::margins()`].
    pub fn of<T: TimeDomain>(
        plant: &StateSpace<T>,
        controller: &StateSpace<T>,
        scales: Option<&ChannelScales>,
    ) -> Result<Self> {
        let critical = critical(plant, controller, scales)?;
        Ok(Self::of_figures(critical.map(|margin| margin.map(|m| m.value))))
    }
}

/// Figures of [`WorstMargins`].
pub(super) const FIGURES: usize = 7;

/// One margin with its place.
#[derive(Debug, Clone)]
pub(super) struct Critical {
    pub(super) value: f64,
    pub(super) frequency: f64,
    pub(super) kind: Kind,
}

/// What is critical; channels and ports are counted over (u, y).
#[derive(Debug, Clone)]
pub(super) enum Kind {
    Peak(Range<usize>),
    Coprime,
    Gain(usize),
    Phase(usize),
    Delay(usize),
}

/// The exact margins in the order of [`WorstMargins`].
pub(super) fn critical<T: TimeDomain>(
    plant: &StateSpace<T>,
    controller: &StateSpace<T>,
    scales: Option<&ChannelScales>,
) -> Result<[Option<Critical>; FIGURES]> {
    let closed = Loop::new(plant, controller)?;
    let (inputs, outputs) = (plant.inputs(), plant.inputs()..plant.inputs() + plant.outputs());
    let mut channels = channel::each(&closed.input_sensitivity())?;
    channels.extend(channel::each(&closed.output_sensitivity())?);
    let all = closed.peak(&Loop::output_sensitivity)?;
    let all = Critical { value: all.value, frequency: all.frequency, kind: Kind::Peak(outputs) };
    let each = |of: &dyn Fn(usize, &ChannelMargins) -> Option<Critical>, worse: Ordering| {
        let found = channels.iter().enumerate().filter_map(|(i, margins)| of(i, margins));
        found.reduce(|a, b| if b.value.total_cmp(&a.value) == worse { b } else { a })
    };
    let peak = |i: usize, c: &ChannelMargins| {
        let kind = Kind::Peak(i..i + 1);
        (i >= inputs).then_some(Critical { value: c.sensitivity.value, frequency: c.sensitivity.frequency, kind })
    };
    let gain = |i, limit: Option<GainLimit>| {
        limit.map(|l| Critical { value: l.factor, frequency: l.frequency, kind: Kind::Gain(i) })
    };
    let phase = |i: usize, c: &ChannelMargins| {
        c.phase.map(|l| Critical { value: l.degrees, frequency: l.frequency, kind: Kind::Phase(i) })
    };
    let delay = |i: usize, c: &ChannelMargins| {
        c.delay.map(|l| Critical { value: l.seconds, frequency: l.frequency, kind: Kind::Delay(i) })
    };
    Ok([
        each(&peak, Ordering::Greater),
        Some(all),
        each(&|i, c| gain(i, c.lowest_gain), Ordering::Greater),
        each(&|i, c| gain(i, c.highest_gain), Ordering::Less),
        each(&phase, Ordering::Less),
        each(&delay, Ordering::Less),
        scales.map(|scales| coprime(plant, controller, scales)).transpose()?.flatten(),
    ])
}

fn coprime<T: TimeDomain>(
    plant: &StateSpace<T>,
    controller: &StateSpace<T>,
    scales: &ChannelScales,
) -> Result<Option<Critical>> {
    let peak = Loop::new(&scales.plant(plant)?, &scales.controller(controller)?)?.coprime_peak()?;
    let kind = Kind::Coprime;
    Ok((peak.upper > 0.0).then(|| Critical { value: 1.0 / peak.upper, frequency: peak.frequency, kind }))
}
