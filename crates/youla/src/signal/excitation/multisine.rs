//! Sums of sines of equal amplitude with the phases of Schroeder, whose crest is low.
//!
//! `u(k) = sum over lines l of cos(2 pi l k / period + phi_l)`, `phi_l = -pi i (i - 1) / I` for the i-th of I lines. The
//! channels have lines of their own in turn, so they are orthogonal over a period.
//!
//! Source: M. R. Schroeder, Synthesis of low-peak-factor signals and binary sequences with low autocorrelation, IEEE
//! Trans. Inf. Theory 16 (1970), 85.

use super::{check, check_amplitude, check_frequency};
use crate::Result;
use crate::lti::Discrete;
use faer::{Mat, c64};
use rand::{Rng, RngExt};
use rustfft::FftPlanner;
use std::f64::consts::{PI, TAU};

/// A periodic signal with a flat line spectrum within a band.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Multisine {
    /// Period in samples; the lines are multiples of `2 pi / (period ts)` rad/s.
    pub period: usize,
    /// Lowest angular frequency, rad/s; the line zero is never used.
    pub omega_min: f64,
    /// Highest angular frequency, rad/s; up to below the Nyquist frequency where nothing is stated.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub omega_max: Option<f64>,
    /// Bands without lines, lowest and highest angular frequency each, rad/s; empty for none.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Vec::is_empty"))]
    pub omitted: Vec<[f64; 2]>,
    /// Greatest absolute value.
    pub amplitude: f64,
}

impl Default for Multisine {
    fn default() -> Self {
        Multisine { period: 4096, omega_min: 0.0, omega_max: None, omitted: Vec::new(), amplitude: 1.0 }
    }
}

impl Multisine {
    /// Each channel starts at a random point of its period.
    pub(super) fn generate(
        &self,
        samples: usize,
        channels: usize,
        time: Discrete,
        rng: &mut impl Rng,
    ) -> Result<Mat<f64>> {
        const LONGEST: usize = 1 << 24;
        let fits = (2..=LONGEST).contains(&self.period);
        check("the period of a multisine", self.period as f64, fits, "from 2 to 2^24 samples")?;
        check_amplitude(self.amplitude)?;
        let lines = self.lines(channels, time)?;
        let mut out = Mat::zeros(samples, channels);
        for j in 0..channels {
            let own: Vec<usize> = lines.iter().copied().skip(j).step_by(channels).collect();
            let period = self.period(&own);
            let start = rng.random_range(0..self.period);
            let column = out.col_mut(j).iter_mut().enumerate();
            column.for_each(|(k, value)| *value = period[(k + start) % self.period]);
        }
        Ok(out)
    }

    fn lines(&self, channels: usize, time: Discrete) -> Result<Vec<usize>> {
        check_frequency("the lowest frequency of a multisine", self.omega_min, time)?;
        if let Some(omega) = self.omega_max {
            check_frequency("the highest frequency of a multisine", omega, time)?;
        }
        let step = TAU / (self.period as f64 * time.ts());
        let highest = self.omega_max.unwrap_or(f64::INFINITY);
        let omitted = |omega: f64| self.omitted.iter().any(|[low, high]| (*low..=*high).contains(&omega));
        let in_band = |line: &usize| {
            let omega = *line as f64 * step;
            (self.omega_min..=highest).contains(&omega) && !omitted(omega)
        };
        let lines: Vec<usize> = (1..self.period.div_ceil(2)).filter(in_band).collect();
        let what = "the number of lines of a multisine between its lowest and highest frequency";
        check(what, lines.len() as f64, lines.len() >= channels, "at least one for each channel; lengthen the period")?;
        Ok(lines)
    }

    /// One period, scaled to the amplitude.
    fn period(&self, lines: &[usize]) -> Vec<f64> {
        let mut spectrum = vec![c64::new(0.0, 0.0); self.period];
        for (i, &line) in lines.iter().enumerate() {
            let phase = -PI * (i as f64) * (i as f64 + 1.0) / lines.len() as f64;
            spectrum[line] = c64::from_polar(1.0, phase);
        }
        FftPlanner::new().plan_fft_inverse(self.period).process(&mut spectrum);
        let peak = spectrum.iter().map(|x| x.re.abs()).fold(0.0, f64::max);
        spectrum.iter().map(|x| x.re * (self.amplitude / peak)).collect()
    }
}
