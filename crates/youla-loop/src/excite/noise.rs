//! The white noise of each output from a record without excitation: through the nominal loop,
//!
//! ```text
//! var(y_i) = sum over j of |S_ij|_2^2 sigma_j^2        S the output sensitivity, n to y
//! ```

use super::LoopToExcite;
use super::guard::loop_of;
use crate::error::{Error, Result};
use youla::linalg::solve;
use youla::lti::h2_norm;
use youla::{Mat, MatRef};

/// Standard deviation of the noise of each output, from `y` (samples x p, without its mean) of the loop at rest.
///
/// Everything in y counts as noise of the outputs: unbalance increases it and makes the predicted accuracies pessimistic.
///
/// # Errors
/// [`youla::Error::Shape`]; [`youla::Error::NotStabilising`]; [`youla::Error::OutOfRange`] for an output whose variance the noise of the others would
/// exceed: the record is not that of output noise in this loop.
pub fn output_noise(on: &LoopToExcite, y: MatRef<'_, f64>) -> Result<Vec<f64>> {
    let (m, p) = (on.nominal.inputs(), on.nominal.outputs());
    youla::linalg::check_shape("the record without excitation", y, (y.nrows().max(2), p))?;
    let closed = loop_of(on.nominal, on)?;
    let mut gains = Mat::zeros(p, p);
    for (i, j) in (0..p).flat_map(|i| (0..p).map(move |j| (i, j))) {
        gains[(i, j)] = h2_norm(&closed.part(m + i..m + i + 1, m + j..m + j + 1))?.powi(2);
    }
    let variance = Mat::from_fn(p, 1, |i, _| y.col(i).squared_norm_l2() / y.nrows() as f64);
    let found = solve("the gains from output noise to outputs", gains.as_ref(), variance.as_ref())?;
    (0..p)
        .map(|i| match found[(i, 0)] {
            variance if variance > 0.0 => Ok(variance.sqrt()),
            variance => Err(Error::Method(youla::Error::OutOfRange {
                what: format!(
                    "the variance of the noise of {}, from the record without excitation,",
                    on.outputs[i].name
                ),
                value: variance,
                must: "positive; set the noise of each output instead",
            })),
        })
        .collect()
}
