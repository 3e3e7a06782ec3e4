//! Pseudo-random binary sequences by a linear feedback shift register.
//!
//! With a primitive polynomial of degree n the register runs through all `2^n - 1` states but zero; the sequence then has
//! the autocorrelation `-1 / (2^n - 1)` at every shift but zero.
//!
//! Source: S. W. Golomb, Shift Register Sequences (1967); polynomials: P. Alfke, Efficient shift registers, LFSR counters
//! and long pseudo-random sequence generators, Xilinx application note 052 (1996), table 3.

use super::{check, check_amplitude};
use crate::Result;
use faer::Mat;
use rand::{Rng, RngExt};

/// Sequence of maximal length; the channels are the same sequence, shifted by equal parts of its period.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Prbs {
    /// Length n of the register, 2 to 20; the period is `hold (2^n - 1)` samples.
    pub order: usize,
    /// Samples for which each bit is held.
    pub hold: usize,
    /// The signal is plus or minus this.
    pub amplitude: f64,
}

impl Default for Prbs {
    fn default() -> Self {
        Prbs { order: 12, hold: 4, amplitude: 1.0 }
    }
}

/// Taps of the register by its length, counted from 1.
const TAPS: [&[u32]; 21] = [
    &[],
    &[],
    &[2, 1],
    &[3, 2],
    &[4, 3],
    &[5, 3],
    &[6, 5],
    &[7, 6],
    &[8, 6, 5, 4],
    &[9, 5],
    &[10, 7],
    &[11, 9],
    &[12, 6, 4, 1],
    &[13, 4, 3, 1],
    &[14, 5, 3, 1],
    &[15, 14],
    &[16, 15, 13, 4],
    &[17, 14],
    &[18, 11],
    &[19, 6, 2, 1],
    &[20, 17],
];

impl Prbs {
    pub(super) fn generate(&self, samples: usize, channels: usize, rng: &mut impl Rng) -> Result<Mat<f64>> {
        check("the order of a PRBS", self.order as f64, (2..TAPS.len()).contains(&self.order), "from 2 to 20")?;
        check("the hold of a PRBS", self.hold as f64, self.hold >= 1, "at least 1 sample")?;
        check_amplitude(self.amplitude)?;
        let bits = sequence(self.order);
        let fits = channels <= bits.len();
        check("the number of channels of a PRBS", channels as f64, fits, "at most the period, 2^order - 1")?;
        let start = rng.random_range(0..bits.len());
        Ok(Mat::from_fn(samples, channels, |k, j| {
            let shift = start + j * (bits.len() / channels);
            if bits[(k / self.hold + shift) % bits.len()] { self.amplitude } else { -self.amplitude }
        }))
    }
}

/// One period.
fn sequence(order: usize) -> Vec<bool> {
    let mut state: u32 = 1;
    let step = |_| {
        let feedback = TAPS[order].iter().fold(0, |sum, tap| sum ^ (state >> (tap - 1)));
        state = ((state << 1) | (feedback & 1)) & ((1 << order) - 1);
        state & 1 == 1
    };
    (0..(1_usize << order) - 1).map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The windows of n bits of a maximal sequence are all numbers from 1 to 2^n - 1, each once.
    #[test]
    fn every_polynomial_is_primitive() {
        for order in 2..TAPS.len() {
            let bits = sequence(order);
            let period = bits.len();
            let mut seen = vec![false; period + 1];
            for start in 0..period {
                let window = (0..order).fold(0, |w, i| w << 1 | usize::from(bits[(start + i) % period]));
                assert!(window != 0 && !std::mem::replace(&mut seen[window], true), "order {order}, start {start}");
            }
        }
    }
}
