//! Sums of products of lagged signals: the normal equations of every long regression and of the states made from it.
//!
//! With `z = [u; y]` and windows `w(t) = [z(t); ...; z(t + past)]`, `G = sum over t of w w'`. Shifting both lags by one sample
//! changes a block by two outer products, so only the first block row costs a pass over the data.

use super::spectra::Sizes;
use crate::identify::subspace::Experiment;
use faer::{Mat, MatRef};

/// The sums over all records.
pub(crate) struct LagSums {
    /// Channels of z.
    pub(crate) channels: usize,
    /// Number of lags, `past + 1`.
    pub(crate) lags: usize,
    /// Windows that were summed.
    pub(crate) windows: usize,
    /// G, channels of the oldest sample first.
    pub(crate) gram: Mat<f64>,
}

impl LagSums {
    /// Sums of the records, means taken from each, channels divided by their sizes, inputs delayed.
    pub(crate) fn new(experiments: &[Experiment<'_>], sizes: &Sizes, delays: &[usize], past: usize) -> Self {
        let (m, p) = (sizes.u.len(), sizes.y.len());
        let (q, lags) = (m + p, past + 1);
        let mut gram = Mat::<f64>::zeros(q * lags, q * lags);
        let mut windows = 0;
        let skip = delays.iter().copied().max().unwrap_or(0);
        for e in experiments.iter().filter(|e| e.u.nrows() > 2 * lags + skip) {
            let rows = e.u.nrows() - skip;
            let mut z = Mat::<f64>::from_fn(rows, q, |t, j| {
                if j < m {
                    e.u[(t + skip - delays[j], j)] / sizes.u[j]
                } else {
                    e.y[(t + skip, j - m)] / sizes.y[j - m]
                }
            });
            for j in 0..q {
                let mean = z.col(j).iter().sum::<f64>() / rows as f64;
                z.col_mut(j).iter_mut().for_each(|v| *v -= mean);
            }
            windows += rows - past;
            add(&mut gram, z.as_ref(), lags);
        }
        LagSums { channels: q, lags, windows, gram }
    }
}

fn add(gram: &mut Mat<f64>, z: MatRef<'_, f64>, lags: usize) {
    let (q, count) = (z.ncols(), z.nrows() + 1 - lags);
    let mut own = Mat::<f64>::zeros(q * lags, q * lags);
    for j in 0..lags {
        let block = z.subrows(0, count).transpose() * z.subrows(j, count);
        own.submatrix_mut(0, j * q, q, q).copy_from(&block);
    }
    for i in 1..lags {
        for j in i..lags {
            for a in 0..q {
                for b in 0..q {
                    let enters = z[(count + i - 1, a)] * z[(count + j - 1, b)];
                    let leaves = z[(i - 1, a)] * z[(j - 1, b)];
                    own[(i * q + a, j * q + b)] = own[((i - 1) * q + a, (j - 1) * q + b)] + enters - leaves;
                }
            }
        }
    }
    for j in 0..q * lags {
        for i in 0..q * lags {
            let value = if i / q <= j / q { own[(i, j)] } else { own[(j, i)] };
            gram[(i, j)] += value;
        }
    }
}
