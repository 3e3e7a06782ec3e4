//! Clipping and saturation: an extreme value that is reached too often.
//!
//! The density of a signal falls towards its extremes, so that the largest value of a channel with steps is rarer than its
//! neighbours, and that of a channel without steps appears once. A limit makes it the most frequent of all. Of a channel
//! of noise without a limit, the value with the largest count among the outermost six is the outermost one only by
//! chance, and at least four times as frequent as the rest with a small probability from four samples on, two of them in a row.

use super::finding::{Finding, Severity, Test, with_unit};
use super::options::CheckOptions;
use youla::signal::Channel;

/// A limit at which a channel is clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Its value.
    pub value: f64,
    /// Samples at it.
    pub samples: usize,
    /// Longest stretch at it, samples.
    pub longest: usize,
    /// First and last sample at it, counted from 0.
    pub span: [usize; 2],
}

/// The limits of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Clipping {
    /// At its lowest value.
    pub lower: Option<Limit>,
    /// At its highest value.
    pub upper: Option<Limit>,
}

/// Neighbouring values with which the extreme one is compared.
/// Chosen; no false alarm in 200 simulated clean records (`docs/check.md`).
const NEIGHBOURS: usize = 5;

/// Finds the limits; `declared` are known ones, at or beyond which every sample counts.
///
/// ```
/// use youla_loop::check::{CheckOptions, clipping};
/// let wave: Vec<f64> = (0..1000).map(|k| (0.037 * f64::from(k)).sin().min(0.8)).collect();
/// let found = clipping(&wave, None, &CheckOptions::default());
/// assert_eq!((found.upper.unwrap().value, found.lower), (0.8, None));
/// ```
pub fn clipping(values: &[f64], declared: Option<[f64; 2]>, options: &CheckOptions) -> Clipping {
    if let Some([low, high]) = declared {
        let reach = 1e-9 * (high - low);
        return Clipping {
            lower: limit(values, low, |v| v <= low + reach),
            upper: limit(values, high, |v| v >= high - reach),
        };
    }
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let lower = piled_up(sorted.iter().copied(), options);
    let upper = piled_up(sorted.iter().rev().copied(), options);
    let levels = sorted.windows(2).filter(|w| w[0] != w[1]).count() + 1;
    if levels <= options.switched_levels {
        return Clipping::default();
    }
    let once =
        |limit: &Limit| limit.samples == limit.longest && limit.longest <= 2 * longest_of_others(values, limit.value);
    let held = |value: Option<f64>| {
        limit(values, value?, |v| Some(v) == value).filter(|limit| limit.longest > 1 && !once(limit))
    };
    Clipping { lower: held(lower), upper: held(upper) }
}

/// The outermost value, where it is more frequent than its neighbours by far.
fn piled_up(mut outside_in: impl Iterator<Item = f64>, options: &CheckOptions) -> Option<f64> {
    let outermost = outside_in.next()?;
    let (mut counts, mut last) = (vec![1usize], outermost);
    for value in outside_in {
        if value != last {
            if counts.len() > NEIGHBOURS {
                break;
            }
            counts.push(0);
            last = value;
        }
        *counts.last_mut()? += 1;
    }
    let next = counts[1..].iter().copied().max()?;
    let enough = counts[0] >= options.clipped_samples && counts[0] as f64 >= options.clipped_pile_up * next as f64;
    enough.then_some(outermost)
}

/// Longest stretch at any other value. A signal that is held, or slow against its steps, stays at its extreme as long as elsewhere; an
/// extreme that is reached once is a limit only where it is kept for longer.
fn longest_of_others(values: &[f64], extreme: f64) -> usize {
    values.chunk_by(|a, b| a == b).filter(|run| run[0] != extreme).map(<[f64]>::len).max().unwrap_or(0)
}

fn limit(values: &[f64], value: f64, at: impl Fn(f64) -> bool) -> Option<Limit> {
    let first = values.iter().position(|v| at(*v))?;
    let last = values.iter().rposition(|v| at(*v))?;
    let (mut samples, mut longest, mut run) = (0, 0, 0);
    for v in values {
        run = if at(*v) { run + 1 } else { 0 };
        samples += usize::from(run > 0);
        longest = longest.max(run);
    }
    Some(Limit { value, samples, longest, span: [first, last] })
}

impl Clipping {
    /// An input as applied may saturate; a clipped output is wrong.
    pub(super) fn findings(
        &self,
        record: &str,
        first: usize,
        channel: &Channel,
        output: bool,
        n: usize,
    ) -> Vec<Finding> {
        let one = |limit: &Limit, side: &str| {
            let share = 100.0 * limit.samples as f64 / n as f64;
            let what = format!(
                "it is clipped at its {side} value, {}, for {} samples ({share:.2} %), at most {} in a row",
                with_unit(limit.value, &channel.unit),
                limit.samples,
                limit.longest
            );
            let (severity, advice) = if output {
                let advice = "Exclude these stretches by `segments`, or log again with a lower excitation";
                (Severity::Defect, advice)
            } else {
                let advice = "Log the input as applied, after saturation. The plant model is then not affected, but the controller is not \
                              linear there: exclude long saturated stretches by `skip` or `segments`";
                (Severity::Caution, advice)
            };
            Finding::new(Test::Clipping, severity, record, what)
                .channel(&channel.name)
                .rows(first + limit.span[0], first + limit.span[1])
                .number("limit", limit.value)
                .number("samples", limit.samples as f64)
                .number("longest", limit.longest as f64)
                .advice(advice)
        };
        let (lower, upper) =
            (self.lower.iter().map(|l| one(l, "lowest")), self.upper.iter().map(|l| one(l, "highest")));
        lower.chain(upper).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Noise with and without steps has no limits in 200 records; clipped at two deviations it has both.
    #[test]
    fn steps_are_not_limits() {
        let options = CheckOptions::default();
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let step = [0.0, 0.02, 0.3][seed as usize % 3];
            let round = |v: f64| if step > 0.0 { (v / step).round() * step } else { v };
            let noise: Vec<f64> = (0..2000).map(|_| round(rng.sample(StandardNormal))).collect();
            assert_eq!(clipping(&noise, None, &options), Clipping::default(), "seed {seed}");
            let clipped: Vec<f64> = noise.iter().map(|v| v.clamp(-1.5, 1.5)).collect();
            let found = clipping(&clipped, None, &options);
            // Between a limit and the next of few coarse steps the count only doubles.
            let low = found.lower.filter(|low| low.value == -1.5 && low.samples > 90);
            assert!(step > 0.1 || (low.is_some() && found.upper.is_some()), "seed {seed}: {found:?}");
        }
    }

    /// A signal that is held for four samples here and there stays at its extreme once, as long as elsewhere; kept for twelve, it is at a
    /// limit.
    #[test]
    fn a_held_extreme_is_no_limit() {
        let options = CheckOptions::default();
        let mut values: Vec<f64> = (0..2000).map(|k| f64::from(k * 7919 % 2003)).collect();
        values[100..104].fill(1000.5);
        values[500..504].fill(3000.0);
        assert_eq!(clipping(&values, None, &options), Clipping::default());
        values[500..512].fill(3000.0);
        assert_eq!(clipping(&values, None, &options).upper.unwrap().longest, 12);
    }

    #[test]
    fn declared_limits_and_switched_channels() {
        let options = CheckOptions::default();
        let switched: Vec<f64> = (0..100).map(|k| f64::from(k / 7 % 2)).collect();
        assert_eq!(clipping(&switched, None, &options), Clipping::default());
        let found = clipping(&switched, Some([-1.0, 1.0]), &options);
        assert_eq!((found.lower, found.upper.unwrap().samples), (None, 49));
    }
}
