//! Which channels follow the clock of the controller, and which cycle each sample belongs to.
//!
//! With stamps t_i and the stated sample time T, the phase of a clock over a block of stamps is the angle of the circular mean
//! ```text
//! R exp(2 pi j phi) = mean exp(2 pi j t_i / T)
//! ```
//! (Mardia and Jupp, Directional statistics, section 2.3), and sample i belongs to cycle round(t_i / T - phi). Gaussian scatter of standard deviation
//! s T gives R = exp(-2 (pi s)^2).

use super::{ChannelRole, ChannelTiming, StampedChannel, rows::Table};
use std::f64::consts::TAU;
use youla::c64;
use youla::statistics::median;

/// Stamps of a block: a phase of standard deviation 0.03 at the largest scatter, over which a clock may drift by half a cycle.
const BLOCK: usize = 100;
/// Least length of the circular mean of a channel on the clock: scatter of 0.25 of a cycle.
const LEAST_LENGTH: f64 = 0.3;
/// An input belongs to the cycle of an output that comes up to this share of a cycle after it: order of writing within a cycle, not cause.
const BEFORE: f64 = 0.15;
/// More samples than cycles by this many, where scatter alone delays one sample behind the next: the sample time is not that of the channel.
const MOST_BEHIND: f64 = 20.0;

/// Cycles between the samples of a channel from which on its time is in another unit: a slow telemetry has a sample in each second cycle to fiftieth.
const MOST_CYCLES: f64 = 100.0;

/// Most cycles of a log: a time stamp of 64 bits counts cycles up to there without rounding them.
const LONGEST: f64 = 1e12;

/// The clock of the controller and the place of each channel on it.
pub(super) struct Clocks {
    /// Time of the first stamp, seconds.
    pub(super) zero: f64,
    reference: Phase,
    /// Phase of the outputs at which a cycle begins, cycles.
    pub(super) begin: f64,
    /// Delay of the inputs in a cycle, cycles.
    pub(super) input: f64,
    /// Of each channel: `None` for another clock.
    pub(super) on: Vec<Option<OnClock>>,
}

/// A channel on the clock.
#[derive(Debug, Clone, Copy)]
pub(super) struct OnClock {
    /// Phase against the reference, cycles.
    phase: f64,
    /// After the beginning of its cycle, cycles.
    delay: f64,
    /// Root mean square of the scatter, cycles.
    jitter: f64,
}

/// The phase of the clock over time, in cycles of the stated sample time.
struct Phase {
    at: Vec<f64>,
    phase: Vec<f64>,
}

/// Angle in cycles, -1/2 to 1/2, and length of the circular mean.
fn circular_mean(x: impl Iterator<Item = f64>) -> (f64, f64) {
    let (sum, n) = x.fold((c64::new(0.0, 0.0), 0.0), |(sum, n), x| (sum + c64::cis(TAU * (x - x.floor())), n + 1.0));
    (sum.arg() / TAU, sum.norm() / n)
}

/// Into [low, low + 1).
fn wrap(x: f64, low: f64) -> f64 {
    x - (x - low).floor()
}

impl Phase {
    /// Of stamps in cycles; `None` where they do not follow the sample time.
    fn of(x: &[f64]) -> Option<Phase> {
        let blocks = (x.len() / BLOCK).max(1);
        let (mut at, mut phase, mut length) = (Vec::new(), Vec::<f64>::new(), 0.0);
        for b in 0..blocks {
            let block = &x[b * x.len() / blocks..(b + 1) * x.len() / blocks];
            let (angle, r) = circular_mean(block.iter().copied());
            // A clock drifts little from block to block.
            let before = phase.last().copied().unwrap_or(0.0);
            phase.push(wrap(angle, before - 0.5));
            at.push(block.iter().sum::<f64>() / block.len() as f64);
            length += r / blocks as f64;
        }
        (length >= LEAST_LENGTH).then_some(Phase { at, phase })
    }

    /// At a time, in cycles.
    fn at(&self, x: f64) -> f64 {
        let n = self.at.len();
        if n < 2 {
            return self.phase[0];
        }
        let k = self.at.partition_point(|at| *at < x).clamp(1, n - 1);
        let slope = (self.phase[k] - self.phase[k - 1]) / (self.at[k] - self.at[k - 1]).max(1.0);
        self.phase[k - 1] + slope * (x - self.at[k - 1])
    }
}

/// The clocks of channels, or why there is none.
pub(super) fn clocks(channels: &[StampedChannel], ts: f64) -> Result<Clocks, String> {
    let zero = channels.iter().map(|c| c.times[0]).fold(f64::INFINITY, f64::min);
    let last_start = channels.iter().map(|c| c.times[0]).fold(zero, f64::max);
    if let Some(c) = channels.iter().find(|c| !c.changes_only && c.times[c.times.len() - 1] <= last_start) {
        return Err(format!(
            "the last sample of {:?} comes before the first one of another channel; check that all times are of one clock",
            c.channel.name
        ));
    }
    let end = channels.iter().map(|c| c.times[c.times.len() - 1]).fold(zero, f64::max);
    if (end - zero) / ts > LONGEST {
        return Err(format!("the time stamps span more than {LONGEST:e} cycles of {ts} s; state all times in seconds"));
    }
    let slow = channels.iter().find(|c| !c.changes_only && step(&c.times) > MOST_CYCLES * ts);
    if let Some(c) = slow {
        return Err(format!(
            "the median step of the time stamps of {:?} is {} s, the sample time {ts} s; state the unit of the time, and the sample time in seconds",
            c.channel.name,
            few(step(&c.times))
        ));
    }
    let cycles = |c: &StampedChannel| c.times.iter().map(|t| (t - zero) / ts).collect::<Vec<f64>>();
    let mut plant: Vec<&StampedChannel> = channels.iter().filter(|c| c.role != ChannelRole::External).collect();
    plant.sort_by_key(|c| std::cmp::Reverse(c.times.len()));
    let Some(reference) = plant.iter().find_map(|c| Phase::of(&cycles(c))) else {
        let steps = plant.iter().take(3).map(|c| format!("{:?} {}", c.channel.name, few(step(&c.times))));
        let steps = steps.collect::<Vec<_>>().join(", ");
        return Err(format!(
            "no input and no output follows the sample time of {ts} s; the median steps of their time stamps are, in seconds, {steps}; \
             state the sample time of the controller, and times in seconds"
        ));
    };
    let on = |c: &StampedChannel| {
        let of: Vec<f64> = cycles(c).into_iter().map(|x| x - reference.at(x)).collect();
        let (phase, length) = circular_mean(of.iter().copied());
        let scatter = of.iter().map(|x| wrap(x - phase, -0.5).powi(2)).sum::<f64>() / of.len() as f64;
        (length >= LEAST_LENGTH).then_some(OnClock { phase, delay: 0.0, jitter: scatter.sqrt() })
    };
    let mut on: Vec<Option<OnClock>> = channels.iter().map(on).collect();
    let first = |role, on: &[Option<OnClock>]| (0..on.len()).find(|&c| channels[c].role == role && on[c].is_some());
    let begin =
        first(ChannelRole::Output, &on).or(first(ChannelRole::Input, &on)).and_then(|c| on[c]).map_or(0.0, |o| o.phase);
    let delays = |role: ChannelRole, low: f64, on: &mut [Option<OnClock>]| {
        let of_role = on.iter_mut().zip(channels).filter(|(_, c)| c.role == role);
        of_role.filter_map(|(o, _)| o.as_mut()).for_each(|o| o.delay = wrap(o.phase - begin, low));
    };
    delays(ChannelRole::Output, -0.5, &mut on);
    delays(ChannelRole::Input, -BEFORE, &mut on);
    let input = first(ChannelRole::Input, &on).and_then(|c| on[c]).map_or(0.0, |o| o.delay);
    // What comes from outside acts in the cycle whose input follows it.
    delays(ChannelRole::External, input + BEFORE - 1.0, &mut on);
    Ok(Clocks { zero, reference, begin, input, on })
}

/// Median step of time stamps, seconds.
pub(super) fn step(times: &[f64]) -> f64 {
    if times.len() < 2 { 0.0 } else { median(times.windows(2).map(|w| w[1] - w[0])) }
}

/// A time for a message: four digits.
pub(super) fn few(seconds: f64) -> f64 {
    format!("{seconds:.3e}").parse().unwrap_or(seconds)
}

impl Clocks {
    /// The cycle of each sample of a channel on the clock; a sample whose stamp comes late is put before the next one.
    pub(super) fn cycles(&self, c: &StampedChannel, on: OnClock, ts: f64) -> Result<Vec<i64>, String> {
        let place = |t: &f64| {
            let x = (t - self.zero) / ts;
            x - self.reference.at(x) - self.begin - on.delay
        };
        let mut found: Vec<i64> = c.times.iter().map(|t| place(t).round() as i64).collect();
        if c.changes_only {
            return Ok(found);
        }
        for k in (0..found.len().saturating_sub(1)).rev() {
            let rounded = found[k];
            found[k] = rounded.min(found[k + 1] - 1);
            if (rounded - found[k]) as f64 > MOST_BEHIND {
                return Err(format!(
                    "channel {:?} has more samples than the sample time of {ts} s has cycles, about sample {} (counted from 1); its median step is \
                     {} s; remove samples that were logged twice, or state the sample time of the controller",
                    c.channel.name,
                    k + 1,
                    few(step(&c.times))
                ));
            }
        }
        Ok(found)
    }

    /// Time of the beginning of a cycle, plus a delay, cycles after the first stamp.
    pub(super) fn instant(&self, cycle: i64, delay: f64) -> f64 {
        let x = cycle as f64 + self.begin + delay;
        x + self.reference.at(x)
    }

    /// Sample time by the stamps over the stated one, less one: the slope of the line through the phases.
    pub(super) fn drift(&self) -> f64 {
        let Phase { at, phase } = &self.reference;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let (middle, level) = (mean(at), mean(phase));
        let (above, below) = at.iter().zip(phase).fold((0.0, 0.0), |(above, below), (at, phase)| {
            (above + (at - middle) * (phase - level), below + (at - middle).powi(2))
        });
        if below > 0.0 { above / below } else { 0.0 }
    }

    /// The timing of channel `c`, of which `filled` values were filled with an error.
    pub(super) fn timing(
        &self,
        channels: &[StampedChannel],
        c: usize,
        ts: f64,
        table: &Table,
        (filled, error): (usize, f64),
    ) -> ChannelTiming {
        let StampedChannel { channel, times, .. } = &channels[c];
        let usual = step(times);
        let own = || {
            let squares = times.windows(2).map(|w| (w[1] - w[0] - usual).powi(2)).sum::<f64>();
            // Of the difference of two stamps.
            (squares / (2.0 * times.len().max(2) as f64)).sqrt()
        };
        ChannelTiming {
            name: channel.name.clone(),
            samples: times.len(),
            step: usual,
            longest_step: times.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max),
            jitter: self.on[c].map_or_else(own, |o| o.jitter * ts),
            delay: self.on[c].map(|o| o.delay * ts),
            placement: table.placements[c],
            filled,
            error: error.hypot(table.errors[c]),
        }
    }
}
