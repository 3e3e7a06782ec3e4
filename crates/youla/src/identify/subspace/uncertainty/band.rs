//! What is shown of an uncertainty: regions of frequency responses, intervals of modes.

use super::response::magnitude_interval;
use crate::lti::{FrequencyResponse, Gains, Mode};
use crate::{Result, c64};
use rayon::prelude::*;

/// A frequency response with the region of each of its entries.
#[derive(Debug, Clone)]
pub struct ResponseBand {
    /// The estimate.
    pub response: FrequencyResponse,
    /// Per frequency, and in it column by column, the covariance of real and imaginary part: `[rr, ri, ii]`.
    pub covariance: Vec<[f64; 3]>,
    /// In the same order, bounds of the magnitude at the level of the estimate.
    pub magnitude: Vec<[f64; 2]>,
    /// Per frequency, the singular values, the largest first, each with its bounds at that level: `[value, low, high]`. Where
    /// two of them meet, bounds to first order say little.
    pub gains: Vec<Vec<[f64; 3]>>,
    /// Bound of `d' V^-1 d` for the region of a complex value.
    pub ellipse: f64,
}

/// How far regions and intervals reach.
#[derive(Clone, Copy)]
pub struct Reach {
    /// Half width of an interval over the standard deviation.
    pub student: f64,
    /// Bound of `d' V^-1 d` for the two parts of a complex number.
    pub ellipse: f64,
}

impl ResponseBand {
    /// To first order: `changes` of the response at a frequency (one entry per cause, column by column), and the covariance
    /// `[11, 12, 22]` of two quantities from their changes with each cause.
    pub fn by_changes(
        response: FrequencyResponse,
        changes: impl Fn(f64) -> Vec<Vec<c64>> + Sync,
        covariance: impl Fn(&[[f64; 2]]) -> [f64; 3] + Sync,
        reach: Reach,
    ) -> Result<ResponseBand> {
        let at = |k: usize| {
            let (changes, value) = (changes(response.omega[k]), response.at(k));
            let of =
                |part: &dyn Fn(&[c64]) -> [f64; 2]| covariance(&changes.iter().map(|d| part(d)).collect::<Vec<_>>());
            let size = value.nrows() * value.ncols();
            let entries: Vec<[f64; 3]> = (0..size).map(|e| of(&|d| [d[e].re, d[e].im])).collect();
            let gains = Gains::new(value)?;
            let bounds = |(j, value): (usize, &f64)| {
                let half = reach.student * of(&|d| [gains.change(j, d), 0.0])[0].max(0.0).sqrt();
                [*value, (value - half).max(0.0), value + half]
            };
            Ok((entries, gains.values.iter().enumerate().map(bounds).collect::<Vec<_>>()))
        };
        let found: Vec<_> = (0..response.omega.len()).into_par_iter().map(at).collect::<Result<_>>()?;
        let (covariance, gains): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let covariance = covariance.concat();
        let values = response.iter().flat_map(|at| at.col_iter().flat_map(|c| c.iter().copied()).collect::<Vec<_>>());
        let magnitude = values.zip(&covariance).map(|(g, v)| magnitude_interval(g, v, reach.student)).collect();
        Ok(ResponseBand { response, covariance, magnitude, gains, ellipse: reach.ellipse })
    }

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
    pub fn new(mode: Mode, variances: [f64; 2], student: f64) -> Self {
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
