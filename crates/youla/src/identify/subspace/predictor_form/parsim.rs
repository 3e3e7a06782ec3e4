//! PARSIM-S: one regression per future block row, each with inputs up to its own time only.
//!
//! Row i of the future, with the Markov parameters `H_0 = D, H_i = C A^(i-1) B` that the rows before have given,
//! ```text
//! y(k+i) - sum_{j<i} H_j u(k+i-j) = C A^i T z_p + H_i u(k) + noise of k ... k+i
//! ```
//! is regressed on z_p = [z(k-p); ...; z(k-1)] and u(k) alone, which the noise from k on does not reach if the controller
//! delays y by at least one sample. This is the causal form in which open-loop methods become usable in such loops. The
//! rows grow as A^i, the noise with them: for an unstable plant keep the horizon short. A controller that answers in the
//! same sample biases PARSIM-S, but not PBSIDopt and SSARX.
//!
//! Source: S. J. Qin, W. Lin, L. Ljung, A novel subspace identification approach with enforced causal models,
//! Automatica 41, 2043 (2005). The states then give A, B, C and K as in PBSIDopt.

use crate::Result;
use crate::identify::subspace::predictor_form::varx::{StateMap, Varx};
use faer::{Mat, MatRef};

/// The states of PARSIM-S.
pub(crate) fn states(varx: &Varx) -> Result<StateMap> {
    let (past, m, l) = (varx.past_signals(), varx.inputs, varx.outputs);
    let mut coefficients = Mat::zeros(past, varx.horizon * l);
    let mut markov: Vec<Mat<f64>> = Vec::new();
    // The first row sees u(k) only through the entries of D that are sought.
    let present = varx.present()?;
    coefficients.as_mut().subcols_mut(0, l).copy_from(present.by_past);
    markov.push(present.d);
    for i in 1..varx.horizon {
        let rest = without_inputs(varx, &markov, i);
        let found = varx.regress(past + m, rest.as_ref())?;
        coefficients.as_mut().subcols_mut(i * l, l).copy_from(found.as_ref().subrows(0, past));
        markov.push(found.subrows(past, m).to_owned());
    }
    varx.states_of_prediction(coefficients.as_ref())
}

/// `y(k+i) - sum_{j<i} H_j u(k+i-j)`, transposed.
fn without_inputs(varx: &Varx, markov: &[Mat<f64>], i: usize) -> Mat<f64> {
    let share = |rest: Mat<f64>, (j, h): (usize, &Mat<f64>)| rest - varx.inputs_at(i - j) * h;
    let outputs: MatRef<'_, f64> = varx.outputs_at(i);
    markov.iter().enumerate().fold(outputs.to_owned(), share)
}
