//! Channels with their own time stamps, brought to the clock of the controller.
//!
//! Loggers of flight controllers, vehicles and plants write each channel when it comes: stamps scatter, rows are dropped, a set point is written
//! only when it changes, a sensor runs on a clock of its own. Identification needs the samples of one cycle of the controller in one row:
//!
//! | channel | its value in row k |
//! |---|---|
//! | stamps follow the clock | the sample of cycle k itself; stamps only count cycles, so that their scatter costs nothing |
//! | written when it changes | the last value |
//! | output with a clock of its own | interpolated between eight samples |
//! | set point or excitation with a clock of its own | the last value before the input of the cycle |
//! | missing | the conditional mean, given all channels in the rows around it |
//!
//! The clock is that of the input or output with most samples: it may drift against the logger's. A cycle begins with its outputs: an input
//! whose stamp comes up to 0.15 of a cycle before the output, or 0.85 after it, belongs to the same cycle.
//!
//! What is filled is an error of the records that is not correlated with what it was filled from; it acts as noise, and the region of a model
//! identified from the records holds it. What an interpolated output costs is in the region where its `sampled_every` is stated
//! ([`crate::ChannelSpec`]). Where an error, or the part of the rows that is missing, would decide the result, the log is refused.

mod clock;
mod interpolate;
mod missing;
mod rows;

use crate::error::{Error, Result};
use youla::lti::Discrete;
use youla::signal::{Channel, Record};

/// What a channel is in the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChannelRole {
    /// Input of the plant, which the controller writes once in a cycle.
    Input,
    /// Measured output of the plant.
    Output,
    /// Comes from outside of the loop: excitation or reference.
    External,
}

/// A channel with its own time stamps.
#[derive(Debug, Clone, PartialEq)]
pub struct StampedChannel {
    /// Name and unit.
    pub channel: Channel,
    /// What it is in the loop.
    pub role: ChannelRole,
    /// Whether a value is written only when it changes.
    pub changes_only: bool,
    /// Time stamps, seconds, not decreasing.
    pub times: Vec<f64>,
    /// The values at these times.
    pub values: Vec<f64>,
}

/// How the values of the rows come from those of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placement {
    /// One sample for each cycle.
    Sampled,
    /// The last value is held.
    Held,
    /// Interpolated between samples of another clock.
    Interpolated,
}

impl Placement {
    /// Its word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Placement::Sampled => "sampled",
            Placement::Held => "held",
            Placement::Interpolated => "interpolated",
        }
    }
}

/// The clock of a channel, and what its place in the rows costs.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ChannelTiming {
    /// Name of the channel.
    pub name: String,
    /// Samples in the log.
    pub samples: usize,
    /// Median step of its stamps, seconds.
    pub step: f64,
    /// Longest step, seconds.
    pub longest_step: f64,
    /// Root mean square of the scatter of its stamps about the clock, seconds; that of another clock about its own steps.
    pub jitter: f64,
    /// Delay of its stamps after those of the first output on the clock, seconds; `None` for another clock.
    pub delay: Option<f64>,
    /// How the rows were made.
    pub placement: Placement,
    /// Values of the rows that the log does not have.
    pub filled: usize,
    /// Root mean square of the error of what was filled or interpolated, measured on samples that the log has, as a share of the size of the
    /// channel about its mean; zero where nothing was.
    pub error: f64,
}

/// Records on one clock.
#[derive(Debug, Clone)]
pub struct Synchronised {
    /// One for each part without a gap of more than eight cycles, channels in the order given.
    pub records: Vec<Record>,
    /// The clock of each channel.
    pub timing: Vec<ChannelTiming>,
    /// Sample time of the controller by the clock of the logger over the stated one, less one: a drift, or a rounded sample time.
    pub drift: f64,
    /// Rows in gaps and in parts of less than 50 rows beside them, which no record holds.
    pub left_out: usize,
}

/// Brings channels to the clock of the controller; `name` is that of the records.
///
/// # Errors
/// [`Error::Clock`] with the channel and the remedy: stamps that decrease or are no numbers, inputs and outputs that do not follow the sample
/// time, channels that do not overlap, too many missing samples, an output that is too slow to be interpolated.
///
/// ```
/// use youla::{lti::Discrete, signal::Channel};
/// use youla_io::{ChannelRole, StampedChannel, synchronise};
/// // An output at 100 Hz whose stamps scatter by 1 ms; the input is written 3 ms later.
/// let scatter = |k: usize| 1e-3 * (k as f64 * 2.4).sin();
/// let value = |k: usize, shift: f64| (0.3 * k as f64 + shift).sin() + 0.1 * (1.7 * k as f64).cos();
/// let of = |name: &str, role, late: f64| StampedChannel {
///     channel: Channel::new(name, "V"),
///     role,
///     changes_only: false,
///     times: (0..500).map(|k| 0.01 * k as f64 + late + scatter(k)).collect(),
///     values: (0..500).map(|k| value(k, late)).collect(),
/// };
/// let channels = [of("u", ChannelRole::Input, 3e-3), of("y", ChannelRole::Output, 0.0)];
/// let log = synchronise("log", &channels, Discrete::new(0.01)?)?;
/// assert_eq!(log.records[0].samples(), 500);
/// assert_eq!(log.records[0].column("y")?[7], value(7, 0.0));
/// assert!((log.timing[0].delay.unwrap() - 3e-3).abs() < 1e-5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn synchronise(name: &str, channels: &[StampedChannel], time: Discrete) -> Result<Synchronised> {
    let refuse = |problem: String| Error::Clock { what: name.to_owned(), problem };
    for role in [ChannelRole::Input, ChannelRole::Output] {
        if !channels.iter().any(|c| c.role == role) {
            let word = if role == ChannelRole::Input { "input" } else { "output" };
            return Err(refuse(format!("no channel is an {word}; name at least one")));
        }
    }
    channels.iter().try_for_each(|c| check(c).map_err(&refuse))?;
    let clocks = clock::clocks(channels, time.ts()).map_err(&refuse)?;
    let mut table = rows::place(channels, &clocks, time.ts()).map_err(&refuse)?;
    let parts = table.parts();
    if parts.is_empty() {
        return Err(refuse("no 50 cycles in a row have a sample of each channel; log more, or fewer channels".into()));
    }
    let filled = missing::fill(channels, &mut table.columns, &parts).map_err(&refuse)?;
    let timing = (0..channels.len()).map(|c| clocks.timing(channels, c, time.ts(), &table, filled[c])).collect();
    let labels: Vec<Channel> = channels.iter().map(|c| c.channel.clone()).collect();
    let record = |&(from, to): &(usize, usize)| -> Result<Record> {
        let data = youla::Mat::from_fn(to - from, channels.len(), |i, j| table.columns[j][from + i]);
        Ok(Record::new(name, labels.clone(), data, time)?.starting_at(table.start + from as f64 * time.ts())?)
    };
    let kept: usize = parts.iter().map(|(from, to)| to - from).sum();
    Ok(Synchronised {
        records: parts.iter().map(record).collect::<Result<_>>()?,
        timing,
        drift: clocks.drift(),
        left_out: table.columns[0].len() - kept,
    })
}

fn check(c: &StampedChannel) -> Result<(), String> {
    let name = &c.channel.name;
    if c.times.len() != c.values.len() {
        return Err(format!("channel {name:?} has {} times and {} values", c.times.len(), c.values.len()));
    }
    if c.times.is_empty() {
        return Err(format!("channel {name:?} has no samples"));
    }
    if let Some(k) = (0..c.times.len()).find(|&k| !(c.times[k].is_finite() && c.values[k].is_finite())) {
        return Err(format!("channel {name:?}, sample {} (counted from 1): not a finite number; leave it out", k + 1));
    }
    if let Some(k) = c.times.windows(2).position(|w| w[1] < w[0]) {
        let [before, at] = [c.times[k], c.times[k + 1]];
        let remedy = "sort it by time, or cut the log where the logger began anew";
        return Err(format!("channel {name:?}, sample {}: time {at} s after {before} s decreases; {remedy}", k + 2));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
