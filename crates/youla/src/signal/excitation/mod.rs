//! Excitation signals, samples x channels, each channel independent of the others; and what a signal excites.
//!
//! Randomness comes from the generator that is handed in: the same seed gives the same signal.

mod chirp;
mod multisine;
mod prbs;
mod ramp;
mod square;

pub use chirp::Chirp;
pub use multisine::Multisine;
pub use prbs::Prbs;
pub use ramp::RampedExcitation;
pub use ramp::fade;
pub use square::SquareWaves;

use crate::lti::Discrete;
use crate::{Error, Result};
use faer::Mat;
use rand::Rng;
use std::f64::consts::PI;

/// A kind of excitation and its options.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(tag = "kind", rename_all = "kebab-case"))]
pub enum Excitation {
    /// Square waves of random length.
    SquareWaves(SquareWaves),
    /// Pseudo-random binary sequence of maximal length.
    Prbs(Prbs),
    /// Sum of sines with a low crest.
    Multisine(Multisine),
    /// Sine of rising or falling frequency.
    Chirp(Chirp),
}

impl Excitation {
    /// Makes the signal, `samples` x `channels`, with the clock `time`. [`RampedExcitation`] fades it in and out.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] naming the option that has no meaning.
    ///
    /// ```
    /// use rand::SeedableRng;
    /// use youla::{lti::Discrete, signal::{Excitation, Prbs}};
    /// let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    /// let prbs = Excitation::Prbs(Prbs { amplitude: 0.25, ..Prbs::default() });
    /// let alpha = prbs.generate(1000, 2, Discrete::new(2e-4)?, &mut rng)?;
    /// assert!(alpha.col(1).iter().all(|a| a.abs() == 0.25));
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn generate(&self, samples: usize, channels: usize, time: Discrete, rng: &mut impl Rng) -> Result<Mat<f64>> {
        match self {
            Excitation::SquareWaves(options) => options.generate(samples, channels, rng),
            Excitation::Prbs(options) => options.generate(samples, channels, rng),
            Excitation::Multisine(options) => options.generate(samples, channels, time, rng),
            Excitation::Chirp(options) => options.generate(samples, channels, time),
        }
    }
}

fn check_amplitude(amplitude: f64) -> Result<()> {
    check("the amplitude of an excitation", amplitude, amplitude > 0.0 && amplitude.is_finite(), "positive")
}

fn check_frequency(what: &str, omega: f64, time: Discrete) -> Result<()> {
    let below = (0.0..PI / time.ts()).contains(&omega);
    check(what, omega, below, "at least 0 and below the Nyquist frequency, in rad/s")
}

fn check(what: &str, value: f64, good: bool, must: &'static str) -> Result<()> {
    if good { Ok(()) } else { Err(Error::OutOfRange { what: what.to_owned(), value, must }) }
}

#[cfg(test)]
mod tests;
