//! From the states of a method that starts from the predictor to A, C, the innovations and the Kalman gain.
//!
//! ```text
//! y(k) = C x(k) + D u(k) + e(k),    then    x(k+1) = A x(k) + B u(k) + K e(k) + rest
//! ```
//! by two regressions. Because the innovations are beside the inputs in the second, a controller that answers to y(k) in
//! u(k) does not bias it. K comes from the covariance of `[K e + rest; e]` by a Riccati equation: this is the K of the
//! regression where A - K C is stable and the rest is small, and gives a stable predictor always.

mod pbsid;
mod ssarx;
mod varx;

use crate::error::OrderLimit;
use crate::identify::subspace::innovation::{self, Innovation};
use crate::identify::subspace::order::Evidence;
use crate::identify::subspace::output_pair::OutputPair;
use crate::identify::subspace::predictor_form::varx::{StateMap, Varx};
use crate::identify::subspace::triangle::factorisation::HankelLq;
use crate::identify::subspace::{SubspaceMethod, SubspaceOptions};
use crate::linalg::{block, regress};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// The states of the method that the weight names.
pub(super) struct PredictorForm {
    pub(super) varx: Varx,
    pub(super) map: StateMap,
    pub(super) excitation_rcond: f64,
    canonical_correlations: Vec<f64>,
}

impl PredictorForm {
    pub(super) fn new(data: &HankelLq, options: &SubspaceOptions) -> Result<Self> {
        let varx = Varx::new(data, options)?;
        let excitation_rcond = varx.require_excitation()?;
        let canonical = ssarx::states(&varx)?;
        let canonical_correlations = canonical.singular_values.clone();
        let map = match options.method {
            SubspaceMethod::PbsidOpt => pbsid::states(&varx)?,
            _ => canonical,
        };
        Ok(PredictorForm { varx, map, excitation_rcond, canonical_correlations })
    }

    pub(super) fn evidence(&self) -> Evidence {
        let varx = &self.varx;
        Evidence {
            inputs: varx.inputs,
            outputs: varx.outputs,
            horizon: varx.horizon,
            columns: varx.columns,
            canonical_correlations: self.canonical_correlations.clone(),
        }
    }

    /// A and C.
    pub(super) fn realise(&self, order: usize) -> Result<OutputPair> {
        Sequences::new(&self.varx, &self.map, order)?.realise()
    }

    /// From the residuals of both equations with given A and C.
    pub(super) fn innovation(&self, pair: &OutputPair) -> Result<Innovation> {
        Ok(Sequences::new(&self.varx, &self.map, pair.a.nrows())?.innovation(pair))
    }
}

/// The sequences of the two equations in the coordinates of the triangular factor, transposed.
struct Sequences<'a> {
    x: Mat<f64>,
    x_next: Mat<f64>,
    u: MatRef<'a, f64>,
    y: MatRef<'a, f64>,
    /// Per output, the inputs whose entries of D are sought.
    direct: &'a [Vec<usize>],
    columns: usize,
}

impl<'a> Sequences<'a> {
    fn new(varx: &'a Varx, map: &StateMap, order: usize) -> Result<Self> {
        let largest = map.by_past.ncols();
        if order > largest {
            return Err(Error::Order { order, limit: OrderLimit::Horizon { largest, horizon: varx.horizon } });
        }
        let by_past = map.by_past.as_ref().subcols(0, order);
        Ok(Sequences {
            x: varx.past(0) * by_past,
            x_next: varx.past(1) * by_past,
            u: varx.inputs_at(0),
            y: varx.outputs_at(0),
            direct: &varx.direct,
            columns: varx.columns,
        })
    }

    /// A and C.
    fn realise(&self) -> Result<OutputPair> {
        let n = self.x.ncols();
        let (mut c, mut e) = (Mat::zeros(n, self.y.ncols()), self.y.to_owned());
        for i in 0..self.y.ncols() {
            let present = block(&[&[self.x.as_ref(), self.inputs_of(i).as_ref()]]);
            let output = regress("the states", present.as_ref(), self.y.subcols(i, 1))?;
            e.as_mut().subcols_mut(i, 1).copy_from(self.y.subcols(i, 1) - &present * &output);
            c.as_mut().subcols_mut(i, 1).copy_from(output.subrows(0, n));
        }
        let regressors = block(&[&[self.x.as_ref(), self.u, e.as_ref()]]);
        let state = regress("the states, inputs and innovations", regressors.as_ref(), self.x_next.as_ref())?;
        Ok(OutputPair { a: state.subrows(0, n).transpose().to_owned(), c: c.transpose().to_owned() })
    }

    /// The inputs that reach output i in the same sample.
    fn inputs_of(&self, i: usize) -> Mat<f64> {
        Mat::from_fn(self.u.nrows(), self.direct[i].len(), |k, j| self.u[(k, self.direct[i][j])])
    }

    fn innovation(&self, pair: &OutputPair) -> Innovation {
        innovation::identify(self.residuals(pair), self.y, self.columns, pair)
    }

    /// `[K e + rest, e]` for given A and C.
    fn residuals(&self, pair: &OutputPair) -> Result<Mat<f64>> {
        let mut e = self.y - &self.x * pair.c.transpose();
        for i in 0..e.ncols() {
            let u = self.inputs_of(i);
            let d = regress("the inputs", u.as_ref(), e.as_ref().subcols(i, 1))?;
            let mut rest = e.as_mut().subcols_mut(i, 1);
            rest -= u * d;
        }
        let w = &self.x_next - &self.x * pair.a.transpose();
        let beside = block(&[&[self.u, e.as_ref()]]);
        let found = regress("the inputs and innovations", beside.as_ref(), w.as_ref())?;
        let w = w - self.u * found.as_ref().subrows(0, self.u.ncols());
        Ok(block(&[&[w.as_ref(), e.as_ref()]]))
    }
}
