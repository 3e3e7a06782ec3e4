//! From the states of a method that starts from the predictor to A, C, the innovations and the Kalman gain.
//!
//! ```text
//! y(k) = C x(k) + D u(k) + e(k),    then    x(k+1) = A x(k) + B u(k) + K e(k) + rest
//! ```
//! by two regressions. Because the innovations stand beside the inputs in the second, a controller that answers to y(k) in
//! u(k) does not bias it. K comes from the covariance of `[K e + rest; e]` by a Riccati equation: this is the K of the
//! regression where A - K C is stable and the rest is small, and gives a stable predictor always.

use super::factorisation::DataTriangle;
use super::innovation::{self, Innovation};
use super::order::{Evidence, choose};
use super::realisation::OutputPair;
use super::varx::{StateMap, Varx};
use super::{Estimate, SubspaceOptions, Weight, parsim, pbsid, ssarx, stability};
use crate::linalg::{block, least_squares};
use crate::lti::Discrete;
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// A, C and the innovations by the method that the weight names.
pub(super) fn estimate(data: &DataTriangle, options: &SubspaceOptions, time: Discrete) -> Result<Estimate> {
    let varx = Varx::new(data, options)?;
    let excitation_rcond = varx.require_excitation()?;
    let canonical = ssarx::states(&varx)?;
    let canonical_correlations = canonical.singular_values.clone();
    let map = if options.weight == Weight::Ssarx { canonical } else { states(&varx, options.weight)? };
    let order = choose(
        options.order,
        Evidence {
            inputs: varx.inputs,
            outputs: varx.outputs,
            horizon: varx.horizon,
            columns: varx.columns,
            singular_values: &map.singular_values,
            canonical_correlations,
        },
    )?;
    let sequences = Sequences::new(&varx, &map, order.order)?;
    let (pair, stability) = stability::apply(options.stability, sequences.realise()?, time)?;
    let innovation = sequences.innovation(&pair);
    Ok(Estimate {
        pair,
        stability,
        innovation,
        singular_values: map.singular_values,
        order,
        columns: varx.columns,
        excitation_rcond,
        factor: varx.report,
    })
}

/// A and C alone for a given order, with the Kalman gain where it is asked for.
pub(super) fn pair_and_gain(
    data: &DataTriangle,
    options: &SubspaceOptions,
    order: usize,
    with_gain: bool,
) -> Result<(OutputPair, Option<Mat<f64>>)> {
    let varx = Varx::new(data, options)?;
    let sequences = Sequences::new(&varx, &states(&varx, options.weight)?, order)?;
    let pair = sequences.realise()?;
    let gain = if with_gain { sequences.innovation(&pair).gain().map(|gain| gain.to_owned()) } else { None };
    Ok((pair, gain))
}

fn states(varx: &Varx, weight: Weight) -> Result<StateMap> {
    match weight {
        Weight::PbsidOpt => pbsid::states(varx),
        Weight::ParsimS => parsim::states(varx),
        _ => ssarx::states(varx),
    }
}

/// The sequences of the two equations in the coordinates of the triangular factor, transposed.
struct Sequences<'a> {
    x: Mat<f64>,
    x_next: Mat<f64>,
    u: MatRef<'a, f64>,
    y: MatRef<'a, f64>,
    feedthrough: bool,
    columns: usize,
}

impl<'a> Sequences<'a> {
    fn new(varx: &'a Varx, map: &StateMap, order: usize) -> Result<Self> {
        let largest = map.by_past.ncols();
        if order > largest {
            return Err(Error::OrderBeyondHorizon { order, largest, horizon: varx.horizon });
        }
        let by_past = map.by_past.as_ref().subcols(0, order);
        Ok(Sequences {
            x: varx.past(0) * by_past,
            x_next: varx.past(1) * by_past,
            u: varx.inputs_at(0),
            y: varx.outputs_at(0),
            feedthrough: varx.feedthrough,
            columns: varx.columns,
        })
    }

    /// A and C.
    fn realise(&self) -> Result<OutputPair> {
        let n = self.x.ncols();
        let present =
            block(&[&[self.x.as_ref(), self.u.subcols(0, if self.feedthrough { self.u.ncols() } else { 0 })]]);
        let output = least_squares("the states", present.as_ref(), self.y)?.x;
        let e = self.y - &present * &output;
        let regressors = block(&[&[self.x.as_ref(), self.u, e.as_ref()]]);
        let state = least_squares("the states, inputs and innovations", regressors.as_ref(), self.x_next.as_ref())?.x;
        let leading = |rows: &Mat<f64>| rows.as_ref().subrows(0, n).transpose().to_owned();
        Ok(OutputPair { a: leading(&state), c: leading(&output) })
    }

    fn innovation(&self, pair: &OutputPair) -> Innovation {
        innovation::identify(self.residuals(pair), self.y, self.columns, pair)
    }

    /// `[K e + rest, e]` for given A and C.
    fn residuals(&self, pair: &OutputPair) -> Result<Mat<f64>> {
        let mut e = self.y - &self.x * pair.c.transpose();
        if self.feedthrough {
            let d = least_squares("the inputs", self.u, e.as_ref())?.x;
            e -= self.u * d;
        }
        let w = &self.x_next - &self.x * pair.a.transpose();
        let beside = block(&[&[self.u, e.as_ref()]]);
        let found = least_squares("the inputs and innovations", beside.as_ref(), w.as_ref())?.x;
        let w = w - self.u * found.as_ref().subrows(0, self.u.ncols());
        Ok(block(&[&[w.as_ref(), e.as_ref()]]))
    }
}
