//! Noise, total variance and distortion as curves over the lines.

use super::LineResponse;
use faer::{Mat, Side, c64};

impl LineResponse {
    /// Variance `E |dT_ij|^2` by the noise, at each line.
    ///
    /// # Panics
    /// If there is no such input or output.
    pub fn noise_variance(&self, i: usize, j: usize) -> Vec<f64> {
        self.variance(&self.noise, i, j)
    }

    /// Variance by noise and nonlinear distortion over experiments of random phases, at each line; `None` unless there are
    /// more experiments than inputs.
    ///
    /// # Panics
    /// If there is no such input or output.
    pub fn total_variance(&self, i: usize, j: usize) -> Option<Vec<f64>> {
        (!self.total.is_empty()).then(|| self.variance(&self.total, i, j))
    }

    /// Distortion level: variance by nonlinear distortion of the response from m experiments (one realisation), zero where
    /// the total variance is not above that of the noise. Average over neighbouring lines before reading single decibels.
    ///
    /// # Panics
    /// If there is no such input or output.
    pub fn distortion_variance(&self, i: usize, j: usize) -> Option<Vec<f64>> {
        let realisations = self.periods.len() as f64 / self.response.at(0).ncols() as f64;
        let total = self.total_variance(i, j)?;
        let both = total.iter().zip(self.noise_variance(i, j));
        Some(both.map(|(total, noise)| realisations * (total - noise).max(0.0)).collect())
    }

    /// Signals at line number `k` as columns whose errors are independent of each other, with the excitation of each.
    ///
    /// `T R` has the covariance `(R^H M R)^T (x) C`, and `R = L^-H` with `M = L L^H` makes the first factor one.
    pub(crate) fn excited(&self, k: usize) -> Excited {
        let covariance = self.noise[k].clone();
        let t = self.response.at(k);
        if let Some(own) = self.own.get(k) {
            return Excited { inputs: own.excitation.clone(), outputs: own.means.clone(), covariance };
        }
        let m = t.ncols();
        let mut columns = Mat::<c64>::identity(m, m);
        if let Ok(factor) = self.excitation[k].llt(Side::Lower) {
            // R^H = L^-1
            factor.L().solve_lower_triangular_in_place(&mut columns);
        }
        let inputs = columns.adjoint().to_owned();
        Excited { outputs: t * &inputs, inputs, covariance }
    }

    fn variance(&self, period: &[Mat<c64>], i: usize, j: usize) -> Vec<f64> {
        self.excitation.iter().zip(period).map(|(m, c)| m[(j, j)].re * c[(i, i)].re).collect()
    }
}

/// Independent experiments at a line.
pub(crate) struct Excited {
    /// Excitation, m x E, without error.
    pub(crate) inputs: Mat<c64>,
    /// Signals, q x E.
    pub(crate) outputs: Mat<c64>,
    /// Of each column of the signals.
    pub(crate) covariance: Mat<c64>,
}
