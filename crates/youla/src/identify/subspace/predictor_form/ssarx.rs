//! SSARX: the predictor's share of the future is taken off first, then past and rest of the future are correlated.
//!
//! With the coefficients of the regression, the future outputs without what later inputs and outputs tell are
//! ```text
//! yt(k+i) = y(k+i) - D u(k+i) - sum_{j=1..i} Xi_j z(k+i-j) = C At^i x(k) + e(k+i),    i < f
//! ```
//! The canonical variates of z(k-p) ... z(k-1) with respect to `yt(k) ... yt(k+f-1)` are the states, their correlations the
//! singular values. Assumptions as for PBSIDopt. Only the first f - 1 coefficients enter, and the weights are those of CVA,
//! so that the units of the outputs do not matter.
//!
//! Source: M. Jansson, Subspace identification and ARX modeling, IFAC SYSID 2003, Rotterdam.

use crate::Result;
use crate::identify::subspace::predictor_form::varx::{StateMap, Varx, no_singular_values};
use faer::Mat;

/// Directions of the future below this share of the largest are noise-free to working precision and cannot be whitened.
const WHITENING_TOLERANCE: f64 = 1e-10;

/// The states of SSARX.
pub(crate) fn states(varx: &Varx) -> Result<StateMap> {
    let future = varx.future_without_known_share();
    let past_rank = varx.rank(varx.past_signals());
    let svd = future.thin_svd().map_err(no_singular_values)?;
    let spread = svd.S().column_vector();
    let white = spread.iter().filter(|s| **s > WHITENING_TOLERANCE * spread[0]).count();
    let along_past: Mat<f64> = svd.U().submatrix(0, 0, past_rank, white).to_owned();
    let canonical = along_past.thin_svd().map_err(no_singular_values)?;
    let mut singular_values: Vec<f64> = canonical.S().column_vector().iter().copied().collect();
    let mut directions = Mat::zeros(future.nrows(), singular_values.len());
    directions.as_mut().subrows_mut(0, past_rank).copy_from(canonical.U());
    singular_values.resize(future.ncols(), 0.0);
    Ok(StateMap { by_past: varx.regress(varx.past_signals(), directions.as_ref())?, singular_values })
}
