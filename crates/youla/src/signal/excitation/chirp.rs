//! A sine whose frequency changes linearly with time.
//!
//! `u(t) = A sin(omega_start t + (omega_end - omega_start) t^2 / (2 T))`. The channels follow each other: each sweeps
//! within its own part T of the record while the others are zero.

use super::{check_amplitude, check_frequency};
use crate::Result;
use crate::lti::Discrete;
use faer::Mat;

/// A sweep from one frequency to another.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Chirp {
    /// Angular frequency at the start, rad/s.
    pub omega_start: f64,
    /// Angular frequency at the end, rad/s.
    pub omega_end: f64,
    /// Amplitude.
    pub amplitude: f64,
}

impl Chirp {
    pub(super) fn generate(&self, samples: usize, channels: usize, time: Discrete) -> Result<Mat<f64>> {
        check_frequency("the first frequency of a chirp", self.omega_start, time)?;
        check_frequency("the last frequency of a chirp", self.omega_end, time)?;
        check_amplitude(self.amplitude)?;
        let part = samples.div_ceil(channels.max(1));
        let rate = (self.omega_end - self.omega_start) / (part as f64 * time.ts());
        let sweep = |k: usize| {
            let t = k as f64 * time.ts();
            self.amplitude * (self.omega_start * t + rate * t * t / 2.0).sin()
        };
        Ok(Mat::from_fn(samples, channels, |k, j| if k / part == j { sweep(k % part) } else { 0.0 }))
    }
}
