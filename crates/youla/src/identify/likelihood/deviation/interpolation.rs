//! What the interpolation of an output costs: the error of its response where the samples come from a clock of their own.
//!
//! An output behind a hold has, beside the line at frequency f, images at n fs +- f, whose size against the line is
//! ```text
//! a_n = (f / (n fs +- f))^2,                   fs: rate of the controller
//! ```
//! one power of the hold (Astrom and Wittenmark, Computer-Controlled Systems, section 7.4), one of a plant that moves no output at once. Sampled with
//! the controller, they are the line; interpolated, each is changed by the gain h of the interpolation at its own frequency, so that the relative error is
//! ```text
//! |h(f) - 1| + sum_n a_n |h(n fs +- f) - 1|
//! ```
//! with root mean squares over the place of an instant between two samples.

use crate::c64;
use std::f64::consts::TAU;

/// Samples of the polynomial that interpolates, four on each side.
pub const INTERPOLATION_POINTS: usize = 8;
/// Images on each side: the first one weighs fifty times as much as the last.
const IMAGES: usize = 8;
/// Places of an instant between two samples.
const PLACES: usize = 8;

/// An output that was interpolated between samples of a clock of its own.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Interpolated {
    output: usize,
    /// Samples in each cycle of the controller.
    rate: f64,
    /// Share of the rate of the controller above which the error is more than half of the response.
    reach: f64,
}

impl Interpolated {
    pub(crate) fn new(output: usize, rate: f64) -> Self {
        let (mut low, mut high) = (0.0, 0.5);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            *if relative_error(middle, rate) > 0.5 { &mut high } else { &mut low } = middle;
        }
        Interpolated { output, rate, reach: high }
    }

    /// Whether it is that of a plant with so many outputs.
    #[cfg(feature = "serde")]
    pub(crate) fn is_of(&self, outputs: usize) -> bool {
        self.output < outputs && self.rate > 0.0 && self.rate.is_finite() && self.reach > 0.0 && self.reach <= 0.5
    }

    /// Adds the squares of the error at a share of the rate of the controller to those of the entries of a plant with so many inputs and this response.
    /// Beyond its reach the interpolation takes the response away; what was there is at most what falls from the reach on by the square of
    /// the frequency.
    pub(crate) fn add(&self, share: f64, squares: &mut [f64], inputs: usize, response: &dyn Fn(f64) -> Vec<c64>) {
        let (here, relative) = (response(share), relative_error(share, self.rate));
        let beyond = (share > self.reach).then(|| response(self.reach));
        let fall = (self.reach / share.max(self.reach)).powi(2);
        for entry in self.output * inputs..(self.output + 1) * inputs {
            let there = beyond.as_ref().map_or(0.0, |g| fall * g[entry].norm());
            squares[entry] += (relative * here[entry].norm()).max(there).powi(2);
        }
    }
}

/// Relative error of a response at `share` of the rate of the controller, of an output with `rate` samples in each cycle.
fn relative_error(share: f64, rate: f64) -> f64 {
    let image = |n: usize| {
        let n = n as f64;
        [n - share, n + share].into_iter().map(|f| (share / f).powi(2) * distance(f / rate)).sum::<f64>()
    };
    distance(share / rate) + (1..=IMAGES).map(image).sum::<f64>()
}

/// Root mean square of `h - 1`, the gain of the interpolation at a share of the rate of the samples less one.
fn distance(share: f64) -> f64 {
    let first = -(INTERPOLATION_POINTS as f64) / 2.0 + 1.0;
    let squares = (0..PLACES).map(|k| {
        let place = (k as f64 + 0.5) / PLACES as f64;
        let at = |i: usize| first + i as f64 - place;
        let weight = |i: usize| {
            let others = (0..INTERPOLATION_POINTS).filter(|j| *j != i);
            others.map(|j| at(j) / (at(j) - at(i))).product::<f64>()
        };
        let gain: c64 = (0..INTERPOLATION_POINTS).map(|i| c64::cis(TAU * share * at(i)) * weight(i)).sum();
        (gain - 1.0).norm_sqr()
    });
    (squares.sum::<f64>() / PLACES as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of exact gains in the middle between two samples: (1225 cos x - 245 cos 3x + 49 cos 5x - 5 cos 7x) / 1024, x = pi f / rate.
    #[test]
    fn the_gain_is_that_of_the_polynomial() {
        let middle = |share: f64| {
            let x = 0.5 * TAU * share;
            (1225.0 * x.cos() - 245.0 * (3.0 * x).cos() + 49.0 * (5.0 * x).cos() - 5.0 * (7.0 * x).cos()) / 1024.0 - 1.0
        };
        for share in [0.05, 0.1, 0.2, 0.3] {
            let (found, largest) = (distance(share), middle(share).abs());
            assert!(found < largest && found > 0.3 * largest, "{share}: {found} {largest}");
        }
        // Ten samples in a cycle cost little: a slope that changes with the input is not met. One in a cycle costs a sixth of the response at a
        // third of the rate.
        assert!(relative_error(0.25, 10.0) < 0.02 && relative_error(0.01, 1.0) < 1e-3);
        assert!(relative_error(0.33, 1.0) > 0.15 && relative_error(0.49, 1.0) > 1.0);
    }
}
