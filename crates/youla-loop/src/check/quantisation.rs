//! The step of a channel, as of an encoder or a converter of few bits.
//!
//! The distinct values of a channel with steps are whole multiples of a step q apart. Its rounding adds noise of variance
//! `q^2 / 12` (B. Widrow, I. Kollar, Quantization Noise, 2008, chapter 4), which is compared with the innovation of the output.

use super::finding::{Finding, Severity, Test, few, with_unit};
use super::options::CheckOptions;
use youla::signal::Channel;

/// The steps of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantisation {
    /// Step q.
    pub step: f64,
    /// Distinct values.
    pub levels: usize,
    /// Standard deviation of the signal in steps.
    pub deviation_in_steps: f64,
}

/// Differences of distinct values below this share of the range are rounding of the file.
/// Six digits, as logs in text are often written. Chosen, not measured.
const ROUNDING: f64 = 1e-6;
/// Distance from a whole multiple, in steps, up to which a difference is one.
/// Uniform remainders fall within it in a tenth of the cases.
const WHOLE: f64 = 0.05;
/// Share of the differences that must be whole multiples; of numbers without steps a tenth is.
/// Chance of 0.9 of 20 differences at a rate of a tenth: 1.5e-16 (binomial).
const SHARE: f64 = 0.9;

/// Finds the step of a channel. `None` where the values are not multiples of one, and for switched channels.
///
/// ```
/// use youla_loop::check::{CheckOptions, quantisation};
/// let steps: Vec<f64> = (0..1000).map(|k| ((0.037 * f64::from(k)).sin() * 20.0).round() * 0.05).collect();
/// let found = quantisation(&steps, &CheckOptions::default()).unwrap();
/// assert!((found.step - 0.05).abs() < 1e-9 && found.levels == 41);
/// ```
pub fn quantisation(values: &[f64], options: &CheckOptions) -> Option<Quantisation> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let range = sorted.last()? - sorted.first()?;
    let mut distinct: Vec<f64> = Vec::new();
    for v in sorted {
        if distinct.last().is_none_or(|last| v - last > ROUNDING * range) {
            distinct.push(v);
        }
    }
    if distinct.len() <= options.switched_levels {
        return None;
    }
    let differences: Vec<f64> = distinct.windows(2).map(|w| w[1] - w[0]).collect();
    let least = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let mut single: Vec<f64> = differences.iter().copied().filter(|d| *d < 1.5 * least).collect();
    let middle = single.len() / 2;
    let step = *single.select_nth_unstable_by(middle, f64::total_cmp).1;
    let whole = differences.iter().filter(|d| ((*d / step) - (*d / step).round()).abs() < WHOLE).count();
    if (whole as f64) < SHARE * differences.len() as f64 {
        return None;
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let deviation = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
    Some(Quantisation { step, levels: distinct.len(), deviation_in_steps: deviation / step })
}

impl Quantisation {
    /// `innovation` is the standard deviation of the innovation of the channel, where it is an output.
    pub(super) fn finding(
        &self,
        record: &str,
        channel: &Channel,
        innovation: Option<f64>,
        options: &CheckOptions,
    ) -> Option<Finding> {
        let variance = self.step * self.step / 12.0;
        let share = innovation.map(|s| if s > 0.0 { variance / (s * s) } else { f64::INFINITY });
        let coarse = self.deviation_in_steps < options.coarse_steps;
        let severity = match share {
            _ if coarse => Severity::Defect,
            Some(share) if share > options.quantisation_share => Severity::Caution,
            // Many fine steps come from numbers with few digits.
            _ if self.deviation_in_steps > FINE => return None,
            _ => Severity::Note,
        };
        let of_noise = share.map_or(String::new(), |share| match share {
            s if s < 1.0 => format!("; quantisation noise is {} % of the variance of the innovation", few(100.0 * s)),
            _ => "; quantisation noise is all of the variance of the innovation".to_owned(),
        });
        let what = format!(
            "its resolution is {}; its standard deviation is {} steps{of_noise}",
            with_unit(self.step, &channel.unit),
            few(self.deviation_in_steps)
        );
        let advice = match severity {
            Severity::Note => "",
            _ => {
                "Increase the excitation or use a sensor of higher resolution; otherwise quantisation noise limits the accuracy \
                  where the response is small"
            }
        };
        let finding = Finding::new(Test::Quantisation, severity, record, what)
            .channel(&channel.name)
            .number("step", self.step)
            .number("deviation_in_steps", self.deviation_in_steps)
            .number("levels", self.levels as f64)
            .advice(advice);
        Some(match share {
            Some(share) => finding.number("share_of_innovation", share),
            None => finding,
        })
    }
}

/// Steps per standard deviation above which no note is reported.
/// The variance of the steps is then `1 / (12 * 100^2)` = 8e-6 of that of the signal. Chosen, not measured.
const FINE: f64 = 100.0;

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Noise has no step in 200 records, rounded to 0.01 it has, also through single precision.
    #[test]
    fn steps_are_found_and_not_invented() {
        let options = CheckOptions::default();
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let noise: Vec<f64> = (0..2000).map(|_| rng.sample(StandardNormal)).collect();
            assert_eq!(quantisation(&noise, &options), None, "seed {seed}");
            let stepped: Vec<f64> = noise.iter().map(|v| f64::from(((v * 100.0).round() * 0.01) as f32)).collect();
            let found = quantisation(&stepped, &options).unwrap();
            assert!((found.step / 0.01 - 1.0).abs() < 1e-4 && (found.deviation_in_steps / 100.0 - 1.0).abs() < 0.1);
        }
    }
}
