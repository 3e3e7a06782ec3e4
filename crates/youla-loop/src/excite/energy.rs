//! Energy of a sequence over frequency: `E(f1, f2)`, the integral of `|alpha(f)|^2` of the whole finite sequence, its ends included.

use rustfft::FftPlanner;
use youla::lti::Discrete;
use youla::{MatRef, c64};

/// Energy density of one channel at the frequencies `k / length / ts`, in (unit s)^2 times a common factor.
pub(super) struct Energy {
    /// From 0 to half the sample rate.
    pub(super) density: Vec<f64>,
    /// Distance of neighbours, Hz.
    pub(super) step: f64,
}

impl Energy {
    /// Padded to at least twice the length: the samples of the density then hold all of it.
    pub(super) fn of(signal: MatRef<'_, f64>, j: usize, time: Discrete) -> Self {
        let length = (2 * signal.nrows()).next_power_of_two();
        let density = transform(signal, j, length)[..=length / 2].iter().map(|x| x.norm_sqr()).collect();
        Energy { density, step: 1.0 / (length as f64 * time.ts()) }
    }

    fn within(&self, [low, high]: [f64; 2]) -> &[f64] {
        let last = self.density.len() - 1;
        let first = ((low.max(0.0) / self.step).ceil() as usize).min(last);
        let end = (high.max(0.0) / self.step).floor() as usize;
        &self.density[first..(end.min(last) + 1).max(first)]
    }

    /// Part of all energy that lies in a band; 0 for a channel without any.
    pub(super) fn share(&self, band: [f64; 2]) -> f64 {
        let all: f64 = self.density.iter().sum();
        let part: f64 = self.within(band).iter().sum();
        if all > 0.0 { part / all } else { 0.0 }
    }

    /// Mean density in a band.
    pub(super) fn mean(&self, band: [f64; 2]) -> f64 {
        let values = self.within(band);
        values.iter().sum::<f64>() / values.len().max(1) as f64
    }

    /// Mean density in a band over that in another, dB; minus infinity where there is none.
    pub(super) fn decibels(&self, band: [f64; 2], over: [f64; 2]) -> f64 {
        10.0 * (self.mean(band) / self.mean(over)).log10()
    }
}

/// The Fourier transform of one channel, with zeros up to `length`.
pub(super) fn transform(signal: MatRef<'_, f64>, j: usize, length: usize) -> Vec<c64> {
    let mut buffer = vec![c64::new(0.0, 0.0); length];
    buffer.iter_mut().zip(signal.col(j).iter()).for_each(|(to, x)| to.re = *x);
    FftPlanner::new().plan_fft_forward(length).process(&mut buffer);
    buffer
}
