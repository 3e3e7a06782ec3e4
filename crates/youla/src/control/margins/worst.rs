//! The margins of a loop in one figure each, of the worst channel, with the places where it is critical.

use super::{ChannelMargins, GainLimit, Loop, Margins};
use crate::Result;
use crate::control::ChannelScales;
use crate::lti::{StateSpace, TimeDomain};
use std::cmp::Ordering;
use std::ops::Range;

/// Names of the margins with the units of their values, each of its worst channel, in one order everywhere.
pub const MARGIN_NAMES: [&str; FIGURES] = [
    "peak sensitivity, worst output",
    "peak sensitivity, all outputs",
    "lowest gain factor",
    "highest gain factor",
    "phase margin, degrees",
    "delay margin, seconds",
    "disk margin",
    "normalised coprime margin",
];

/// Margins of a loop, each of its worst channel.
pub(super) const FIGURES: usize = 8;

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
    Disk(usize),
}

/// The margins of a loop in the order of [`MARGIN_NAMES`]; `None` where there is none, and the coprime margin without scales.
pub(super) fn critical<T: TimeDomain>(
    margins: &Margins,
    plant: &StateSpace<T>,
    controller: &StateSpace<T>,
    scales: Option<&ChannelScales>,
) -> Result<[Option<Critical>; FIGURES]> {
    let (inputs, outputs) = (plant.inputs(), plant.inputs()..plant.inputs() + plant.outputs());
    let all = margins.output_sensitivity;
    let all = Critical { value: all.value, frequency: all.frequency, kind: Kind::Peak(outputs) };
    let each = |of: &dyn Fn(usize, &ChannelMargins) -> Option<Critical>, worse: Ordering| {
        let found = margins.channels().enumerate().filter_map(|(i, margins)| of(i, margins));
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
    let disk = |i: usize, c: &ChannelMargins| {
        Some(Critical { value: c.disk.alpha, frequency: c.disk.frequency, kind: Kind::Disk(i) })
    };
    Ok([
        each(&peak, Ordering::Greater),
        Some(all),
        each(&|i, c| gain(i, c.lowest_gain), Ordering::Greater),
        each(&|i, c| gain(i, c.highest_gain), Ordering::Less),
        each(&phase, Ordering::Less),
        each(&delay, Ordering::Less),
        each(&disk, Ordering::Less),
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
