//! Removal of what turns with the shaft: unbalance and run-out are lines at known frequencies, not noise.

use crate::Result;
use crate::linalg::least_squares;
use crate::lti::Discrete;
use faer::{Mat, MatRef};
use std::f64::consts::TAU;

/// Subtracts from each channel (samples x channels) its mean and its first `harmonics` harmonics of the frequency `hz`,
///
/// ```text
/// s(k) - c_0 - sum_h (a_h cos(h w k ts) + b_h sin(h w k ts)),    w = 2 pi hz
/// ```
///
/// with the coefficients of least squares. A subspace method would spend two states on the unit circle per line. What an
/// excitation of long record has at exactly these frequencies goes too, one part in N of its power per coefficient.
///
/// # Errors
/// [`crate::Error::Shape`] and those of the least squares, for fewer samples than coefficients.
///
/// ```
/// use youla::{Mat, lti::Discrete};
/// use youla::signal::without_harmonics;
/// let time = Discrete::new(1e-3)?;
/// let run_out = Mat::from_fn(500, 1, |k, _| 3.0 + (0.2 * k as f64).sin() - 2.0 * (0.4 * k as f64).cos());
/// let rest = without_harmonics(run_out.as_ref(), 0.2 / (2.0 * std::f64::consts::PI * 1e-3), 2, time)?;
/// assert!(rest.norm_max() < 1e-12);
/// # Ok::<(), youla::Error>(())
/// ```
pub fn without_harmonics(signal: MatRef<'_, f64>, hz: f64, harmonics: usize, time: Discrete) -> Result<Mat<f64>> {
    let step = TAU * hz * time.ts();
    let regressors = Mat::from_fn(signal.nrows(), 1 + 2 * harmonics, |k, j| {
        let angle = j.div_ceil(2) as f64 * step * k as f64;
        if j % 2 == 0 { angle.cos() } else { angle.sin() }
    });
    let found = least_squares("the harmonics of the speed", regressors.as_ref(), signal)?;
    Ok(signal - regressors * found.x)
}
