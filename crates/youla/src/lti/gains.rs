//! Principal gains: the singular values of a frequency response.

use super::FrequencyResponse;
use crate::{Error, Mat, MatRef, Result, c64};
use faer::{Scale, Side};

/// Rows and columns from which the largest singular value is the root of the largest eigenvalue of the Gram matrix: as exact as the singular
/// value itself (the smaller ones would not be), in a third of the time.
const LARGE: usize = 8;

/// The singular values of a response at one frequency, the largest first.
fn singular_values(value: MatRef<'_, c64>) -> Result<Vec<f64>> {
    let (scale, scaled) = scaled(value);
    Ok(scaled.singular_values().map_err(refused)?.into_iter().map(|s| scale * s).collect())
}

/// The largest singular value of a response, zero where it is empty.
pub(crate) fn largest_singular_value(value: MatRef<'_, c64>) -> Result<f64> {
    if value.nrows() == 0 || value.ncols() == 0 {
        return Ok(0.0);
    }
    if value.nrows().min(value.ncols()) < LARGE {
        return Ok(singular_values(value)?[0]);
    }
    let (scale, scaled) = scaled(value);
    let gram = if value.nrows() > value.ncols() { scaled.adjoint() * &scaled } else { &scaled * scaled.adjoint() };
    let squares = gram.self_adjoint_eigenvalues(Side::Lower).map_err(refused)?;
    Ok(scale * squares.last().copied().unwrap_or(0.0).max(0.0).sqrt())
}

/// The largest singular value with its left and its right vector: `d sigma = Re u* dH v`.
pub(crate) fn largest_singular_direction(value: MatRef<'_, c64>) -> Result<(f64, Mat<c64>, Mat<c64>)> {
    let (scale, scaled) = scaled(value);
    let svd = scaled.thin_svd().map_err(refused)?;
    let first = |vectors: MatRef<'_, c64>| vectors.subcols(0, 1).to_owned();
    Ok((scale * svd.S()[0].re, first(svd.U()), first(svd.V())))
}

/// A response and the factor that it lacks: so small that tiny gains do not underflow.
fn scaled(value: MatRef<'_, c64>) -> (f64, Mat<c64>) {
    let largest = value.norm_max();
    let scale = if largest > 0.0 { largest } else { 1.0 };
    (scale, Scale(c64::new(1.0 / scale, 0.0)) * value)
}

fn refused<E>(_: E) -> Error {
    Error::NoConvergence { what: "the singular values of a response".into(), iterations: 0 }
}

impl FrequencyResponse {
    /// The singular values at each frequency, the largest first: min(p, m) numbers per frequency.
    ///
    /// Their squares sum to the squared Frobenius norm (held by `gains_are_singular_values`).
    ///
    /// # Errors
    /// [`Error::NoConvergence`] of a singular value iteration.
    ///
    /// ```
    /// use youla::{Mat, lti::{Discrete, StateSpace, frequency_response}};
    /// let crossed = Mat::from_fn(2, 2, |i, j| [[0.0, 3.0], [2.0, 0.0]][i][j]);
    /// let system = StateSpace::gain(crossed, Discrete::new(1.0)?)?;
    /// let gains = frequency_response(&system, &[0.1])?.gains()?;
    /// assert!((gains[0][0] - 3.0).abs() < 1e-14 && (gains[0][1] - 2.0).abs() < 1e-14);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn gains(&self) -> Result<Vec<Vec<f64>>> {
        self.iter().map(singular_values).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::lti::frequency_response;

    #[test]
    fn gains_are_singular_values() {
        let response = frequency_response(&crate::fixtures::bearing(), &[10.0, 300.0, 5000.0]).unwrap();
        for (at, gains) in response.iter().zip(response.gains().unwrap()) {
            let squares: f64 = gains.iter().map(|g| g * g).sum();
            let norm = at.norm_l2().powi(2);
            assert!((squares - norm).abs() < 1e-13 * norm && gains[0] >= gains[1]);
        }
    }
}
