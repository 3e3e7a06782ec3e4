//! PBSIDopt: predictor-based subspace identification.
//!
//! The outputs that the predictor expects from the past z(k-p) ... z(k-1) alone are, from the coefficients of the regression,
//! ```text
//! [Xi_p ... Xi_2 Xi_1; 0 Xi_p ... Xi_2; 0 0 Xi_p ...; ...] z_p = Gamma At x(k),   Gamma At = [C; C At; ...; C At^(f-1)]
//! ```
//! with the terms beyond p left out as in the regression; the states are the leading right singular vectors.
//! Assumes: no direct path from y through the controller to u and through the plant to y in the same sample, and `At^p`
//! small. The bias of the estimate is of the order `|At^p|`; the variance grows with p.
//!
//! Source: A. Chiuso, The role of vector autoregressive modeling in predictor-based subspace identification, Automatica 43,
//! 1034 (2007); review: van der Veen, van Wingerden, Bergamasco, Lovera, Verhaegen, IET Control Theory Appl. 7, 1339 (2013).

use crate::identify::subspace::predictor_form::varx::{StateMap, Varx};
use crate::{Mat, Result};

/// The states of PBSIDopt.
pub(crate) fn states(varx: &Varx) -> Result<StateMap> {
    let l = varx.outputs;
    let block = varx.inputs + l;
    let mut coefficients = Mat::zeros(varx.past_signals(), varx.horizon * l);
    for i in 0..varx.horizon.min(varx.past_signals() / block) {
        let kept = varx.past_signals() - i * block;
        coefficients.as_mut().submatrix_mut(i * block, i * l, kept, l).copy_from(varx.xi.as_ref().subrows(0, kept));
    }
    varx.states_of_prediction(coefficients.as_ref())
}
