//! Held channels: a sensor or a task that runs at a fraction of the rate of the log, so that its value is repeated until the next one.
//!
//! Every change of a held channel is a whole number of periods after the first one: the period is the greatest common divisor of the
//! distances between changes. By chance n changes of a channel that is not held have a common divisor of 2 with a probability of `2^-n`.

use super::finding::{Finding, Severity, Test};
use super::flatline::several;
use super::options::CheckOptions;
use youla::signal::Channel;

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
pub(super) fn finding(period: usize, record: &str, channel: &Channel, output: bool) -> Finding {
    let (severity, source) =
        if output { (Severity::Caution, "sensor or bus") } else { (Severity::Note, "controller or generator") };
    let what = format!(
        "it changes in one row of {period} only, always the same: its {source} is {period} times slower than the log"
    );
    let advice = format!("Keep one row of {period}, in which it changes, and give the sample time of those rows");
    let advice = if output { advice } else { String::new() };
    Finding::new(Test::Timing, severity, record, what)
        .channel(&channel.name)
        .number("period", period as f64)
        .advice(&advice)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

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
