//! Narrow lines in a signal that no excitation has: unbalance, run-out, gears, mains.
//!
//! What the excitation explains of the bins of the Hann-windowed transform, by a gain with a slope for each group of neighbouring bins, is left out: beside the
//! response to it a line would have to exceed that response. A bin of what is left is compared with the median of its neighbours, without the two
//! on either side that it leaks into. Over noise the ratio to the mean of the neighbours has, with nu of them independent, the tail
//! `(1 + x / nu)^-nu`, from which the threshold for the given probability in N / 2 lines follows. Resonances are wider than a line
//! and lift their neighbours; a line must also stand out from the eight nearest of them and fall off by a factor five within two bins, as the window makes it. Lines that
//! the excitation has too are not disturbances.
//!
//! Source: for the window F. J. Harris, Proc. IEEE 66 (1978), 51; for the test R. A. Fisher, Proc. R. Soc. A 125 (1929), 54.

use crate::linalg::TINY;
use crate::lti::Discrete;
use crate::statistics::median;
use faer::linalg::solvers::SolveLstsq;
use faer::{ColRef, Mat, MatRef, c64};
use rustfft::FftPlanner;
use std::f64::consts::TAU;
use std::ops::Range;

/// A line in a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralLine {
    /// Frequency, Hz; between bins by the ratio of the neighbours.
    pub hz: f64,
    /// Amplitude, in the unit of the channel.
    pub amplitude: f64,
    /// Its power over that of the neighbourhood.
    pub ratio: f64,
    /// What the ratio exceeds with the given probability where there is no line.
    pub threshold: f64,
    /// Multiple of the lowest line of which this is a harmonic; 1 for the lowest itself, `None` where it is none.
    pub multiple: Option<usize>,
}

/// Neighbours on each side, at least and at most.
/// Chosen; no false alarm in 200 simulated clean records (`docs/check.md`).
const SIDE: [usize; 2] = [20, 60];
/// Ratio to the mean of the eight nearest bins that a line leaks nothing into: `4 ((20 / 1e-3)^(1/4) - 1)`, for the 20 or so bins of
/// a resonance that stand out from further neighbours.
const NEAR: f64 = 43.6;
/// Fall within two bins.
/// A line under the Hann window falls to at most 1/25 of its power within two bins of its peak; a resonance of 0.5 % damping falls less
/// (test `a_resonance_is_no_line`).
const FALL: f64 = 0.2;
/// Ratio of a line of an excitation, over the threshold, from which it is taken to be the cause; noise reaches it in one of 1e4.
const SHARED: f64 = 0.6;
/// First bin that may be a line: a drift or the travel of an axis falls over the bins below it as steeply as a line. Chosen.
const FIRST: usize = 12;
/// Lines of an excitation from which it is periodic, as a share of the bins: its lines are everywhere.
/// Chosen, not measured.
const PERIODIC: f64 = 0.02;

/// The lines of each column of some signals that none of the `known` ones has; known signals of another length than these are left out of account.
/// `false_alarm` is the probability that a column of noise has one.
///
/// ```
/// use youla::{Mat, lti::Discrete, signal::spectral_lines};
/// let noise = |k: usize| ((k * k * 31 + 7 * k) % 8191) as f64 / 8191.0 - 0.5;
/// let y = Mat::from_fn(4000, 1, |k, _| noise(k) + 0.2 * (k as f64 * 0.5).sin());
/// let found = spectral_lines(&[y.as_ref()], &[], Discrete::new(0.01)?, 1e-3);
/// assert_eq!(found[0].len(), 1);
/// assert!((found[0][0].hz - 7.958).abs() < 0.01 && (found[0][0].amplitude - 0.2).abs() < 0.02);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn spectral_lines(
    signals: &[MatRef<'_, f64>],
    known: &[MatRef<'_, f64>],
    time: Discrete,
    false_alarm: f64,
) -> Vec<Vec<SpectralLine>> {
    let rows = signals.first().map_or(0, MatRef::nrows);
    let known = known.iter().filter(|x| x.nrows() == rows).flat_map(|x| x.col_iter());
    let known: Vec<Spectrum> = known.filter_map(Spectrum::new).collect();
    let of = |column| Spectrum::new(column).map_or_else(Vec::new, |x| x.beside(&known, time, false_alarm));
    signals.iter().flat_map(|x| x.col_iter()).map(of).collect()
}

/// Least share of the largest amplitude at a quarter, half and three quarters of a record that a line keeps at each.
/// A resonance that a chirp passes decays to nothing. Chosen, not measured.
const LASTS: f64 = 0.2;
/// Bins on each side of a line that tell its amplitude over time.
const ENVELOPE: usize = 4;
/// Bins on each side of a group from which the gain of each excitation is estimated at least: eight that count under the window for two numbers.
const BINS_PER_GAIN: usize = 8;
/// Part of the power of an excitation around a group from which a bin counts nevertheless: at the edge of its band one line is all there is.
const DECISIVE: f64 = 0.3;
/// Power of a bin of an excitation over its mean that is rounding, of a log of five digits.
const ROUNDING: f64 = 1e-10;
/// Power of an excitation over its largest around a group from which a bin counts: beside the band of an excitation there is noise alone.
const LEAST_POWER: f64 = 1e-4;
/// Power of a line over what the excitation explains of its bin at least: where a response has a resonance its gain is known to 10 %.
const BENT: f64 = 0.01;
/// A group has a sixth of the bins below it, and at least so many: responses of machines change with powers of frequency.
const BINS_PER_GROUP: usize = 6;
const LEAST_GROUP: usize = 4;
/// Power over the median from which a bin does not count in the gain, with the two on each side into which a line leaks: noise exceeds it in one of
/// 500. Lines that are left out at most.
const OUTLYING: f64 = 9.0;
const MOST_OUTLYING: usize = 3;

struct Spectrum {
    bins: Vec<c64>,
    power: Vec<f64>,
    /// What other signals explain of each bin; empty where none are known.
    explained: Vec<f64>,
    side: usize,
    samples: usize,
    periodic: bool,
    /// Mean of the power of all bins.
    mean_power: f64,
}

impl Spectrum {
    /// `None` for constant or short signals.
    fn new(values: ColRef<'_, f64>) -> Option<Self> {
        let n = values.nrows();
        let side = (n / 400).clamp(SIDE[0], SIDE[1]);
        let mean = values.iter().sum::<f64>() / n.max(1) as f64;
        if n < 16 * SIDE[0] || values.iter().all(|v| *v == values[0]) {
            return None;
        }
        let window = |k: usize| 0.5 - 0.5 * (TAU * k as f64 / n as f64).cos();
        let mut bins: Vec<c64> =
            values.iter().enumerate().map(|(k, v)| c64::new((v - mean) * window(k), 0.0)).collect();
        FftPlanner::new().plan_fft_forward(n).process(&mut bins);
        bins.truncate(n / 2);
        let power: Vec<f64> = bins.iter().map(c64::norm_sqr).collect();
        let mean_power = power.iter().sum::<f64>() / power.len() as f64;
        let mut spectrum =
            Spectrum { bins, power, explained: Vec::new(), side, samples: n, periodic: false, mean_power };
        let many = spectrum.lines(spectrum.threshold(1e-3)).len() as f64;
        spectrum.periodic = many > PERIODIC * spectrum.power.len() as f64;
        Some(spectrum)
    }

    /// The lines that none of the known signals has.
    fn beside(mut self, known: &[Spectrum], time: Discrete, false_alarm: f64) -> Vec<SpectralLine> {
        self.leave_out(known);
        let threshold = self.threshold(false_alarm);
        let has =
            |other: &Spectrum, k: usize| other.periodic || (k - 1..=k + 1).any(|i| other.ratio(i) > SHARED * threshold);
        let own = |k: &usize| self.lasts(*k) && !known.iter().any(|other| has(other, *k));
        let bin = 1.0 / (self.samples as f64 * time.ts());
        let line = |k: usize| SpectralLine {
            hz: self.between(k) * bin,
            amplitude: self.amplitude(k),
            ratio: self.ratio(k),
            threshold,
            multiple: None,
        };
        let mut found: Vec<SpectralLine> = self.lines(threshold).into_iter().filter(own).map(line).collect();
        if let Some(first) = found.first().map(|line| line.hz) {
            for line in &mut found {
                let multiple = (line.hz / first).round();
                let apart = (line.hz - multiple * first).abs();
                line.multiple = (apart < (1.0 + multiple) * bin).then_some(multiple as usize);
            }
        }
        found
    }

    /// Leaves out what other signals explain, by a gain that changes linearly over the bins around each group of neighbouring ones.
    fn leave_out(&mut self, known: &[Spectrum]) {
        if known.is_empty() {
            return;
        }
        let last = self.bins.len();
        let (mut left, mut from) = (Vec::with_capacity(last), 0);
        while from < last {
            let width = (from / BINS_PER_GROUP).clamp(LEAST_GROUP, self.side);
            let around = (width / 2).max(BINS_PER_GAIN * known.len());
            let end = (from + width).min(last);
            let gains = Gains::new(&self.bins, known, from.saturating_sub(around).max(1)..(end + around).min(last));
            left.extend((from..end).map(|k| gains.left(&self.bins, known, k)));
            from = end;
        }
        self.explained = self.bins.iter().zip(&left).map(|(all, left)| (all - left).norm_sqr()).collect();
        self.power = left.iter().map(c64::norm_sqr).collect();
        self.bins = left;
    }

    /// Whether the amplitude of a line is about the same at a quarter, half and three quarters of the record, where the window has 1/2, 1 and 1/2.
    fn lasts(&self, k: usize) -> bool {
        let amplitude = |share: f64, window: f64| {
            let turned = |i: usize| self.bins[i] * c64::cis(TAU * share * (i as f64 - k as f64));
            (k - ENVELOPE..=k + ENVELOPE).map(turned).fold(c64::ZERO, |sum, z| sum + z).norm() / window
        };
        let all = [(0.25, 0.5), (0.5, 1.0), (0.75, 0.5)].map(|(share, window)| amplitude(share, window));
        let (least, most) = all.iter().fold((f64::MAX, 0.0f64), |(least, most), a| (least.min(*a), most.max(*a)));
        least > LASTS * most
    }

    /// Hann bins are correlated with their neighbours and a median wastes half of them: a quarter of the bins counts.
    fn threshold(&self, false_alarm: f64) -> f64 {
        let nu = 0.5 * (self.side as f64 - 2.0);
        nu * ((self.power.len() as f64 / false_alarm).powf(1.0 / nu) - 1.0)
    }

    /// Median of the neighbours, as the mean of exponential variables; `None` at the upper end, where there are too few, and of the first bins, in
    /// which a drift is.
    fn floor(&self, k: usize) -> Option<f64> {
        let (side, last) = (self.side, self.power.len());
        if k < FIRST || k + side + 2 >= last {
            return None;
        }
        let near = [&self.power[k.saturating_sub(side).max(1)..k - 2], &self.power[k + 3..=k + side]].concat();
        Some(median(near) / std::f64::consts::LN_2)
    }

    fn ratio(&self, k: usize) -> f64 {
        match self.floor(k) {
            Some(floor) if floor > 0.0 => self.power[k] / floor,
            Some(_) if self.power[k] > 0.0 => f64::INFINITY,
            _ => 0.0,
        }
    }

    /// Mean of the bins next to those that a line leaks into, which a resonance lifts.
    fn near(&self, k: usize) -> f64 {
        let sum: f64 = (3..=6).map(|i| self.power[k - i] + self.power[k + i]).sum();
        sum / 8.0
    }

    /// Local maxima above the threshold that fall off as a line does.
    fn lines(&self, threshold: f64) -> Vec<usize> {
        let p = &self.power;
        (6..p.len().saturating_sub(6))
            .filter(|k| p[*k] >= p[k - 1] && p[*k] > p[k + 1] && p[k - 2].max(p[k + 2]) < FALL * p[*k])
            .filter(|k| p[*k] > NEAR * self.near(*k) && self.ratio(*k) > threshold)
            .filter(|k| p[*k] > BENT * self.explained.get(*k).copied().unwrap_or(0.0))
            .collect()
    }

    /// Bin of the line between bins: with the Hann window the amplitudes a and b of the largest bin and its larger neighbour
    /// put it at `(2 b - a) / (a + b)` towards the neighbour (Harris).
    fn between(&self, k: usize) -> f64 {
        let (before, after) = (self.power[k - 1].sqrt(), self.power[k + 1].sqrt());
        let a = self.power[k].sqrt();
        let (b, side) = if after >= before { (after, 1.0) } else { (before, -1.0) };
        k as f64 + side * ((2.0 * b - a) / (a + b)).clamp(0.0, 0.5)
    }

    /// From the energy of the three bins of the main lobe: `sum |w|^2 = 3 N / 8` over all.
    fn amplitude(&self, k: usize) -> f64 {
        let n = self.samples as f64;
        let energy: f64 = (k - 2..=k + 2).map(|i| self.power[i]).sum();
        (4.0 * energy / (n * 0.375 * n)).sqrt()
    }
}

/// Gains of other signals over some bins, each with its slope.
struct Gains {
    values: Vec<c64>,
    middle: f64,
    half: f64,
}

impl Gains {
    /// By least squares, without the bins of lines, which would bend them: those that they leave far above the median.
    fn new(bins: &[c64], known: &[Spectrum], around: Range<usize>) -> Self {
        let (middle, half) = (0.5 * (around.start + around.end) as f64, 0.5 * around.len().max(1) as f64);
        let most = |x: &Spectrum| x.power[around.clone()].iter().copied().fold(0.0, f64::max);
        let largest: Vec<f64> = known.iter().map(most).collect();
        let moved = |k: &usize| known.iter().zip(&largest).any(|(x, most)| x.power[*k] > LEAST_POWER * most);
        let mut kept: Vec<usize> = around.clone().filter(moved).collect();
        let mut gains = Gains { values: Vec::new(), middle, half }.fitted(bins, known, &kept);
        for _ in 0..MOST_OUTLYING {
            let power: Vec<f64> = kept.iter().map(|k| gains.left(bins, known, *k).norm_sqr()).collect();
            let total: Vec<f64> = known.iter().map(|x| kept.iter().map(|k| x.power[*k]).sum()).collect();
            let decides = |k: usize| known.iter().zip(&total).any(|(x, total)| x.power[k] > DECISIVE * total);
            let largest = kept.iter().zip(&power).filter(|(k, _)| !decides(**k)).max_by(|a, b| a.1.total_cmp(b.1));
            let Some((line, largest)) = largest.map(|(k, power)| (*k, *power)) else { break };
            if largest <= OUTLYING * median(power) {
                break;
            }
            kept.retain(|k| k.abs_diff(line) > 2);
            gains = gains.fitted(bins, known, &kept);
        }
        gains
    }

    fn fitted(&self, bins: &[c64], known: &[Spectrum], kept: &[usize]) -> Self {
        // One more row for each column, of rounding, keeps the gain of a signal without power at zero.
        let (rows, columns) = (kept.len(), 2 * known.len());
        let little: Vec<f64> = known.iter().map(|x| (ROUNDING * x.mean_power).max(TINY).sqrt()).collect();
        let x = Mat::from_fn(rows + columns, columns, |r, c| match kept.get(r) {
            Some(k) => self.column(known, *k, c),
            None if r - rows == c => c64::new(little[c / 2], 0.0),
            None => c64::ZERO,
        });
        let y = Mat::from_fn(rows + columns, 1, |r, _| kept.get(r).map_or(c64::ZERO, |k| bins[*k]));
        Gains { values: x.qr().solve_lstsq(y).col(0).iter().copied().collect(), ..*self }
    }

    fn column(&self, known: &[Spectrum], k: usize, column: usize) -> c64 {
        let slope = if column.is_multiple_of(2) { 1.0 } else { (k as f64 - self.middle) / self.half };
        known[column / 2].bins[k] * slope
    }

    /// What they leave of a bin.
    fn left(&self, bins: &[c64], known: &[Spectrum], k: usize) -> c64 {
        self.values.iter().enumerate().fold(bins[k], |left, (c, gain)| left - self.column(known, k, c) * *gain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// The lines of a signal beside none or one.
    fn lines_of(values: &[f64], known: Option<&[f64]>) -> Vec<SpectralLine> {
        let column = |x: &[f64]| Mat::from_fn(x.len(), 1, |k, _| x[k]);
        let known = known.map(column);
        let known: Vec<MatRef<'_, f64>> = known.iter().map(Mat::as_ref).collect();
        spectral_lines(&[column(values).as_ref()], &known, Discrete::new(1e-3).unwrap(), 1e-3).remove(0)
    }

    /// Noise through a resonance of 0.5 % damping has no line in 200 records (at most one by the stated probability of 1e-3
    /// each); a line at a tenth of the deviation is found in all, its double with the relation in nearly all.
    #[test]
    fn a_resonance_is_no_line() {
        let (mut false_alarms, mut both) = (0, 0);
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let (radius, angle) = (0.997f64, 0.6f64);
            let mut y = vec![0.0, 0.0];
            for k in 2..6000 {
                let noise: f64 = rng.sample(StandardNormal);
                y.push(2.0 * radius * angle.cos() * y[k - 1] - radius * radius * y[k - 2] + noise);
            }
            false_alarms += lines_of(&y, None).len();
            let line =
                |k: usize| 5.0 * (TAU * 41.67 * k as f64 * 1e-3).sin() + 5.0 * (TAU * 83.34 * k as f64 * 1e-3).cos();
            let disturbed: Vec<f64> = y.iter().enumerate().map(|(k, y)| y + line(k)).collect();
            let found = lines_of(&disturbed, None);
            assert!(
                (found[0].hz - 41.67).abs() < 0.02 && (found[0].amplitude - 5.0).abs() < 0.6,
                "seed {seed}: {found:?}"
            );
            both += usize::from(found.iter().any(|l| (l.hz - 83.34).abs() < 0.02 && l.multiple == Some(2)));
        }
        // The second line is on the flank of the resonance.
        assert!(both >= 190, "{both}");
        assert!(false_alarms <= 1, "{false_alarms}");
    }

    /// A line 20 dB below the response of a resonance to noise is found beside the noise where the excitation is known, in 100 of 100 records, and not without
    /// it; in the response alone there is none.
    #[test]
    fn a_line_below_the_response_to_the_excitation_is_found() {
        let mut false_alarms = 0;
        for seed in 0..100 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut normal = || rng.sample::<f64, _>(StandardNormal);
            let x: Vec<f64> = (0..6000).map(|_| normal()).collect();
            let (radius, angle) = (0.98f64, 0.6f64);
            let mut response = vec![0.0, 0.0];
            for k in 2..6000 {
                response.push(2.0 * radius * angle.cos() * response[k - 1] - radius * radius * response[k - 2] + x[k]);
            }
            let y: Vec<f64> = response.iter().map(|y| y + 0.1 * normal()).collect();
            false_alarms += lines_of(&y, Some(&x)).len();
            let line = |k: usize| 0.1 * (TAU * 40.0 * k as f64 * 1e-3).sin();
            let disturbed: Vec<f64> = y.iter().enumerate().map(|(k, y)| y + line(k)).collect();
            assert!(lines_of(&disturbed, None).is_empty(), "seed {seed}");
            let found = lines_of(&disturbed, Some(&x));
            assert!(found.iter().any(|l| (l.hz - 40.0).abs() < 0.03), "seed {seed}: {found:?}");
        }
        assert!(false_alarms <= 1, "{false_alarms}");
    }
}
