//! What is shown of an uncertainty: regions of frequency responses, intervals of modes.

use crate::c64;
use crate::lti::{FrequencyResponse, Mode};

/// A frequency response with the region of each of its entries.
#[derive(Debug, Clone)]
pub struct ResponseBand {
    /// The estimate.
    pub response: FrequencyResponse,
    /// Per frequency, and in it column by column, the covariance of real and imaginary part: `[rr, ri, ii]`.
    pub covariance: Vec<[f64; 3]>,
    /// In the same order, bounds of the magnitude at the level of the estimate.
    pub magnitude: Vec<[f64; 2]>,
    /// Bound of `d' V^-1 d` for the region of a complex value.
    pub ellipse: f64,
}

impl ResponseBand {
    /// Place of entry (output i, input j) at frequency number k.
    pub fn place(&self, k: usize, i: usize, j: usize) -> usize {
        let at = self.response.at(k);
        (k * at.ncols() + j) * at.nrows() + i
    }

    /// Squared distance `d' V^-1 d` of a value from the estimate.
    pub fn distance(&self, k: usize, i: usize, j: usize, value: c64) -> f64 {
        let [rr, ri, ii] = self.covariance[self.place(k, i, j)];
        let d = value - self.response.at(k)[(i, j)];
        let (v, determinant) = (ii * d.re * d.re - 2.0 * ri * d.re * d.im + rr * d.im * d.im, rr * ii - ri * ri);
        // On the real axis (frequency 0 and Nyquist) there is no imaginary part.
        if determinant > 1e-20 * (rr + ii) * (rr + ii) { v / determinant } else { d.norm_sqr() / (rr + ii) }
    }

    /// Whether the region holds a value.
    pub fn holds(&self, k: usize, i: usize, j: usize, value: c64) -> bool {
        self.distance(k, i, j, value) <= self.ellipse
    }
}

/// A mode with the intervals of its frequency and damping. For a real pole the frequency `|s| / 2 pi` is the inverse of
/// `2 pi` times the time constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeBand {
    /// The mode.
    pub mode: Mode,
    /// Standard deviation of the frequency, Hz.
    pub hz_deviation: f64,
    /// Standard deviation of the damping ratio; 0 for a real pole.
    pub zeta_deviation: f64,
    /// Interval of the frequency, Hz.
    pub hz: [f64; 2],
    /// Interval of the damping ratio.
    pub zeta: [f64; 2],
}

impl ModeBand {
    /// From the variances of frequency and damping and the half width of an interval over the deviation.
    pub(crate) fn new(mode: Mode, variances: [f64; 2], student: f64) -> Self {
        let [hz, zeta] = variances.map(|v| v.max(0.0).sqrt());
        ModeBand {
            mode,
            hz_deviation: hz,
            zeta_deviation: zeta,
            hz: [(mode.hz - student * hz).max(0.0), mode.hz + student * hz],
            zeta: [mode.zeta - student * zeta, mode.zeta + student * zeta],
        }
    }
}
