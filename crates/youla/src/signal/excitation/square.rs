//! A series of square waves: the sign changes after a random number of samples.

use super::{check, check_amplitude};
use crate::Result;
use faer::Mat;
use rand::{Rng, RngExt};

/// Square waves whose half periods are drawn from a range; a single fixed period would not excite persistently.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct SquareWaves {
    /// Shortest half period in samples.
    pub hold_min: usize,
    /// Longest half period in samples.
    pub hold_max: usize,
    /// The signal is plus or minus this.
    pub amplitude: f64,
}

impl Default for SquareWaves {
    fn default() -> Self {
        SquareWaves { hold_min: 4, hold_max: 200, amplitude: 1.0 }
    }
}

impl SquareWaves {
    pub(super) fn generate(&self, samples: usize, channels: usize, rng: &mut impl Rng) -> Result<Mat<f64>> {
        let (min, max) = (self.hold_min, self.hold_max);
        check("the shortest half period of square waves", min as f64, min >= 1, "at least 1 sample")?;
        check("the longest half period of square waves", max as f64, max >= min, "at least the shortest one")?;
        check_amplitude(self.amplitude)?;
        let mut out = Mat::zeros(samples, channels);
        for j in 0..channels {
            let mut level = if rng.random::<bool>() { self.amplitude } else { -self.amplitude };
            let mut left = rng.random_range(min..=max);
            for value in out.col_mut(j).iter_mut() {
                if left == 0 {
                    level = -level;
                    left = rng.random_range(min..=max);
                }
                *value = level;
                left -= 1;
            }
        }
        Ok(out)
    }
}
