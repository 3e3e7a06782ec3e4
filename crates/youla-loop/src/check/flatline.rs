//! Constant stretches: a sensor that is stuck, a disconnected cable, a logger that repeats its last value.
//!
//! Of N samples of which the share q equals the one before, a constant stretch of L samples has a probability of about
//! `N q^(L-1)`. Friction and coarse steps make longer ones, but many of them, so that the stretch must also be several times as
//! long as every other one of the channel.
//!
//! Held channels: a sensor or a task that runs at a fraction of the rate of the log, so that its value is repeated until the next one.
//!
//! Every change of a held channel is a whole number of periods after the first one: the period is the greatest common divisor of the
//! distances between changes. By chance n changes of a channel that is not held have a common divisor of 2 with a probability of `2^-n`.

use super::finding::{Finding, Severity, Test, with_unit};
use super::options::CheckOptions;
use youla::signal::Channel;

/// A constant stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    /// First sample, counted from 0.
    pub first: usize,
    /// Its length in samples.
    pub samples: usize,
    /// The value.
    pub value: f64,
    /// Length of the next longest constant stretch of the channel.
    pub next: usize,
}

/// Probability of a stretch by chance in a record.
/// Chosen; no false alarm in 200 simulated clean records (`docs/check.md`).
const CHANCE: f64 = 1e-4;
/// Shortest stretch that is tested.
/// Repeats of 2 and 3 samples are frequent in coarsely quantised records. Chosen, not measured.
const SHORTEST: usize = 4;

/// A channel with so many other constant stretches, no more likely by chance, of more than this part of the longest rests: it is not stuck. A
/// heater of 33 steps at a set point rested for 1746 samples, and for 188 to 565 five times.
const RESTS: usize = 4;
/// One over that part.
const A_REST: usize = 10;

/// Length up to which a constant start of a channel is the rest before the excitation has come through the dead time.
/// Chosen, not measured.
const AT_REST: usize = 100;

/// Looks for the longest constant stretch that is out of proportion. `None` also for a channel that is switched between few
/// values.
///
/// ```
/// use youla_loop::check::{CheckOptions, stuck};
/// let mut wave: Vec<f64> = (0..500).map(|k| (0.3 * f64::from(k)).sin()).collect();
/// wave[200..230].fill(0.25);
/// let found = stuck(&wave, &CheckOptions::default()).unwrap();
/// assert_eq!((found.first, found.samples), (200, 30));
/// ```
pub fn stuck(values: &[f64], options: &CheckOptions) -> Option<Standstill> {
    // Lengths and first samples, the longest first.
    let mut longest = [(0, 0); RESTS + 1];
    let (mut first, mut repeated) = (0, 0);
    for stretch in values.chunk_by(|a, b| a == b) {
        repeated += stretch.len() - 1;
        if stretch.len() > longest[RESTS].0 {
            longest[RESTS] = (stretch.len(), first);
            longest.sort_by_key(|(samples, _)| std::cmp::Reverse(*samples));
        }
        first += stretch.len();
    }
    let [(samples, first), (next, _), ..] = longest;
    // Before it first moves a machine is at rest, and its command is the excitation.
    let leading: usize = values.chunk_by(|a, b| a == b).take_while(|s| s.len() > 1).map(<[f64]>::len).sum();
    let rests = first < leading && first + samples < AT_REST;
    if rests || samples < SHORTEST || samples == values.len() || samples as f64 <= options.stuck_ratio * next as f64 {
        return None;
    }
    // The stretch itself does not count in what is usual.
    let others = (values.len() - samples) as f64;
    let share = (repeated + 1 - samples) as f64 / others;
    let by_chance = |samples: usize| others * share.powf(samples as f64 - 1.0) >= CHANCE;
    // An actuator of few steps rests at set points for long, now and then.
    let other = longest[RESTS].0;
    let often = other * A_REST > samples && !by_chance(other);
    (!by_chance(samples) && !often && several(values, options.switched_levels)).then_some(Standstill {
        first,
        samples,
        value: values[first],
        next,
    })
}

/// Whether a channel has more than `levels` values.
fn several(values: &[f64], levels: usize) -> bool {
    let mut seen: Vec<f64> = Vec::new();
    for v in values {
        if !seen.contains(v) {
            seen.push(*v);
        }
        if seen.len() > levels {
            return true;
        }
    }
    false
}

impl Standstill {
    pub(super) fn finding(&self, record: &str, first: usize, channel: &Channel) -> Finding {
        let what = format!(
            "it is constant at {} for {} samples; the next longest constant stretch has {}",
            with_unit(self.value, &channel.unit),
            self.samples,
            self.next
        );
        Finding::new(Test::Stuck, Severity::Defect, record, what)
            .channel(&channel.name)
            .rows(first + self.first, first + self.first + self.samples - 1)
            .number("samples", self.samples as f64)
            .number("next", self.next as f64)
            .advice("Exclude these rows by `segments`; check the sensor and the logger for dropouts")
    }
}

/// Least number of changes: by chance a channel passes for held with a probability of 1e-6.
const LEAST_CHANGES: usize = 20;
/// Least share of the periods with a change: a signal that is switched now and then at round times is not sampled slowly.
const LEAST_SHARE: f64 = 0.5;

/// The period of a held channel in samples, 2 or more; `None` for one that is not held, and for one that is switched between few values.
///
/// ```
/// use youla_loop::check::{CheckOptions, held};
/// let options = CheckOptions::default();
/// let wave = |step: u32| (0..300).map(|k| (0.1 * f64::from(k / step * step)).sin()).collect::<Vec<f64>>();
/// assert_eq!((held(&wave(1), &options), held(&wave(4), &options)), (None, Some(4)));
/// ```
pub fn held(values: &[f64], options: &CheckOptions) -> Option<usize> {
    let changes: Vec<usize> = (1..values.len()).filter(|k| values[*k] != values[*k - 1]).collect();
    let period = changes.windows(2).fold(0, |divisor, pair| common_divisor(pair[1] - pair[0], divisor));
    let periods = values.len() as f64 / period.max(1) as f64;
    let steady = changes.len() >= LEAST_CHANGES && changes.len() as f64 >= LEAST_SHARE * periods;
    (period > 1 && steady && several(values, options.switched_levels)).then_some(period)
}

fn common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

/// What is said of a held channel: an output is delayed by a time that varies from row to row, which no model at the rate of the log describes;
/// an input may be what a slower controller commands.
pub(super) fn of_held(period: usize, record: &str, channel: &Channel, output: bool) -> Finding {
    let (severity, source) =
        if output { (Severity::Caution, "sensor or bus") } else { (Severity::Note, "controller or generator") };
    let what = format!(
        "it changes in one row of {period} only, always the same: its {source} is {period} times slower than the log"
    );
    let found =
        Finding::new(Test::Timing, severity, record, what).channel(&channel.name).number("period", period as f64);
    let advice = format!("Keep one row of {period}, in which it changes, and give the sample time of those rows");
    if output { found.advice(&advice) } else { found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// A command at the start of a record: the excitation alone, of two levels, until a coarse encoder shows its first count.
    #[test]
    fn a_command_is_the_excitation_before_the_first_count() {
        let moving = (0..500).map(|k| (0.3 * f64::from(k)).sin());
        let start = [vec![-1.0; 4], vec![1.0; 13]].concat();
        let options = CheckOptions::default();
        let record: Vec<f64> = start.iter().copied().chain(moving.clone()).collect();
        assert_eq!(stuck(&record, &options), None);
        let later: Vec<f64> = moving.clone().chain(start).chain(moving).collect();
        assert_eq!(stuck(&later, &options).unwrap().samples, 13);
    }

    /// A heater of 32 steps that rests at set points, and the same stuck once for as long as the longest.
    #[test]
    fn an_actuator_of_few_steps_rests() {
        let rests = |rests: &[usize]| {
            let mut level = 0;
            let steps = (0..3000).map(|k| ((k * 7) % 32, 1 + k % 3)).chain(rests.iter().map(|rest| (33, *rest)));
            let of = |(step, samples): (usize, usize)| {
                level = 1 - level;
                vec![(step + level) as f64; samples]
            };
            steps.flat_map(of).collect::<Vec<f64>>()
        };
        let options = CheckOptions::default();
        assert_eq!(stuck(&rests(&[188, 228, 282, 350, 565, 1746]), &options), None);
        assert_eq!(stuck(&rests(&[1746]), &options).unwrap().samples, 1746);
    }

    /// Noise in steps of twice its deviation repeats itself often; nothing in 200 records, and 40 equal samples in each.
    #[test]
    fn chance_makes_short_stretches() {
        let options = CheckOptions::default();
        let mut found = 0;
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut noise: Vec<f64> =
                (0..3000).map(|_| (rng.sample::<f64, _>(StandardNormal) * 4.0).round() * 0.25).collect();
            assert_eq!(stuck(&noise, &options), None, "seed {seed}");
            noise[1000..1040].fill(0.25);
            found += usize::from(stuck(&noise, &options).is_some_and(|s| s.samples.abs_diff(40) < 4));
        }
        assert_eq!(found, 200);
    }

    /// Coarse steps of noise repeat values at any row: nothing in 200 records, and the period in each where every third value is kept.
    #[test]
    fn coarse_steps_are_not_held() {
        let options = CheckOptions::default();
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let noise: Vec<f64> = (0..900).map(|_| (rng.sample::<f64, _>(StandardNormal) * 4.0).round()).collect();
            assert_eq!(held(&noise, &options), None, "seed {seed}");
            let third: Vec<f64> = (0..900).map(|k| noise[(k + 1) / 3]).collect();
            assert_eq!(held(&third, &options), Some(3), "seed {seed}");
        }
    }

    /// A command that is switched every 100 samples, or that hardly changes, is none.
    #[test]
    fn switched_commands_are_not_held() {
        let switched: Vec<f64> = (0..5000).map(|k| f64::from((k / 100) % 3 == 0)).collect();
        let options = CheckOptions::default();
        let found = [&switched[..], &[0.0; 500], &[]].map(|values| held(values, &options));
        assert_eq!(found, [None; 3]);
    }
}
