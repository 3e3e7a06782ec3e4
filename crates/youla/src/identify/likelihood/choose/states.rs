//! Starts: states of the predictor from a long ridge regression (PBSIDopt: Chiuso, Automatica 43 (2007), 1034), all from the
//! lag sums.

use crate::identify::likelihood::data::lag_sums::LagSums;
use crate::linalg::TINY;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Lag windows as states: `x(t) = T [z(t - past); ...; z(t - 1)]`, the best-determined first.
pub(crate) struct States {
    inputs: usize,
    past: usize,
    /// T, states x (past channels).
    select: Mat<f64>,
    /// Singular values.
    pub(crate) singular: Vec<f64>,
}

impl States {
    /// The states of a regression over `past <= sums.lags - 1` samples with a relative ridge, `future` rows of the predictor.
    pub(crate) fn new(sums: &LagSums, inputs: usize, [past, future, largest]: [usize; 3], ridge: f64) -> Option<Self> {
        let q = sums.channels;
        let p = q - inputs;
        let offset = (sums.lags - 1 - past) * q;
        let size = past * q;
        let z = sums.gram.submatrix(offset, offset, size, size);
        let mean = (0..size).map(|i| z[(i, i)]).sum::<f64>() / size as f64;
        let mut regular = z.to_owned();
        (0..size).for_each(|i| regular[(i, i)] += ridge * mean);
        let targets = sums.gram.submatrix(offset, offset + size + inputs, size, p);
        let cholesky = regular.llt(Side::Lower).ok()?;
        let theta = cholesky.solve(&targets);
        let mut predictor = Mat::<f64>::zeros(future * p, size);
        for i in 0..future.min(past) {
            for lag in i..past {
                for a in 0..q {
                    for o in 0..p {
                        predictor[(i * p + o, lag * q + a)] = theta[((lag - i) * q + a, o)];
                    }
                }
            }
        }
        let weighted = &predictor * cholesky.L();
        let svd = weighted.thin_svd().ok()?;
        let count = largest.min(future * p);
        let singular: Vec<f64> = svd.S().column_vector().iter().take(count).copied().collect();
        let select = svd.U().subcols(0, count).transpose() * &predictor;
        let select = Mat::from_fn(count, size, |i, j| select[(i, j)] / singular[i].max(TINY));
        Some(States { inputs, past, select, singular })
    }

    /// A, B, C and K of the first n states by two regressions.
    pub(crate) fn realise(&self, sums: &LagSums, n: usize) -> Option<[Mat<f64>; 4]> {
        let (q, m) = (sums.channels, self.inputs);
        let p = q - m;
        let size = self.past * q;
        let offset = (sums.lags - 1 - self.past) * q;
        let whole = sums.gram.submatrix(offset, offset, size + q, size + q);
        let select = self.select.subrows(0, n);
        // x, u, y at t and x at t + 1 as rows over the window
        let mut rows = Mat::<f64>::zeros(n + q + n, size + q);
        rows.submatrix_mut(0, 0, n, size).copy_from(select);
        (0..q).for_each(|i| rows[(n + i, size + i)] = 1.0);
        rows.submatrix_mut(n + q, q, n, size).copy_from(select);
        let s = &rows * whole * rows.transpose();
        let x = s.submatrix(0, 0, n, n).to_owned();
        let c = ridged(&x)?.solve(s.submatrix(0, n + m, n, p)).transpose().to_owned();
        // e = y - C x in terms of x, u, y
        let mut back = Mat::<f64>::zeros(n + m + p, n + q);
        (0..n + m).for_each(|i| back[(i, i)] = 1.0);
        for o in 0..p {
            back[(n + m + o, n + m + o)] = 1.0;
            (0..n).for_each(|j| back[(n + m + o, j)] = -c[(o, j)]);
        }
        let regressors = &back * s.submatrix(0, 0, n + q, n + q) * back.transpose();
        let cross = &back * s.submatrix(0, n + q, n + q, n);
        let solved = ridged(&regressors)?.solve(&cross);
        let part = |from: usize, count: usize| solved.subrows(from, count).transpose().to_owned();
        Some([part(0, n), part(n, m), c, part(n + m, p)])
    }
}

/// Cholesky factor with a ridge of rounding size.
fn ridged(gram: &Mat<f64>) -> Option<faer::linalg::solvers::Llt<f64>> {
    let mut regular = gram.clone();
    for i in 0..gram.nrows() {
        regular[(i, i)] *= 1.0 + 1e-12;
        regular[(i, i)] += TINY;
    }
    regular.llt(Side::Lower).ok()
}
