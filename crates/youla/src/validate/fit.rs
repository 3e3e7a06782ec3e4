//! Figures of merit of a prediction: the fit (26) and the variance accounted for.

use crate::linalg::check_shape;
use crate::{MatRef, Result};

/// The NRMSE fit of eq. (26) per output, in percent:
///
/// ```text
/// fit = 100 (1 - ||y - yp|| / ||y - mean(y)||)
/// ```
///
/// The paper calls it R2, which it is not: R2 = 1 - (1 - fit)^2. `measured` and `predicted` are samples x outputs. A
/// constant measured channel has no fit and gives NaN or -inf.
///
/// # Errors
/// [`crate::Error::Shape`] when the two differ in shape.
///
/// ```
/// use youla::{Mat, validate::fit};
/// let y = Mat::from_fn(4, 1, |i, _| i as f64);
/// assert_eq!(fit(y.as_ref(), y.as_ref())?, [100.0]);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn fit(measured: MatRef<'_, f64>, predicted: MatRef<'_, f64>) -> Result<Vec<f64>> {
    per_output(measured, predicted, |residual, spread| 100.0 * (1.0 - (residual.energy / spread.energy).sqrt()))
}

/// Variance accounted for per output, in percent: `100 (1 - var(y - yp) / var(y))`. Unlike [`fit`] it forgives a constant
/// offset and is not compressed near 100.
///
/// # Errors
/// [`crate::Error::Shape`] when the two differ in shape.
pub fn vaf(measured: MatRef<'_, f64>, predicted: MatRef<'_, f64>) -> Result<Vec<f64>> {
    per_output(measured, predicted, |residual, spread| 100.0 * (1.0 - residual.variation / spread.energy))
}

/// Sum of squares of a signal, and the same about its mean.
struct Moments {
    energy: f64,
    variation: f64,
}

fn per_output(
    measured: MatRef<'_, f64>,
    predicted: MatRef<'_, f64>,
    figure: impl Fn(Moments, Moments) -> f64,
) -> Result<Vec<f64>> {
    check_shape("the predicted record", predicted, (measured.nrows(), measured.ncols()))?;
    let n = measured.nrows() as f64;
    let moments = |value: &dyn Fn(usize) -> f64, about_mean: bool| {
        let mean = (0..measured.nrows()).map(value).sum::<f64>() / n;
        let sum = |offset: f64| (0..measured.nrows()).map(|k| (value(k) - offset).powi(2)).sum::<f64>();
        Moments { energy: sum(if about_mean { mean } else { 0.0 }), variation: sum(mean) }
    };
    Ok((0..measured.ncols())
        .map(|j| {
            let residual = moments(&|k| measured[(k, j)] - predicted[(k, j)], false);
            figure(residual, moments(&|k| measured[(k, j)], true))
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mat;

    /// A gain error of 0.3 and an offset of half the amplitude.
    #[test]
    fn figures_by_hand() {
        let y = Mat::from_fn(4, 1, |k, _| [1.0, -1.0, 1.0, -1.0][k]);
        let scaled = Mat::from_fn(4, 1, |k, _| 0.7 * y[(k, 0)]);
        assert!((fit(y.as_ref(), scaled.as_ref()).unwrap()[0] - 70.0).abs() < 1e-12);
        assert!((vaf(y.as_ref(), scaled.as_ref()).unwrap()[0] - 91.0).abs() < 1e-12);
        let offset = Mat::from_fn(4, 1, |k, _| y[(k, 0)] + 0.5);
        assert!((fit(y.as_ref(), offset.as_ref()).unwrap()[0] - 50.0).abs() < 1e-12);
        assert!((vaf(y.as_ref(), offset.as_ref()).unwrap()[0] - 100.0).abs() < 1e-12);
    }
}
