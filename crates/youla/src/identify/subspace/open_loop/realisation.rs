//! A and C, from the shift of the observability matrix or by regression of the state sequence.
//!
//! All sequences are held in the coordinates of the triangular factor: a row per direction instead of one per sample.

use crate::Result;
use crate::identify::subspace::SubspaceMethod;
use crate::identify::subspace::open_loop::hankel::HankelFactor;
use crate::identify::subspace::output_pair::OutputPair;
use crate::linalg::{block, regress};
use faer::{Mat, MatRef};

/// Sequences of the state equation `[x+; y] = [A; C] x + (..) U_f + [w; v]`, transposed: rows are directions.
pub(crate) struct StateSequences<'a> {
    /// Observability matrix with orthonormal columns, s p x n.
    pub(crate) gamma: MatRef<'a, f64>,
    /// State now, and what the future inputs add to it.
    pub(crate) x: Mat<f64>,
    /// `[x+ y]`: state one sample later and output now.
    pub(crate) target: Mat<f64>,
    /// Future inputs.
    pub(crate) u_future: MatRef<'a, f64>,
    /// Number of outputs.
    pub(crate) outputs: usize,
}

impl<'a> StateSequences<'a> {
    /// `Gamma^+ Z_i` and `Gamma_{s-1}^+ Z_{i+1}` (Van Overschee and De Moor, section 4.3).
    pub(crate) fn new(factor: &'a HankelFactor, gamma: MatRef<'a, f64>) -> Result<Self> {
        let shorter = gamma.subrows(0, gamma.nrows() - factor.outputs);
        let present = factor.present_outputs();
        let mut x = Mat::zeros(present.nrows(), gamma.ncols());
        let now = factor.future_projected();
        x.as_mut().subrows_mut(0, now.nrows()).copy_from(now * gamma);
        let later = factor.later_future_projected();
        let x_next = regress("the shortened observability matrix", shorter, later.transpose())?;
        let target = block(&[&[x_next.transpose(), present]]);
        Ok(StateSequences { gamma, x, target, u_future: factor.future_inputs(), outputs: factor.outputs })
    }

    /// Output now.
    pub(crate) fn present_outputs(&self) -> MatRef<'_, f64> {
        self.target.as_ref().subcols(self.gamma.ncols(), self.outputs)
    }

    /// Residuals `[w v]` for given A and C, with the best share of the future inputs taken off.
    pub(crate) fn residuals(&self, pair: &OutputPair) -> Result<Mat<f64>> {
        let explained = block(&[&[pair.a.transpose(), pair.c.transpose()]]);
        let rest = &self.target - &self.x * explained;
        let by_inputs = regress("the future inputs", self.u_future, rest.as_ref())?;
        Ok(rest - self.u_future * by_inputs)
    }
}

/// A and C in the way of the weight.
pub(crate) fn realise(method: SubspaceMethod, factor: &HankelFactor, gamma: MatRef<'_, f64>) -> Result<OutputPair> {
    match method {
        SubspaceMethod::N4sid => regression(&StateSequences::new(factor, gamma)?),
        _ => shift(gamma, factor.outputs),
    }
}

/// `C = Gamma(1:p, :)`, `Gamma(1:end-p, :) A = Gamma(p+1:end, :)`.
fn shift(gamma: MatRef<'_, f64>, p: usize) -> Result<OutputPair> {
    let rows = gamma.nrows() - p;
    let a = regress("the observability matrix", gamma.subrows(0, rows), gamma.subrows(p, rows))?;
    Ok(OutputPair { a, c: gamma.subrows(0, p).to_owned() })
}

/// `[x+; y] = [A; C] x + K U_f`, all three unknown.
fn regression(states: &StateSequences<'_>) -> Result<OutputPair> {
    let n = states.gamma.ncols();
    let regressors = block(&[&[states.x.as_ref(), states.u_future]]);
    let found = regress("the state sequence", regressors.as_ref(), states.target.as_ref())?;
    let a = found.as_ref().submatrix(0, 0, n, n).transpose().to_owned();
    let c = found.as_ref().submatrix(0, n, n, states.outputs).transpose().to_owned();
    Ok(OutputPair { a, c })
}
