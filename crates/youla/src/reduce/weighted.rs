//! Frequency-weighted balancing: D. F. Enns, Model reduction with balanced realizations: an error bound and a frequency weighted
//! generalization, Proc. 23rd IEEE Conf. Decision and Control, 1984, 127.
//!
//! ```text
//! minimise || W_o (G - G_r) W_i ||        P: leading block of the reachability Gramian of G W_i
//!                                         Q: leading block of the observability Gramian of W_o G
//! ```
//!
//! With the states of G first, the leading blocks of the triangular factors of the two Gramians are the factors of P and Q.

use super::balanced::{HankelDecomposition, factor};
use crate::Result;
use crate::linalg::block;
use crate::lti::{StateSpace, TimeDomain};
use faer::{Mat, MatRef};

/// Stable weights of an error: `W_o (G - G_r) W_i`.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyWeights<T: TimeDomain> {
    /// `W_o`, as many inputs as G has outputs.
    pub output: StateSpace<T>,
    /// `W_i`, as many outputs as G has inputs.
    pub input: StateSpace<T>,
}

/// Decomposes a stable system with weights.
pub(super) fn decompose<T: TimeDomain>(
    system: StateSpace<T>,
    weights: &FrequencyWeights<T>,
) -> Result<HankelDecomposition<T>> {
    weights.output.require_stable("the weight at the outputs")?;
    weights.input.require_stable("the weight at the inputs")?;
    let reachable = leading_factor(&system, &weights.input)?;
    let observable = leading_factor(&system.dual(), &weights.output.dual())?;
    HankelDecomposition::from_factors(system, &reachable, &observable)
}

/// Factor of the reachability Gramian of `G W` for the states of G.
fn leading_factor<T: TimeDomain>(system: &StateSpace<T>, weight: &StateSpace<T>) -> Result<Mat<f64>> {
    let joined = weight.then(system)?; // Ports and sample times fit.
    let n = system.order();
    let lower_left = Mat::zeros(weight.order(), n);
    let driven = system.b() * weight.c();
    let a = block(&[&[system.a(), driven.as_ref()], &[lower_left.as_ref(), weight.a()]]);
    let b: MatRef<'_, f64> = joined.b();
    let b = block(&[&[b.subrows(weight.order(), n)], &[b.subrows(0, weight.order())]]);
    Ok(factor(system.time(), a.as_ref(), b.as_ref())?.submatrix(0, 0, n, n).to_owned())
}
