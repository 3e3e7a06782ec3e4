//! Properties of the excitation: size, crest factor, rank of its Hankel matrix, and the band in which it has power.
//!
//! Identification with past and future horizons p and f needs persistency of order p + f ([`youla::signal::persistency`]). Rank is
//! a question of rounding; the condition number says how much weaker the weakest direction is. Where the rank is too low, the lines of
//! the spectrum say whether frequencies are missing or only power at some: a signal with s lines is of order 2 s (L. Ljung, System
//! Identification, 2nd ed. (1999), section 13.2), however near to each other they are. The band ends where the spectrum (Welch) stays
//! 60 dB below its largest value.

use super::finding::{Finding, Severity, Test, few};
use super::options::CheckOptions;
use crate::error::Result;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;
use youla::MatRef;
use youla::lti::Discrete;
use youla::signal::Channel;
use youla::signal::{Welch, cross_spectrum, persistency, persistency_order};

/// Properties of an excitation.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationCheck {
    /// Standard deviation of each channel.
    pub deviations: Vec<f64>,
    /// Greatest distance from the mean over the standard deviation, of each channel; NaN for a constant one.
    pub crest: Vec<f64>,
    /// Block rows of the Hankel matrix.
    pub order: usize,
    /// Order of persistency of all channels together, at most `order`.
    pub reached: usize,
    /// Condition number of the Hankel matrix.
    pub condition: f64,
    /// The order that the lines of the spectrum give where the rank is lower, which then is one of rounding; 0 where a channel follows from
    /// others.
    pub by_lines: usize,
    /// Per channel, the frequency in Hz from which its power stays 60 dB below its largest; absent where it does not.
    pub band_end: Vec<Option<f64>>,
}

/// Power below which a band counts as empty, over the largest.
/// 60 dB. Chosen, not measured.
const EMPTY: f64 = 1e-6;
/// Condition numbers beyond this are rounding.
const ROUNDING: f64 = 1e13;
/// Samples of a window of the spectrum, at most.
/// Chosen, not measured.
const WINDOW: usize = 1024;
/// Fraction of the band up to Nyquist above which an empty band is reported.
/// Chosen, not measured.
const WORTH: f64 = 0.1;

/// Describes an excitation, samples x channels; the mean does not count.
///
/// # Errors
/// [`youla::Error::NoConvergence`] of the singular values.
///
/// ```
/// use youla::{Mat, lti::Discrete};
/// use youla_loop::check::excitation;
/// let turn = std::f64::consts::TAU / 100.0;
/// let sines = Mat::from_fn(2000, 1, |k, _| (5.0 * turn * k as f64).sin() + (13.0 * turn * k as f64).sin());
/// let found = excitation(sines.as_ref(), Discrete::new(0.01)?, 20)?;
/// assert_eq!((found.order, found.reached), (20, 4));
/// # Ok::<(), youla_loop::Error>(())
/// ```
pub fn excitation(signal: MatRef<'_, f64>, time: Discrete, order: usize) -> Result<ExcitationCheck> {
    let n = signal.nrows();
    let mut centred = signal.to_owned();
    let (mut deviations, mut crest) = (Vec::new(), Vec::new());
    for j in 0..signal.ncols() {
        let column = centred.col_as_slice_mut(j);
        let mean = column.iter().sum::<f64>() / n as f64;
        column.iter_mut().for_each(|v| *v -= mean);
        let deviation = (column.iter().map(|v| v * v).sum::<f64>() / n as f64).sqrt();
        let constant = deviation <= 1e-13 * mean.abs();
        if constant {
            column.fill(0.0);
        }
        let largest = column.iter().fold(0.0, |l: f64, v| l.max(v.abs()));
        deviations.push(if constant { 0.0 } else { deviation });
        crest.push(if constant { f64::NAN } else { largest / deviation });
    }
    // More block rows than a third of the samples say nothing of the signal.
    let order = order.min(n / (3 * signal.ncols().max(1))).max(1);
    let found = persistency(centred.as_ref(), order)?;
    let reached =
        if found.rank == found.needed { order } else { persistency_order(centred.as_ref(), order.saturating_sub(1))? };
    let by_lines = if reached == order { order } else { order_by_lines(centred.as_ref(), order, found.rank)? };
    let window = WINDOW.min(n / 4);
    let mut band_end = vec![None; signal.ncols()];
    for (j, end) in band_end.iter_mut().enumerate().filter(|(j, _)| window >= 16 && deviations[*j] > 0.0) {
        let welch = Welch { window, ..Welch::default() };
        let density =
            cross_spectrum(centred.as_ref().subcols(j, 1), centred.as_ref().subcols(j, 1), time, &welch)?.density;
        let power: Vec<f64> = density.entry(0, 0).iter().map(|s| s.re).collect();
        let largest = power.iter().copied().fold(0.0, f64::max);
        let last = power.iter().rposition(|s| *s > EMPTY * largest).unwrap_or(0);
        if ((last + 1) as f64) < (1.0 - WORTH) * power.len() as f64 {
            *end = Some(density.omega[last] / TAU);
        }
    }
    Ok(ExcitationCheck { deviations, crest, order, reached, condition: found.condition, by_lines, band_end })
}

/// Share of the sum of the ranks of the channels that the rank of all must have: a channel that repeats another leaves half.
/// Chosen, not measured.
const INDEPENDENT: f64 = 0.6;
/// Bins of a line at 60 dB under the window of Blackman and Harris (F. J. Harris, Proc. IEEE 66 (1978), 51), about.
const LOBE: usize = 7;

/// Twice the least number of lines of a channel, where the rank of all is that of the channels together.
fn order_by_lines(signal: MatRef<'_, f64>, order: usize, rank: usize) -> Result<usize> {
    let (mut sum, mut least) = (0, usize::MAX);
    for j in 0..signal.ncols() {
        let column: Vec<f64> = signal.col(j).iter().copied().collect();
        least = least.min(2 * spectral_lines(&column));
        sum += if signal.ncols() > 1 { persistency(signal.subcols(j, 1), order)?.rank } else { rank };
    }
    Ok(if rank as f64 >= INDEPENDENT * sum as f64 { least } else { 0 })
}

/// Frequency below which travel and drift may hide the lines of an excitation, a share of the sample rate, and the power of the rest over all from which
/// it is no rounding of a log of five digits.
const SLOW: f64 = 1e-3;
const ROUNDED: f64 = 1e-8;

/// Lines within 60 dB of the largest, of all or of those that are not slow.
fn spectral_lines(values: &[f64]) -> usize {
    let power = power_of(values);
    // Second differences take travel away before the window spreads it over the lines.
    let differences: Vec<f64> = values.windows(3).map(|v| v[2] - 2.0 * v[1] + v[0]).collect();
    let first = (SLOW * values.len() as f64) as usize + 1;
    let mut rest = power_of(&differences);
    for (k, power) in rest.iter_mut().enumerate().skip(1) {
        *power /= (2.0 - 2.0 * (TAU * k as f64 / differences.len() as f64).cos()).powi(2);
    }
    let rest = rest.get(first..).unwrap_or_default();
    let beyond_rounding = rest.iter().sum::<f64>() > ROUNDED * power.iter().sum::<f64>();
    lines_of(&power).max(if beyond_rounding { lines_of(rest) } else { 0 })
}

/// Power of the lines under the window of Blackman and Harris, up to the Nyquist frequency.
fn power_of(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let turn = |k: usize, times: f64| (TAU * times * k as f64 / n as f64).cos();
    let window = |k: usize| 0.358_75 - 0.488_29 * turn(k, 1.0) + 0.141_28 * turn(k, 2.0) - 0.011_68 * turn(k, 3.0);
    let mut buffer: Vec<Complex<f64>> =
        values.iter().enumerate().map(|(k, v)| Complex::new(v * window(k), 0.0)).collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut buffer);
    buffer[..n / 2].iter().map(|z| z.norm_sqr()).collect()
}

/// Lines within 60 dB of the largest: the maxima of each stretch of bins or, where it has hardly any, its bins but for a lobe.
fn lines_of(power: &[f64]) -> usize {
    let least = EMPTY * power.iter().copied().fold(0.0, f64::max);
    let (mut lines, mut bins, mut maxima) = (0, 0, 0);
    for k in 1..power.len() {
        if power[k] > least {
            bins += 1;
            maxima += usize::from(power[k] >= power[k - 1] && power.get(k + 1).is_none_or(|next| power[k] > *next));
        }
        if power[k] <= least || k + 1 == power.len() {
            lines += if maxima * (LOBE + 1) < bins { bins.saturating_sub(LOBE) } else { maxima };
            (bins, maxima) = (0, 0);
        }
    }
    lines
}

impl ExcitationCheck {
    /// `declared` where the signal is a known excitation and not the input; `may_rest` for a reference.
    pub(super) fn findings(
        &self,
        record: &str,
        channels: &[Channel],
        (declared, may_rest): (bool, bool),
        nyquist: f64,
        options: &CheckOptions,
    ) -> Vec<Finding> {
        let mut all = Vec::new();
        let dead: Vec<&Channel> =
            channels.iter().zip(&self.deviations).filter(|(_, d)| **d == 0.0).map(|(c, _)| c).collect();
        if may_rest && !dead.is_empty() {
            return all;
        }
        for channel in &dead {
            let what = match declared {
                true => "it is declared as an excitation, but is constant",
                false => "the input is constant",
            };
            let advice = "Log the injected signal, or remove the channel from run.toml; without excitation nothing can be \
                          identified";
            let finding = Finding::new(Test::Excitation, Severity::Defect, record, what.into());
            all.push(finding.channel(&channel.name).advice(advice));
        }
        if !dead.is_empty() {
            return all;
        }
        let names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
        let names = names.join(", ");
        let numbers = |finding: Finding| {
            let finding = finding
                .number("order", self.reached.max(self.by_lines).min(self.order) as f64)
                .number("needed", self.order as f64);
            finding.number("condition", self.condition)
        };
        let reached = self.reached.max(self.by_lines);
        if reached < self.order {
            let what = format!("it is persistently exciting of order {reached}, but {} are required", self.order);
            // Noise excites a loop too; half of the lines give a model of lower order.
            let severity = if 2 * reached < self.order { Severity::Defect } else { Severity::Caution };
            let advice = "Use more lines, a longer shift register or noise";
            all.push(numbers(Finding::new(Test::Excitation, severity, record, what).channel(&names)).advice(advice));
        } else if self.condition > options.excitation_condition {
            let what = format!(
                "the weakest direction of order {} of the excitation has {} times less amplitude than the strongest",
                self.order,
                match self.condition {
                    c if c < ROUNDING => few(c),
                    _ => "more than 1e13".to_owned(),
                }
            );
            let advice = "The model is inaccurate at frequencies without power; excite there";
            all.push(
                numbers(Finding::new(Test::Excitation, Severity::Note, record, what).channel(&names)).advice(advice),
            );
        }
        for ((channel, crest), end) in channels.iter().zip(&self.crest).zip(&self.band_end) {
            if *crest > options.crest {
                let what = format!(
                    "the excitation has a crest factor of {}: its energy is concentrated in few samples",
                    few(*crest)
                );
                let finding = Finding::new(Test::Excitation, Severity::Note, record, what).channel(&channel.name);
                let advice =
                    "A two-level signal has a crest factor of 1 and gives the same energy with a lower amplitude";
                all.push(finding.number("crest", *crest).advice(advice));
            }
            if let Some(hz) = end {
                let what = format!(
                    "from {} Hz to the Nyquist frequency of {} Hz its power is more than 60 dB below its maximum",
                    few(*hz),
                    few(nyquist)
                );
                let finding = Finding::new(Test::Excitation, Severity::Note, record, what).channel(&channel.name);
                let advice = "The plant cannot be identified there; a longer sample time is sufficient";
                all.push(finding.number("band_end_hz", *hz).advice(advice));
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;
    use youla::Mat;

    /// A multisine beside the path of a ramp through an integrator is as rich as alone; the path alone is not.
    #[test]
    fn travel_does_not_hide_the_lines_of_an_excitation() {
        let (turn, n) = (TAU / 8000.0, 20_000);
        let sines = |k: usize| (20..=400).step_by(4).map(|l| (turn * (l * k + l * l) as f64).sin()).sum::<f64>();
        let travel = |k: usize| 1e4 * (k as f64 / n as f64).powi(2);
        let lines = |of: &dyn Fn(usize) -> f64| {
            let signal = Mat::from_fn(n, 1, |k, _| of(k));
            excitation(signal.as_ref(), Discrete::new(1e-3).unwrap(), 40).unwrap().by_lines
        };
        assert!(lines(&|k| sines(k) + travel(k)) >= 40);
        assert!(lines(&travel) < 20, "{}", lines(&travel));
    }

    #[test]
    fn noise_is_enough_and_a_short_register_is_not() {
        let time = Discrete::new(1e-3).unwrap();
        let options = CheckOptions::default();
        let channels = [Channel::new("d", "V")];
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let noise = Mat::from_fn(4000, 1, |_, _| rng.sample::<f64, _>(StandardNormal));
        let found = excitation(noise.as_ref(), time, 40).unwrap();
        assert_eq!((found.reached, &found.band_end[..]), (40, &[None][..]));
        assert!(found.findings("log", &channels, (true, false), 500.0, &options).is_empty());
        // x^4 + x^3 + 1: period 15, order 14 without its mean.
        let mut register = 1u32;
        let mut bit = || {
            let new = (register ^ (register >> 1)) & 1;
            register = (register >> 1) | (new << 3);
            f64::from(register & 1)
        };
        let prbs = Mat::from_fn(4000, 1, |_, _| bit());
        let found = excitation(prbs.as_ref(), time, 40).unwrap();
        assert!((14..=15).contains(&found.reached), "{}", found.reached);
        let findings = found.findings("log", &channels, (true, false), 500.0, &options);
        assert_eq!(findings[0].severity, Severity::Defect);
        let zero = excitation(Mat::zeros(4000, 1).as_ref(), time, 40).unwrap();
        assert!(zero.findings("log", &channels, (true, false), 500.0, &options)[0].what.contains("is constant"));
        assert!(zero.findings("log", &channels, (true, true), 500.0, &options).is_empty());
    }
}
