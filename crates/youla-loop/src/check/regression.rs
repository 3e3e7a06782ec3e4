//! Regressions of one record on its own past, all from one triangular factor.
//!
//! Signals are taken at zero mean and unit variance. Columns are the signals at lags from `-ahead` (the future) to n, a
//! constant, and the Legendre polynomials P1 and P2 of time over the record. Every test that needs
//! ```text
//! y(k) = sum_i (A_i y(k-i) + B_i u(k-i)) + ... + e(k)
//! ```
//! with or without some of the columns solves a part of the same triangular system; directions of the regressors below 1e-12 of the
//! largest singular value do not count. Smooth references and integrating plants leave no digits to normal equations.
//!
//! Two nested regressions are compared by F, whose tail is put into standard deviations of a normal variable by the
//! approximation of E. Paulson (Ann. Math. Statist. 13 (1942), 233).

use crate::error::{Error, Result};
use rayon::prelude::*;
use youla::linalg::block;
use youla::{Mat, MatRef};

/// Future samples that are there besides.
/// Enough for a cause that is logged up to three samples late. Chosen, not measured.
pub(super) const AHEAD: usize = 3;
/// Rows of one task; fixed, so that the result does not depend on the number of threads.
/// Chosen, not measured.
const CHUNK: usize = 8192;
/// Rows of a factor, about: they distinguish all models that more rows would. They are taken from every chunk.
/// The 99 columns of a single loop then have 300 rows each. Chosen, not measured.
const FACTORED: usize = 30_000;
/// Most columns of past samples.
/// 160^2 products for each sample. Chosen, not measured.
const COLUMNS: usize = 160;
/// Rows for each column at least.
/// The F test then has at least four times as many degrees of freedom in its denominator as the model has coefficients. Chosen, not
/// measured.
const ROWS_PER_COLUMN: usize = 5;
/// Singular values of the regressors, columns of unit length, below this share of the largest do not count.
/// Chosen, not measured.
const DEPENDENT: f64 = 1e-12;

/// A record with the triangular factor of all its columns.
pub(super) struct Lagged {
    /// Signals with zero mean and unit variance.
    signals: Vec<Vec<f64>>,
    /// Standard deviation of each signal; 0 for a constant one, whose columns are zero.
    pub(super) deviations: Vec<f64>,
    pub(super) lags: usize,
    /// Rows of the regressions; the first belongs to sample `lags`.
    pub(super) rows: usize,
    /// Rows of the factor.
    pub(super) factored: usize,
    /// Rows that do not count; empty for none.
    left_out: Vec<bool>,
    r: Mat<f64>,
}

/// A solved regression.
pub(super) struct Fit {
    /// Indices of the columns.
    pub(super) columns: Vec<usize>,
    /// One column of coefficients for each target.
    pub(super) coefficients: Mat<f64>,
    /// Sum of squares that is left, for each target.
    pub(super) left: Vec<f64>,
    /// Directions that counted.
    pub(super) rank: usize,
    /// Pseudo-inverse of the products of the columns.
    pub(super) inverse: Mat<f64>,
}

impl Lagged {
    /// `None` where the record is too short for four lags.
    pub(super) fn new(groups: &[MatRef<'_, f64>], wanted: usize) -> Option<Self> {
        let samples = groups.first()?.nrows();
        let count: usize = groups.iter().map(|g| g.ncols()).sum();
        let lags = wanted.min(COLUMNS / count.max(1)).min(samples / (ROWS_PER_COLUMN * count.max(1))).max(1);
        if lags < 4 {
            return None;
        }
        let rows = samples.checked_sub(lags + AHEAD)?;
        let mut signals = Vec::new();
        let mut deviations = Vec::new();
        for column in groups.iter().flat_map(|g| g.col_iter()) {
            let mean = column.iter().sum::<f64>() / samples as f64;
            let deviation = (column.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / samples as f64).sqrt();
            // Rounding of a constant is not a signal.
            let deviation = if deviation > 1e-13 * mean.abs() { deviation } else { 0.0 };
            let scale = if deviation > 0.0 { 1.0 / deviation } else { 0.0 };
            signals.push(column.iter().map(|v| scale * (v - mean)).collect());
            deviations.push(deviation);
        }
        let mut lagged =
            Lagged { signals, deviations, lags, rows, factored: rows, left_out: Vec::new(), r: Mat::zeros(0, 0) };
        lagged.factor();
        Some(lagged)
    }

    /// The same without some rows of the regressions: those in which samples are wrong.
    pub(super) fn without(&self, left_out: Vec<bool>) -> Self {
        let (signals, deviations) = (self.signals.clone(), self.deviations.clone());
        let mut lagged = Lagged { signals, deviations, left_out, r: Mat::zeros(0, 0), ..*self };
        lagged.factor();
        lagged
    }

    fn width(&self) -> usize {
        self.lags + AHEAD + 1
    }

    /// Column of a signal at a lag, negative for the future.
    pub(super) fn column(&self, signal: usize, lag: isize) -> usize {
        signal * self.width() + (lag + AHEAD as isize) as usize
    }

    /// The lag of a column of a signal.
    pub(super) fn lag(&self, column: usize) -> Option<isize> {
        let of_signal = column < self.signals.len() * self.width();
        of_signal.then(|| (column % self.width()) as isize - AHEAD as isize)
    }

    /// The signal of a column of a signal.
    pub(super) fn signal(&self, column: usize) -> usize {
        column / self.width()
    }

    /// A sample of a signal, at zero mean and unit variance.
    pub(super) fn sample(&self, signal: usize, at: usize) -> f64 {
        self.signals.get(signal).and_then(|s| s.get(at)).copied().unwrap_or(0.0)
    }

    /// Columns of some signals at lags from `first` to n.
    pub(super) fn past(&self, signals: std::ops::Range<usize>, first: isize) -> Vec<usize> {
        signals.flat_map(|s| (first..=self.lags as isize).map(move |lag| self.column(s, lag))).collect()
    }

    /// Column of the constant (0) or of a Legendre polynomial of time (1, 2).
    pub(super) fn trend(&self, degree: usize) -> usize {
        self.signals.len() * self.width() + degree
    }

    /// Values of a column in some rows.
    fn values(&self, column: usize, first: usize, out: &mut [f64]) {
        let width = self.width();
        if let Some(signal) = self.signals.get(column / width) {
            let from = first + self.lags + AHEAD - column % width;
            out.copy_from_slice(&signal[from..from + out.len()]);
            return;
        }
        let degree = column - self.signals.len() * width;
        for (k, value) in out.iter_mut().enumerate() {
            let x = 2.0 * (first + k) as f64 / (self.rows.max(2) - 1) as f64 - 1.0;
            *value = [1.0, x, 1.5 * x * x - 0.5][degree];
        }
    }

    fn factor(&mut self) {
        let columns = self.signals.len() * self.width() + 3;
        let starts: Vec<usize> = (0..self.rows).step_by(CHUNK).collect();
        let every = self.rows.div_ceil(FACTORED);
        let count = |first: &usize| CHUNK.min(self.rows - first).div_ceil(every);
        self.factored = starts.iter().map(count).sum();
        let part = |first: &usize| {
            let mut rows = Mat::zeros(count(first), columns);
            (0..columns).for_each(|j| self.values(j, *first, rows.col_as_slice_mut(j)));
            let left_out = self.left_out.iter().skip(*first).take(rows.nrows()).enumerate();
            left_out.filter(|(_, out)| **out).for_each(|(k, _)| rows.row_mut(k).fill(0.0));
            rows.qr().thin_R().to_owned()
        };
        let factors: Vec<Mat<f64>> = starts.par_iter().map(part).collect();
        let join =
            |above: Mat<f64>, below: Mat<f64>| block(&[&[above.as_ref()], &[below.as_ref()]]).qr().thin_R().to_owned();
        self.r = factors.into_iter().reduce(join).unwrap_or_else(|| Mat::zeros(0, columns));
    }

    /// Least squares of some columns on others.
    pub(super) fn fit(&self, targets: &[usize], columns: Vec<usize>) -> Result<Fit> {
        let (rows, count) = (self.r.nrows(), columns.len());
        let scale: Vec<f64> = columns
            .iter()
            .map(|j| self.r.col(*j).norm_l2())
            .map(|length| if length > 0.0 { 1.0 / length } else { 0.0 })
            .collect();
        let regressors = Mat::from_fn(rows, count, |i, j| scale[j] * self.r[(i, columns[j])]);
        let right = Mat::from_fn(rows, targets.len(), |i, j| self.r[(i, targets[j])]);
        let svd = regressors.thin_svd().map_err(|_| no_convergence())?;
        let values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let rank = values.iter().filter(|s| **s > DEPENDENT * values[0]).count();
        let u = svd.U().subcols(0, rank);
        let half = Mat::from_fn(count, rank, |i, k| scale[i] * svd.V()[(i, k)] / values[k]);
        let coordinates = u.transpose() * &right;
        let rest = &right - u * &coordinates;
        let left = rest.col_iter().map(|c| c.squared_norm_l2()).collect();
        Ok(Fit { columns, coefficients: &half * &coordinates, left, rank, inverse: &half * half.transpose() })
    }

    /// Part of the sum of squares of a combination of columns, in units of their signals, that a regression on other such
    /// combinations leaves.
    pub(super) fn left_of(&self, target: &[(usize, f64)], on: &[Vec<(usize, f64)>]) -> Result<f64> {
        let sum = |terms: &[(usize, f64)]| {
            terms.iter().fold(Mat::zeros(self.r.nrows(), 1), |sum: Mat<f64>, (column, factor)| {
                let signal = column / self.width();
                let size = factor * self.deviations.get(signal).copied().unwrap_or(1.0);
                Mat::from_fn(sum.nrows(), 1, |i, _| sum[(i, 0)] + size * self.r[(i, *column)])
            })
        };
        let columns: Vec<Mat<f64>> = on.iter().map(|terms| sum(terms)).collect();
        let length: Vec<f64> = columns.iter().map(|c| c.norm_l2()).collect();
        let of = |i: usize, j: usize| if length[j] > 0.0 { columns[j][(i, 0)] / length[j] } else { 0.0 };
        let right = sum(target);
        let svd = Mat::from_fn(right.nrows(), columns.len(), of).thin_svd().map_err(|_| no_convergence())?;
        let values = svd.S().column_vector();
        let rank = values.iter().filter(|s| **s > DEPENDENT * values[0]).count();
        let u = svd.U().subcols(0, rank);
        let rest = &right - u * (u.transpose() * &right);
        Ok(rest.squared_norm_l2() / right.squared_norm_l2().max(f64::MIN_POSITIVE))
    }

    /// What a regression leaves of a target, row by row.
    pub(super) fn residual(&self, fit: &Fit, target: usize, which: usize) -> Vec<f64> {
        let mut left = vec![0.0; self.rows];
        self.values(target, 0, &mut left);
        left.par_chunks_mut(CHUNK).enumerate().for_each(|(part, left)| {
            let mut column = vec![0.0; left.len()];
            for (k, j) in fit.columns.iter().enumerate() {
                self.values(*j, part * CHUNK, &mut column);
                let coefficient = fit.coefficients[(k, which)];
                left.iter_mut().zip(&column).for_each(|(e, value)| *e -= coefficient * value);
            }
        });
        left
    }

    /// What the columns of `full` explain beyond those of `reduced`, for one target.
    pub(super) fn gain(&self, reduced: &Fit, full: &Fit, which: usize) -> Gain {
        let (before, after) = (reduced.left[which], full.left[which]);
        let added = full.rank.saturating_sub(reduced.rank);
        let freedom = self.factored.saturating_sub(full.rank);
        // Below this the difference of the sums is rounding.
        let floor = 1e-24 * self.factored as f64;
        if added == 0 || freedom == 0 || before <= floor {
            return Gain { share: 0.0, deviations: 0.0 };
        }
        let f = (before - after).max(0.0) / added as f64 / (after.max(floor) / freedom as f64);
        Gain { share: (1.0 - after / before).max(0.0), deviations: paulson(f, added as f64, freedom as f64) }
    }
}

fn no_convergence() -> Error {
    Error::Method(youla::Error::NoConvergence { what: "the regressors of the data check".into(), iterations: 0 })
}

/// What some columns add to a regression.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    /// Part of the sum of squares that they explain.
    pub(super) share: f64,
    /// F in standard deviations of a normal variable.
    pub(super) deviations: f64,
}

/// The standard deviations that have the tail of F with the given degrees of freedom.
pub(super) fn paulson(f: f64, nu1: f64, nu2: f64) -> f64 {
    let (a, b) = (2.0 / (9.0 * nu1), 2.0 / (9.0 * nu2));
    let root = f.max(0.0).cbrt();
    ((1.0 - b) * root - (1.0 - a)) / (b * root * root + a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    /// Abramowitz and Stegun, table 26.9: F of 10 and 30 degrees of freedom exceeds 2.98 with probability 1 %, which is 2.326
    /// deviations; of 4 and 120, 2.45 with 5 %, 1.645 deviations.
    #[test]
    fn tail_of_f() {
        assert!((paulson(2.98, 10.0, 30.0) - 2.326).abs() < 0.01, "{}", paulson(2.98, 10.0, 30.0));
        assert!((paulson(2.45, 4.0, 120.0) - 1.645).abs() < 0.01, "{}", paulson(2.45, 4.0, 120.0));
    }

    /// `y(k) = 0.7 y(k-1) + 2 u(k-3) + e(k)`: the coefficients, the residual, and what a lag is worth.
    #[test]
    fn a_known_regression_is_found() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut draw = || rng.sample::<f64, _>(StandardNormal);
        let u: Vec<f64> = (0..20_000).map(|_| draw()).collect();
        let mut y = vec![0.0; 20_000];
        for k in 3..20_000 {
            y[k] = 0.7 * y[k - 1] + 2.0 * u[k - 3] + 0.1 * draw();
        }
        let (u, y) = (Mat::from_fn(20_000, 1, |k, _| u[k]), Mat::from_fn(20_000, 1, |k, _| y[k]));
        let lagged = Lagged::new(&[u.as_ref(), y.as_ref()], 10).unwrap();
        let target = lagged.column(1, 0);
        let columns = [lagged.past(0..2, 1), vec![lagged.trend(0)]].concat();
        let fit = lagged.fit(&[target], columns).unwrap();
        let of = |signal, lag| {
            let place = fit.columns.iter().position(|c| *c == lagged.column(signal, lag)).unwrap();
            fit.coefficients[(place, 0)] * lagged.deviations[1] / lagged.deviations[signal]
        };
        assert!((of(1, 1) - 0.7).abs() < 0.03 && (of(0, 3) - 2.0).abs() < 5e-3, "{} {}", of(1, 1), of(0, 3));
        let e = lagged.residual(&fit, target, 0);
        let energy: f64 = e.iter().map(|v| v * v).sum();
        assert!((energy / fit.left[0] - 1.0).abs() < 1e-8);
        assert!((energy.sqrt() * lagged.deviations[1] / (e.len() as f64).sqrt() - 0.1).abs() < 2e-3);
        let reduced = lagged.fit(&[target], [lagged.past(1..2, 1), vec![lagged.trend(0)]].concat()).unwrap();
        let gain = lagged.gain(&reduced, &fit, 0);
        assert!(gain.share > 0.99 && gain.deviations > 50.0, "{gain:?}");
    }
}
