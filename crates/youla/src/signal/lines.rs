//! Narrow lines in a signal that no excitation has: unbalance, run-out, gears, mains.
//!
//! A line of the Hann-windowed periodogram is compared with the median of its neighbours, without the two on either side that it
//! leaks into. Over noise the ratio to the mean of the neighbours has, with nu of them independent, the tail
//! `(1 + x / nu)^-nu`, from which the threshold for the given probability in N / 2 lines follows. Resonances are wider than a line
//! and lift their neighbours; a line must also stand out from the eight nearest of them and fall off by a factor five within two bins, as the window makes it. Lines that
//! the excitation has too are not disturbances.
//!
//! Source: for the window F. J. Harris, Proc. IEEE 66 (1978), 51; for the test R. A. Fisher, Proc. R. Soc. A 125 (1929), 54.

use crate::lti::Discrete;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

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
/// Lines of an excitation from which it is periodic, as a share of the bins: its lines are everywhere.
/// Chosen, not measured.
const PERIODIC: f64 = 0.02;

/// The lines of `values` that none of the `known` signals has; `false_alarm` is the probability that a record of noise has one.
///
/// ```
/// use youla::{lti::Discrete, signal::spectral_lines};
/// let noise = |k: usize| ((k * k * 31 + 7 * k) % 8191) as f64 / 8191.0 - 0.5;
/// let y: Vec<f64> = (0..4000).map(|k| noise(k) + 0.2 * (k as f64 * 0.5).sin()).collect();
/// let found = spectral_lines(&y, &[], Discrete::new(0.01)?, 1e-3);
/// assert_eq!(found.len(), 1);
/// assert!((found[0].hz - 7.958).abs() < 0.01 && (found[0].amplitude - 0.2).abs() < 0.02);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn spectral_lines(values: &[f64], known: &[&[f64]], time: Discrete, false_alarm: f64) -> Vec<SpectralLine> {
    let n = values.len();
    let Some(spectrum) = Spectrum::new(values) else { return Vec::new() };
    let threshold = spectrum.threshold(false_alarm);
    let candidates = spectrum.lines(threshold);
    if candidates.is_empty() {
        return Vec::new();
    }
    let known: Vec<Spectrum> = known.iter().filter_map(|k| Spectrum::new(k)).collect();
    let mut found: Vec<SpectralLine> = Vec::new();
    for k in candidates {
        let shared = |other: &Spectrum| (k - 1..=k + 1).any(|i| other.ratio(i) > SHARED * threshold) || other.periodic;
        if known.iter().any(shared) {
            continue;
        }
        let hz = spectrum.between(k) / (n as f64 * time.ts());
        let amplitude = spectrum.amplitude(k);
        if !lasts(values, spectrum.between(k) / n as f64) {
            continue;
        }
        found.push(SpectralLine { hz, amplitude, ratio: spectrum.ratio(k), threshold, multiple: None });
    }
    let bin = 1.0 / (n as f64 * time.ts());
    if let Some(first) = found.first().map(|line| line.hz) {
        for line in &mut found {
            let multiple = (line.hz / first).round();
            line.multiple = ((line.hz - multiple * first).abs() < (1.0 + multiple) * bin).then_some(multiple as usize);
        }
    }
    found
}

/// Least share of the largest amplitude among the quarters of a record that a line keeps in each.
/// A resonance that a chirp passes decays to nothing. Chosen, not measured.
const LASTS: f64 = 0.2;

/// Whether the amplitude at a frequency, in turns per sample, is about the same in all quarters of a record.
fn lasts(values: &[f64], turns: f64) -> bool {
    let length = values.len() / 4;
    let amplitude = |part: &[f64]| {
        let window = |k: usize| 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos();
        let mean = part.iter().sum::<f64>() / length as f64;
        let turn = |k: usize| Complex::from_polar(window(k), TAU * turns * k as f64);
        part.iter().enumerate().map(|(k, v)| turn(k) * (v - mean)).sum::<Complex<f64>>().norm()
    };
    let all: Vec<f64> = values.chunks_exact(length).take(4).map(amplitude).collect();
    let (least, most) = all.iter().fold((f64::MAX, 0.0f64), |(least, most), a| (least.min(*a), most.max(*a)));
    least > LASTS * most
}

struct Spectrum {
    power: Vec<f64>,
    side: usize,
    samples: usize,
    periodic: bool,
}

impl Spectrum {
    /// `None` for constant or short signals.
    fn new(values: &[f64]) -> Option<Self> {
        let n = values.len();
        let side = (n / 400).clamp(SIDE[0], SIDE[1]);
        let mean = values.iter().sum::<f64>() / n.max(1) as f64;
        if n < 16 * SIDE[0] || values.iter().all(|v| *v == values[0]) {
            return None;
        }
        let window = |k: usize| 0.5 - 0.5 * (TAU * k as f64 / n as f64).cos();
        let mut buffer: Vec<Complex<f64>> =
            values.iter().enumerate().map(|(k, v)| Complex::new((v - mean) * window(k), 0.0)).collect();
        FftPlanner::new().plan_fft_forward(n).process(&mut buffer);
        let power: Vec<f64> = buffer[..n / 2].iter().map(|z| z.norm_sqr()).collect();
        let mut spectrum = Spectrum { power, side, samples: n, periodic: false };
        let many = spectrum.lines(spectrum.threshold(1e-3)).len() as f64;
        spectrum.periodic = many > PERIODIC * spectrum.power.len() as f64;
        Some(spectrum)
    }

    /// Hann bins are correlated with their neighbours and a median wastes half of them: a quarter of the bins counts.
    fn threshold(&self, false_alarm: f64) -> f64 {
        let nu = 0.5 * (self.side as f64 - 2.0);
        nu * ((self.power.len() as f64 / false_alarm).powf(1.0 / nu) - 1.0)
    }

    /// Median of the neighbours, as the mean of exponential variables; `None` at the ends, where there are too few.
    fn floor(&self, k: usize) -> Option<f64> {
        let (side, last) = (self.side, self.power.len());
        if k < side + 2 || k + side + 2 >= last {
            return None;
        }
        let mut near = [&self.power[k - side..k - 2], &self.power[k + 3..=k + side]].concat();
        let middle = near.len() / 2;
        Some(*near.select_nth_unstable_by(middle, f64::total_cmp).1 / std::f64::consts::LN_2)
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Noise through a resonance of 0.5 % damping has no line in 200 records (at most one by the stated probability of 1e-3
    /// each); a line at a tenth of the deviation is found in all, its double with the relation in nearly all.
    #[test]
    fn a_resonance_is_no_line() {
        let time = Discrete::new(1e-3).unwrap();
        let (mut false_alarms, mut both) = (0, 0);
        for seed in 0..200 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let (radius, angle) = (0.997f64, 0.6f64);
            let mut y = vec![0.0, 0.0];
            for k in 2..6000 {
                let noise: f64 = rng.sample(StandardNormal);
                y.push(2.0 * radius * angle.cos() * y[k - 1] - radius * radius * y[k - 2] + noise);
            }
            false_alarms += spectral_lines(&y, &[], time, 1e-3).len();
            let line =
                |k: usize| 5.0 * (TAU * 41.67 * k as f64 * 1e-3).sin() + 5.0 * (TAU * 83.34 * k as f64 * 1e-3).cos();
            let disturbed: Vec<f64> = y.iter().enumerate().map(|(k, y)| y + line(k)).collect();
            let found = spectral_lines(&disturbed, &[], time, 1e-3);
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
}
