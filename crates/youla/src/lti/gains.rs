//! Principal gains: the singular values of a frequency response, `G = U diag(sigma) V'`.
//!
//! A small change of the response changes a simple singular value by `Re(u' dG v)`, u and v its left and right vectors.

use super::FrequencyResponse;
use crate::{Error, Mat, MatRef, Result, c64};
use faer::Scale;

/// The singular values of a response at one frequency, the largest first, and their vectors.
pub(crate) struct Gains {
    pub(crate) values: Vec<f64>,
    left: Mat<c64>,
    right: Mat<c64>,
}

impl Gains {
    pub(crate) fn new(value: MatRef<'_, c64>) -> Result<Gains> {
        let (scale, scaled) = scaled(value);
        let svd = scaled.thin_svd().map_err(refused)?;
        let values = svd.S().column_vector().iter().map(|s| scale * s.re).collect();
        Ok(Gains { values, left: svd.U().to_owned(), right: svd.V().to_owned() })
    }

    /// Change of singular value `k` with that of the response, column by column.
    pub(crate) fn change(&self, k: usize, response: &[c64]) -> f64 {
        let rows = self.left.nrows();
        let entry = |(at, d): (usize, &c64)| (self.left[(at % rows, k)].conj() * *d * self.right[(at / rows, k)]).re;
        response.iter().enumerate().map(entry).sum()
    }
}

/// The largest singular value of a response, zero where it is empty.
pub(crate) fn largest_singular_value(value: MatRef<'_, c64>) -> Result<f64> {
    if value.nrows() == 0 || value.ncols() == 0 {
        return Ok(0.0);
    }
    let (scale, scaled) = scaled(value);
    Ok(scale * scaled.singular_values().map_err(refused)?[0])
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
        self.iter().map(|at| Ok(Gains::new(at)?.values)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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

    #[test]
    fn a_small_change_moves_them_by_its_part_along_the_vectors() {
        let value = Mat::from_fn(2, 3, |i, j| c64::new(1.0 + (i + 2 * j) as f64, 0.5 - (i * j) as f64));
        let change = Mat::from_fn(2, 3, |i, j| c64::new(0.3 - i as f64, 0.7 * j as f64) * 1e-6);
        let (before, after) = (Gains::new(value.as_ref()).unwrap(), Gains::new((&value + &change).as_ref()).unwrap());
        let flat: Vec<c64> = change.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<_>>()).collect();
        for k in 0..2 {
            let moved = after.values[k] - before.values[k];
            assert!((before.change(k, &flat) - moved).abs() < 1e-11, "{k}: {moved}");
        }
    }
}
