//! Persistency of excitation: the rank of the block-Hankel matrix of a signal.
//!
//! `H = [u(k); u(k+1); ...; u(k+s-1)]` over all k has s m rows; the signal is persistently exciting of order s when its
//! rank is s m. Channels are scaled to unit root mean square, so that units do not decide.
//!
//! Source: J. C. Willems, P. Rapisarda, I. Markovsky, B. De Moor, A note on persistency of excitation, Syst. Control
//! Lett. 54 (2005), 325.

use crate::linalg::{block, check_finite};
use crate::{Error, Result};
use faer::{Mat, MatRef};
use rayon::prelude::*;

/// Columns of the Hankel matrix that one task compresses; fixed, so that the result does not depend on the threads.
const CHUNK: usize = 4096;
/// Spread of the singular values up to which those of the Gram matrix are taken: rounding changes the least by a part of 1e8.
const SPREAD: f64 = 1e4;

/// How much of its block-Hankel matrix a signal fills.
#[derive(Debug, Clone, PartialEq)]
pub struct Persistency {
    /// Number of block rows s.
    pub block_rows: usize,
    /// Number of singular values above rounding.
    pub rank: usize,
    /// Rank of a persistently exciting signal, s m.
    pub needed: usize,
    /// Ratio of the largest to the smallest singular value, infinite where the smallest is zero.
    pub condition: f64,
    /// Singular values of the scaled block-Hankel matrix, largest first.
    pub singular_values: Vec<f64>,
}

impl Persistency {
    /// Refuses a signal that does not fill its block-Hankel matrix.
    ///
    /// # Errors
    /// [`Error::InsufficientExcitation`] naming `what`.
    pub fn require(&self, what: &str) -> Result<()> {
        if self.rank == self.needed {
            return Ok(());
        }
        let (block_rows, rank, needed) = (self.block_rows, self.rank, self.needed);
        Err(Error::InsufficientExcitation { what: what.to_owned(), block_rows, rank, needed })
    }
}

/// Numerical rank of the block-Hankel matrix of `signal` (samples x m) with `block_rows` block rows.
///
/// Singular values below `max(rows, columns) * machine precision` times the largest count as zero. They come from the Gram matrix where
/// they spread by less than 1e4, else from a QR factorisation, so that a spread of 1e8 and more is seen.
///
/// # Errors
/// [`Error::OutOfRange`] for no block rows or more of them than samples, [`Error::NotFinite`],
/// [`Error::NoConvergence`] of the singular values.
///
/// ```
/// use youla::{Mat, signal::persistency};
/// let sine = Mat::from_fn(500, 1, |k, _| (k as f64 * 0.3).sin());
/// let found = persistency(sine.as_ref(), 10)?;
/// assert_eq!((found.rank, found.needed), (2, 10));
/// assert!(found.require("alpha").is_err());
/// # Ok::<(), youla::Error>(())
/// ```
pub fn persistency(signal: MatRef<f64>, block_rows: usize) -> Result<Persistency> {
    check_finite("the excitation", signal)?;
    if block_rows == 0 || block_rows > signal.nrows() {
        let what = format!("the number of block rows for {} samples", signal.nrows());
        return Err(Error::OutOfRange { what, value: block_rows as f64, must: "at least 1 and at most the samples" });
    }
    let scaled = unit_channels(signal);
    let needed = block_rows * signal.ncols();
    let mut values = match values_by_gram(scaled.as_ref(), block_rows) {
        Some(values) => values,
        None => hankel_factor(scaled.as_ref(), block_rows).singular_values().map_err(|_| Error::NoConvergence {
            what: "the singular values of the excitation".into(),
            iterations: 0,
        })?,
    };
    values.resize(needed, 0.0);
    let largest = values.first().copied().unwrap_or(0.0);
    let longest = needed.max(signal.nrows() - block_rows + 1) as f64;
    let rank = values.iter().filter(|&&value| value > longest * f64::EPSILON * largest).count();
    let smallest = values.last().copied().unwrap_or(0.0);
    let condition = if smallest > 0.0 { largest / smallest } else { f64::INFINITY };
    Ok(Persistency { block_rows, rank, needed, condition, singular_values: values })
}

/// The largest order, up to `highest`, of which `signal` (samples x m) is persistently exciting: the largest s for which
/// its block-Hankel matrix with s block rows has rank s m. A signal of order s is of every lower order, so the search
/// halves; it decides the rank as [`persistency`] does. Zero where a channel is zero.
///
/// k sines are of order 2 k. Where they crowd in a small part of the band, rounding leaves less: the order is what a
/// computation in double precision can use.
///
/// # Errors
/// [`Error::NotFinite`], [`Error::NoConvergence`] of the singular values.
///
/// ```
/// use youla::{Mat, signal::persistency_order};
/// let sine = Mat::from_fn(500, 1, |k, _| (k as f64 * 0.3).sin());
/// assert_eq!(persistency_order(sine.as_ref(), 10)?, 2);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn persistency_order(signal: MatRef<f64>, highest: usize) -> Result<usize> {
    check_finite("the excitation", signal)?;
    // A matrix with fewer columns, samples - s + 1, than rows, s m, has not got the rank.
    let (mut reached, mut beyond) = (0, highest.min((signal.nrows() + 1) / (signal.ncols() + 1)) + 1);
    while beyond - reached > 1 {
        let middle = reached.midpoint(beyond);
        let found = persistency(signal, middle)?;
        *(if found.rank == found.needed { &mut reached } else { &mut beyond }) = middle;
    }
    Ok(reached)
}

/// Channels with a root mean square of one; a channel of zeros stays.
fn unit_channels(signal: MatRef<f64>) -> Mat<f64> {
    let rms = |j: usize| signal.col(j).norm_l2() / (signal.nrows() as f64).sqrt();
    let scale: Vec<f64> = (0..signal.ncols()).map(rms).map(|rms| if rms > 0.0 { 1.0 / rms } else { 0.0 }).collect();
    Mat::from_fn(signal.nrows(), signal.ncols(), |i, j| signal[(i, j)] * scale[j])
}

/// Something of each chunk of rows of the transposed block-Hankel matrix.
fn of_chunks(signal: MatRef<f64>, block_rows: usize, of: fn(Mat<f64>) -> Mat<f64>) -> Vec<Mat<f64>> {
    let (m, rows) = (signal.ncols(), signal.nrows() - block_rows + 1);
    let chunk = |first: usize| {
        let height = CHUNK.min(rows - first);
        Mat::from_fn(height, block_rows * m, |k, column| signal[(first + k + column / m, column % m)])
    };
    let starts: Vec<usize> = (0..rows).step_by(CHUNK).collect();
    starts.into_par_iter().map(|first| of(chunk(first))).collect()
}

/// Singular values by the eigenvalues of the Gram matrix, largest first; `None` where they spread by [`SPREAD`] or more.
fn values_by_gram(signal: MatRef<f64>, block_rows: usize) -> Option<Vec<f64>> {
    let sum = of_chunks(signal, block_rows, |rows| rows.transpose() * &rows).into_iter().reduce(|a, b| a + b)?;
    let squares = sum.self_adjoint_eigenvalues(faer::Side::Lower).ok()?;
    let (least, most) = (*squares.first()?, *squares.last()?);
    (least * SPREAD * SPREAD > most).then(|| squares.into_iter().rev().map(f64::sqrt).collect())
}

/// Triangular factor of the transposed block-Hankel matrix: chunks of rows first, then their factors one by one.
fn hankel_factor(signal: MatRef<f64>, block_rows: usize) -> Mat<f64> {
    let factors = of_chunks(signal, block_rows, triangle);
    let join = |above: Mat<f64>, below: Mat<f64>| triangle(block(&[&[above.as_ref()], &[below.as_ref()]]));
    factors.into_iter().reduce(join).unwrap_or_else(|| Mat::zeros(0, block_rows * signal.ncols()))
}

fn triangle(matrix: Mat<f64>) -> Mat<f64> {
    matrix.qr().thin_R().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn rank_counts_the_lines_of_the_spectrum() {
        let lines = |count: usize| {
            Mat::from_fn(10_000, 1, move |k, _| (1..=count).map(|l| (l as f64 * 0.2 * k as f64).cos()).sum())
        };
        for count in [1, 3, 7] {
            assert_eq!(persistency(lines(count).as_ref(), 20).unwrap().rank, 2 * count);
        }
        let constant = Mat::from_fn(100, 2, |_, j| [5.0, 0.0][j]);
        let error = persistency(constant.as_ref(), 4).unwrap().require("alpha").unwrap_err().to_string();
        assert!(error.contains("alpha does not excite enough") && error.contains("rank 1 of 8"), "{error}");
    }

    #[test]
    fn noise_fills_all_directions_whatever_its_unit() {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let noise = Mat::from_fn(9_000, 2, |_, j| [1e-6, 1e3][j] * (rng.random::<f64>() - 0.5));
        let found = persistency(noise.as_ref(), 10).unwrap();
        assert_eq!(found.rank, 20);
        assert!(found.condition < 2.0, "{}", found.condition);
        let exact = Mat::from_fn(8_991, 20, |k, c| noise[(k + c / 2, c % 2)]);
        let scale = |j: usize| noise.col(j).norm_l2() / 9_000f64.sqrt();
        let scaled = Mat::from_fn(8_991, 20, |k, c| exact[(k, c)] / scale(c % 2));
        let reference = scaled.singular_values().unwrap();
        assert!((found.singular_values[19] / reference[19] - 1.0).abs() < 1e-12);
        assert_eq!(persistency(noise.as_ref().subrows(0, 15), 10).unwrap().rank, 6);
        assert!(persistency(noise.as_ref().subrows(0, 15), 16).is_err());
    }
}
