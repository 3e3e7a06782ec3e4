//! The invariant zeros (anti-resonances) of a square system with their intervals.
//!
//! At a zero the system matrix `P(z) = [A - z I, B; C, D]` has null vectors, `w' P = 0` and `P v = 0`, so that to first order
//! ```text
//! dz = w' [dA dB; dC dD] v / (w' diag(I, 0) v)
//! ```

use super::SystemSlope;
use super::response::mode_change;
use crate::Result;
use youla::linalg::balance;
use youla::lti::modes::mode;
use youla::lti::{Discrete, Mode, StateSpace};
use youla::{Error, Mat, MatRef, c64};

/// The zeros of a system as modes, in the order of their frequencies, with what changes of the system make of each.
pub(super) fn zero_changes(
    model: &StateSpace<Discrete>,
    changes: &[SystemSlope],
) -> Result<Vec<(Mode, Vec<[f64; 2]>)>> {
    let (inputs, outputs) = (model.inputs(), model.outputs());
    if inputs != outputs {
        let what = "the number of inputs for the zeros".into();
        return Err(Error::Ports { what, expected: outputs, found: inputs }.into());
    }
    let scaling = Scaling::new(model)?;
    let matrix = scaling.joined([model.a(), model.b(), model.c(), model.d()]);
    let moved: Vec<Mat<f64>> =
        changes.iter().map(|d| scaling.joined([d.a.as_ref(), d.b.as_ref(), d.c.as_ref(), d.d.as_ref()])).collect();
    let mut zeros: Vec<Mode> =
        model.zeros()?.into_iter().filter(|z| z.im >= 0.0).map(|z| mode(model.time(), z)).collect();
    zeros.sort_by(|l, r| l.hz.total_cmp(&r.hz).then(l.zeta.total_cmp(&r.zeta)));
    let with_changes = |zero: Mode| {
        let change = null_vectors(&matrix, model.order(), zero.pole)?;
        let of = |moved: &Mat<f64>| mode_change(zero.pole, change.of(moved), model.time());
        Ok((zero, moved.iter().map(of).collect()))
    };
    zeros.into_iter().map(with_changes).collect()
}

/// Balanced states, inputs and outputs of about the size of A: the zeros are the same.
struct Scaling {
    states: Vec<f64>,
    input: f64,
    output: f64,
}

impl Scaling {
    fn new(model: &StateSpace<Discrete>) -> Result<Self> {
        let states = balance("the state matrix", model.a())?.scale;
        let scaled = model.with_scaled_states(&states);
        let per = |size: f64| if size > 0.0 { 1.0 / size } else { 1.0 };
        Ok(Scaling { input: per(scaled.b().norm_max()), output: per(scaled.c().norm_max()), states })
    }

    /// `[A B; C D]`.
    fn joined(&self, [a, b, c, d]: [MatRef<'_, f64>; 4]) -> Mat<f64> {
        let n = self.states.len();
        Mat::from_fn(n + c.nrows(), n + b.ncols(), |i, j| match (i < n, j < n) {
            (true, true) => a[(i, j)] * self.states[j] / self.states[i],
            (true, false) => b[(i, j - n)] * self.input / self.states[i],
            (false, true) => c[(i - n, j)] * self.output * self.states[j],
            (false, false) => d[(i - n, j - n)] * self.input * self.output,
        })
    }
}

/// w and v, scaled to `w' diag(I, 0) v = 1`.
struct NullVectors {
    left: Vec<c64>,
    right: Vec<c64>,
}

impl NullVectors {
    fn of(&self, moved: &Mat<f64>) -> c64 {
        let row = |i: usize| {
            let product = |sum: c64, j: usize| sum + self.right[j] * moved[(i, j)];
            (0..moved.ncols()).fold(c64::new(0.0, 0.0), product)
        };
        (0..moved.nrows()).fold(c64::new(0.0, 0.0), |sum, i| sum + self.left[i] * row(i))
    }
}

fn null_vectors(matrix: &Mat<f64>, n: usize, zero: c64) -> Result<NullVectors> {
    let size = matrix.nrows();
    let shifted = |i: usize, j: usize| if i == j && i < n { zero } else { c64::new(0.0, 0.0) };
    let pencil = Mat::from_fn(size, size, |i, j| c64::new(matrix[(i, j)], 0.0) - shifted(i, j));
    let failed = |_| Error::NoConvergence { what: "the null vectors at a zero".into(), iterations: 0 };
    let svd = pencil.svd().map_err(failed)?;
    let left: Vec<c64> = (0..size).map(|i| svd.U()[(i, size - 1)].conj()).collect();
    let right: Vec<c64> = (0..size).map(|i| svd.V()[(i, size - 1)]).collect();
    let product = (0..n).fold(c64::new(0.0, 0.0), |sum, i| sum + left[i] * right[i]);
    Ok(NullVectors { left: left.into_iter().map(|w| w / product).collect(), right })
}
