//! Fading an excitation in and out, so that a machine is neither hit at the start nor let go at the end.
//!
//! `w(k) = min(1, k ts / ramp, (N - 1 - k) ts / ramp)` for the samples 0 to N - 1: exactly 0 on the first and on the last
//! sample, exactly 1 from `ramp` after the first to `ramp` before the last.

use super::{Excitation, check};
use crate::Result;
use crate::lti::Discrete;
use faer::Mat;
use rand::Rng;

/// An excitation with a ramp. In a file the ramp stands beside the options of the excitation.
///
/// A faded signal is not periodic: what holds for the lines of a multisine or a PRBS holds between the ramps.
///
/// ```
/// use rand::SeedableRng;
/// use youla::{lti::Discrete, signal::RampedExcitation};
/// let faded: RampedExcitation = toml::from_str("kind = \"prbs\"\namplitude = 0.5\nramp = 0.1").unwrap();
/// let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
/// let alpha = faded.generate(1001, 1, Discrete::new(1e-3)?, &mut rng)?;
/// assert_eq!((alpha[(0, 0)], alpha[(50, 0)].abs(), alpha[(100, 0)].abs()), (0.0, 0.25, 0.5));
/// # Ok::<(), youla::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RampedExcitation {
    /// The signal at its full amplitude.
    #[cfg_attr(feature = "serde", serde(flatten))]
    pub excitation: Excitation,
    /// Time in seconds in which the amplitude grows linearly from 0 at the start, and falls to 0 at the end; 0 for none.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub ramp: f64,
}

impl RampedExcitation {
    /// Makes the signal, as [`Excitation::generate`], and fades it in and out. Without a ramp it is the same signal, bit
    /// by bit.
    ///
    /// # Errors
    /// Those of [`Excitation::generate`]; [`crate::Error::OutOfRange`] for a ramp that is negative or longer than half the
    /// signal.
    pub fn generate(&self, samples: usize, channels: usize, time: Discrete, rng: &mut impl Rng) -> Result<Mat<f64>> {
        let ramp = self.ramp / time.ts();
        // A ramp of half the signal may come out longer by the rounding of the division.
        let fits = self.ramp >= 0.0 && 2.0 * ramp <= samples as f64 * (1.0 + 1e-12);
        let what = format!("the ramp of an excitation of {samples} samples");
        check(&what, self.ramp, fits, "at least 0 and at most half the signal, in seconds")?;
        let mut signal = self.excitation.generate(samples, channels, time, rng)?;
        fade(&mut signal, ramp);
        Ok(signal)
    }
}

/// Every channel times w(k), with the ramp in samples; untouched without one.
pub fn fade(signal: &mut Mat<f64>, ramp: f64) {
    let samples = signal.nrows();
    if ramp > 0.0 {
        for column in signal.col_iter_mut() {
            column.iter_mut().enumerate().for_each(|(k, value)| *value *= weight(k, samples, ramp));
        }
    }
}

/// w(k), with the ramp in samples.
fn weight(k: usize, samples: usize, ramp: f64) -> f64 {
    let to_the_nearer_end = k.min(samples - 1 - k) as f64;
    (to_the_nearer_end / ramp).min(1.0)
}

#[cfg(feature = "serde")]
fn is_zero(ramp: &f64) -> bool {
    *ramp == 0.0
}
