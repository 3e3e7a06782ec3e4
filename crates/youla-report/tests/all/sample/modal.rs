//! Plants as sums of modes.

use faer::c64;
use std::f64::consts::TAU;

/// A plant as a sum of modes `gain * w^2 / (s^2 + 2 zeta w s + w^2)`.
#[derive(Clone)]
pub(super) struct Modal {
    pub(super) modes: Vec<(f64, f64, Vec<Vec<f64>>)>,
}

impl Modal {
    pub(super) fn with(&self, frequency: f64, damping: f64, gain: f64) -> Self {
        let changed = |gains: &Vec<Vec<f64>>| gains.iter().map(|row| row.iter().map(|g| g * gain).collect()).collect();
        Modal { modes: self.modes.iter().map(|(hz, zeta, g)| (hz * frequency, zeta * damping, changed(g))).collect() }
    }

    pub(super) fn pole(hz: f64, zeta: f64, ts: f64) -> c64 {
        let w = TAU * hz * ts;
        c64::from_polar((-zeta * w).exp(), w * (1.0 - zeta * zeta).sqrt())
    }

    pub(super) fn response(&self, hz: f64, output: usize, input: usize) -> c64 {
        let term = |(f, zeta, gain): &(f64, f64, Vec<Vec<f64>>)| {
            let ratio = hz / f;
            c64::new(gain[output][input], 0.0) / c64::new(1.0 - ratio * ratio, 2.0 * zeta * ratio)
        };
        self.modes.iter().map(term).fold(c64::new(0.0, 0.0), |sum, t| sum + t)
    }

    pub(super) fn simulate(&self, u: &[Vec<f64>], output: usize, ts: f64) -> Vec<f64> {
        let samples = u[0].len();
        let mut y = vec![0.0; samples];
        for (hz, zeta, gain) in &self.modes {
            let z = Self::pole(*hz, *zeta, ts);
            let (a1, a2) = (2.0 * z.re, z.re * z.re + z.im * z.im);
            let (mut x1, mut x2) = (0.0, 0.0);
            for k in 0..samples {
                y[k] += x1;
                let drive: f64 = u.iter().zip(&gain[output]).map(|(u, g)| u[k] * g).sum();
                let next = a1 * x1 - a2 * x2 + (1.0 - a1 + a2) * drive;
                (x2, x1) = (x1, next);
            }
        }
        y
    }
}
