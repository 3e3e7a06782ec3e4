//! One row for each cycle of the controller.

use super::clock::{Clocks, few, step};
use super::{ChannelRole, Placement, StampedChannel, interpolate};

/// A channel may miss this many cycles in a row; more are a gap, at which the record is cut.
const LONGEST_FILL: usize = 8;
/// Least rows of a part beside a gap.
pub(super) const LEAST_ROWS: usize = 50;
/// A channel on the clock that lacks more of its samples is taken as one of a slower clock.
const MOST_MISSING: f64 = 0.3;
/// From this share of missing samples on, a channel whose value never repeats may be one that is written when it changes.
const MISSING_TO_ASK: f64 = 0.02;
/// Least samples in a cycle of an output that is interpolated. Of 21 simulated loops with 0.53 to 3.1 samples in a cycle the region held the truth; with
/// 0.5 and 0.26 it did in two of six.
const LEAST_RATE: f64 = 2.0 / 3.0;
/// Largest error of an output that is slower than 1.5 samples in a cycle, as a share of its size, where each sample is interpolated from its
/// neighbours, twice as far as an instant between samples is: a signal that fills the band of its samples is not interpolated.
const LARGEST_ERROR: f64 = 0.1;
/// Samples on which that error is measured.
const TRIALS: usize = 2000;
/// Rows for each stamp of the log: more are a time in another unit.
const MOST_ROWS: f64 = 100.0;
/// Most numbers of the rows: 1 GB, as of the files of logs.
const MOST_NUMBERS: f64 = 1.25e8;

/// Rows of the channels, with NaN where the log has no sample.
pub(super) struct Table {
    /// Time of the first row, seconds.
    pub(super) start: f64,
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) placements: Vec<Placement>,
    /// Error of interpolated channels as a share of their size.
    pub(super) errors: Vec<f64>,
}

impl Table {
    /// Rows from and to of the parts in which no channel misses more than [`LONGEST_FILL`] cycles in a row and whose ends are complete.
    pub(super) fn parts(&self) -> Vec<(usize, usize)> {
        let rows = self.columns[0].len();
        let complete = |k: usize| self.columns.iter().all(|c| !c[k].is_nan());
        let mut far = vec![false; rows];
        for column in &self.columns {
            let mut from = 0;
            while from < rows {
                let to = (from..rows).find(|&k| !column[k].is_nan()).unwrap_or(rows);
                if to - from > LONGEST_FILL {
                    far[from..to].fill(true);
                }
                from = to + 1;
            }
        }
        let mut found = Vec::new();
        let mut from = 0;
        while from < rows {
            let to = (from..rows).find(|&k| far[k]).unwrap_or(rows);
            let first = (from..to).find(|&k| complete(k));
            let last = (from..to).rev().find(|&k| complete(k));
            if let (Some(first), Some(last)) = (first, last)
                && last + 1 - first >= LEAST_ROWS
            {
                found.push((first, last + 1));
            }
            from = (to..rows).find(|&k| !far[k]).unwrap_or(rows);
        }
        found
    }
}

/// A channel whose samples have their cycles, or which is interpolated.
enum Placed {
    Sampled(Vec<i64>),
    Held(Vec<i64>),
    LastValue,
    Interpolated(f64),
}

/// The rows of channels, or why they cannot be made.
pub(super) fn place(channels: &[StampedChannel], clocks: &Clocks, ts: f64) -> Result<Table, String> {
    let placed: Vec<Placed> =
        (0..channels.len()).map(|c| placed(&channels[c], c, clocks, ts)).collect::<Result<_, _>>()?;
    // What is held is known to the last cycle in which the log has any sample.
    let (mut from, mut to, mut end) = (i64::MIN, i64::MAX, i64::MIN);
    for (channel, placed) in channels.iter().zip(&placed) {
        let cycle = |t: f64| ((t - clocks.zero) / ts - clocks.begin).round() as i64;
        let (first, last) = (cycle(channel.times[0]), cycle(channel.times[channel.times.len() - 1]));
        end = end.max(match placed {
            Placed::Sampled(cycles) | Placed::Held(cycles) => cycles[cycles.len() - 1],
            Placed::LastValue | Placed::Interpolated(_) => last - 1,
        });
        match placed {
            Placed::Sampled(cycles) => (from, to) = (from.max(cycles[0]), to.min(cycles[cycles.len() - 1] + 1)),
            Placed::Held(cycles) => from = from.max(cycles[0]),
            Placed::LastValue => from = from.max(first + 1),
            Placed::Interpolated(_) => (from, to) = (from.max(first + 1), to.min(last)),
        }
    }
    to = to.min(end + 1);
    if from >= to {
        return Err("no cycle has a sample of each channel; check that all times are of one clock".into());
    }
    let stamps: usize = channels.iter().map(|c| c.times.len()).sum();
    let cycles = (to - from) as f64;
    if cycles > MOST_ROWS * stamps as f64 || cycles * channels.len() as f64 > MOST_NUMBERS {
        return Err(format!(
            "the log spans {cycles} cycles of {ts} s and has {stamps} samples, at most {MOST_NUMBERS:e} numbers are taken; state all times in \
             seconds, and cut a long log into parts"
        ));
    }
    let column = |(c, placed): (usize, &Placed)| fill_column(&channels[c], placed, clocks, ts, (from, to));
    let columns = placed.iter().enumerate().map(column).collect();
    let placement = |p: &Placed| match p {
        Placed::Sampled(_) => (Placement::Sampled, 0.0),
        Placed::Held(_) | Placed::LastValue => (Placement::Held, 0.0),
        Placed::Interpolated(error) => (Placement::Interpolated, *error),
    };
    let (placements, errors) = placed.iter().map(placement).unzip();
    let start = clocks.zero + ts * clocks.instant(from, 0.0);
    Ok(Table { start, columns, placements, errors })
}

fn placed(channel: &StampedChannel, c: usize, clocks: &Clocks, ts: f64) -> Result<Placed, String> {
    let name = &channel.channel.name;
    let Some(on) = clocks.on[c] else {
        return match channel.role {
            ChannelRole::External => Ok(Placed::LastValue),
            ChannelRole::Output if !channel.changes_only => interpolated(channel, ts),
            _ => Err(format!(
                "{name:?} does not follow the sample time of {ts} s (median step {} s): what the machine did between its samples is not in the \
                 log; log it in each cycle of the controller",
                few(step(&channel.times))
            )),
        };
    };
    let cycles = clocks.cycles(channel, on, ts)?;
    if channel.changes_only {
        return Ok(Placed::Held(cycles));
    }
    let span = (cycles[cycles.len() - 1] - cycles[0] + 1) as f64;
    let missing = 1.0 - cycles.len() as f64 / span;
    // Pauses of the logger are gaps, not a slower clock.
    let paused: i64 = cycles.windows(2).map(|w| w[1] - w[0] - 1).filter(|n| *n > LONGEST_FILL as i64).sum();
    let within = (missing * span - paused as f64) / (span - paused as f64).max(1.0);
    if within > MISSING_TO_ASK && is_written_on_change(&channel.values, within) {
        return Err(format!(
            "{name:?} misses {:.0} % of its samples, and no value repeats the one before: state that it is written only when it changes, \
             if it is, or leave it out",
            100.0 * within
        ));
    }
    match channel.role {
        _ if within <= MOST_MISSING && paused as f64 <= 0.9 * span => Ok(Placed::Sampled(cycles)),
        ChannelRole::Output => interpolated(channel, ts),
        ChannelRole::External => Ok(Placed::LastValue),
        ChannelRole::Input => Err(format!(
            "{name:?} has a sample in {:.0} % of the cycles of {ts} s (median step {} s); state the sample time of the controller, or that the \
             channel is written only when it changes, or log it in each cycle",
            100.0 * (1.0 - missing),
            few(step(&channel.times))
        )),
    }
}

/// Whether no value repeats the one before, although steps of the least size are at least half as frequent as missing samples: where each cycle
/// was logged, a step of zero would be half as frequent as those of plus or minus one quantum.
fn is_written_on_change(values: &[f64], missing: f64) -> bool {
    let steps = || values.windows(2).map(|w| (w[1] - w[0]).abs());
    let quantum = steps().fold(f64::INFINITY, f64::min);
    let least = steps().filter(|step| *step <= 1.01 * quantum).count();
    quantum > 0.0 && 2.0 * least as f64 >= missing * values.len() as f64
}

/// An output with a clock of its own, fast enough that its samples show what is between them.
fn interpolated(channel: &StampedChannel, ts: f64) -> Result<Placed, String> {
    let (name, usual) = (&channel.channel.name, step(&channel.times));
    let rate = ts / usual;
    let refused = |why: String| {
        Err(format!(
            "{name:?} is logged every {} s, the controller runs every {ts} s: what happens faster than {} Hz is not in the log ({why}); log it in \
             each cycle",
            few(usual),
            few(0.5 / usual)
        ))
    };
    if rate < LEAST_RATE {
        return refused(format!("{:.2} samples in a cycle, at least {LEAST_RATE:.2} are taken", rate));
    }
    let error = error_between(channel, usual);
    if rate < 1.5 && error > LARGEST_ERROR {
        let [found, most] = [100.0 * error.min(9.99), 100.0 * LARGEST_ERROR];
        return refused(format!(
            "a sample differs from what its neighbours say by {found:.0} % of the size of the channel, at most {most:.0} % are taken"
        ));
    }
    Ok(Placed::Interpolated(error))
}

/// Root mean square of the error of samples that are interpolated from their neighbours, as a share of the size of the channel.
fn error_between(channel: &StampedChannel, usual: f64) -> f64 {
    let (times, values) = (&channel.times, &channel.values);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let (mut error, mut size) = (0.0, 0.0);
    for k in (4..times.len().saturating_sub(4)).step_by((times.len() / TRIALS).max(1)) {
        let Some(found) = interpolate::value(times, values, usual, times[k], Some(k)) else { continue };
        error += (found - values[k]).powi(2);
        size += (values[k] - mean).powi(2);
    }
    if size > 0.0 { (error / size).sqrt() } else { 0.0 }
}

fn fill_column(
    channel: &StampedChannel,
    placed: &Placed,
    clocks: &Clocks,
    ts: f64,
    (from, to): (i64, i64),
) -> Vec<f64> {
    let rows = (to - from) as usize;
    let at = |row: usize, delay: f64| clocks.zero + ts * clocks.instant(from + row as i64, delay);
    let last = |k: usize| if k == 0 { f64::NAN } else { channel.values[k - 1] };
    match placed {
        Placed::Sampled(cycles) => {
            let mut column = vec![f64::NAN; rows];
            for (cycle, value) in cycles.iter().zip(&channel.values) {
                if let Some(row) = usize::try_from(cycle - from).ok().filter(|row| *row < rows) {
                    column[row] = *value;
                }
            }
            column
        }
        Placed::Held(cycles) => {
            (0..rows).map(|row| last(cycles.partition_point(|k| *k <= from + row as i64))).collect()
        }
        Placed::LastValue => {
            let known = |row: usize| channel.times.partition_point(|t| *t <= at(row, clocks.input));
            (0..rows).map(|row| last(known(row))).collect()
        }
        Placed::Interpolated(_) => {
            let usual = step(&channel.times);
            let value = |row| interpolate::value(&channel.times, &channel.values, usual, at(row, 0.0), None);
            (0..rows).map(|row| value(row).unwrap_or(f64::NAN)).collect()
        }
    }
}
