//! The one-step predictor as a regression on the past: a vector autoregression with inputs, and what is shared by the
//! methods that start from it.
//!
//! With `z = [u; y]`, the innovations e, `At = A - K C` and `Bt = [B - K D, K]`,
//! ```text
//! y(k) = sum_{i=1..p} Xi_i z(k-i) + D u(k) + e(k),    Xi_i = C At^(i-1) Bt,    error of the sum: C At^p x(k-p)
//! ```
//! The noise in this equation is white and enters the inputs only later, so that feedback does not bias the regression.
//! All sequences are columns of one triangular factor of `[z(k-p) ... z(k) ... z(k+f-1)]`, oldest first: whatever is
//! regressed on the past needs the leading part of it, and a state `x(k) = T [z(k-p); ...; z(k-1)]` is known one sample
//! later from the columns one block further on.

use crate::identify::subspace::open_loop::hankel::require_excitation;
use crate::identify::subspace::triangle::factorisation::HankelLq;
use crate::identify::subspace::triangle::hankel_layout::HankelLayout;
use crate::identify::subspace::{DataFactor, Factorisation, SubspaceOptions};
use crate::linalg::{leading_rank, least_squares};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// The factor, where its blocks are, and the predictor.
pub(crate) struct Varx {
    r: Mat<f64>,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    /// Block rows p and f.
    past: usize,
    pub(crate) horizon: usize,
    /// Columns of the Hankel matrix.
    pub(crate) columns: usize,
    /// Per output, the inputs whose entries of D are sought.
    pub(crate) direct: Vec<Vec<usize>>,
    /// How R was found.
    pub(crate) report: DataFactor,
    /// `Xi_p ... Xi_1`, transposed: a row per past signal, oldest first.
    pub(crate) xi: Mat<f64>,
    /// D transposed, zero where it is not sought.
    d: Mat<f64>,
}

/// How the state is read from the past, and the singular values it came with.
pub(crate) struct StateMap {
    /// A column per state, by falling singular value: `x(k)' = [z(k-p)' ... z(k-1)'] T'`.
    pub(crate) by_past: Mat<f64>,
    /// Descending, horizon x outputs of them.
    pub(crate) singular_values: Vec<f64>,
}

impl Varx {
    pub(crate) fn new(data: &HankelLq, options: &SubspaceOptions) -> Result<Self> {
        let (inputs, outputs, columns, report) = (data.inputs, data.outputs, data.columns, data.report);
        let (past, horizon) = options.block_rows();
        let r = data.arranged(HankelLayout::Chronological, past, horizon)?;
        let direct = options.feedthrough.inputs_of_outputs(inputs, outputs);
        let (xi, d) = (Mat::zeros(0, 0), Mat::zeros(inputs, outputs));
        let mut varx = Varx { r, inputs, outputs, past, horizon, columns, direct, report, xi, d };
        (varx.xi, varx.d) = varx.present()?;
        Ok(varx)
    }

    /// `y(k)` on the past and, output by output, on those of the inputs `u(k)` that reach it: first D from what the past
    /// leaves of both, then the rest from the past. Coefficients of the past and D, transposed.
    fn present(&self) -> Result<(Mat<f64>, Mat<f64>)> {
        let past = self.past_signals();
        let (u, y) = (self.inputs_at(0), self.outputs_at(0));
        let (from, to) = (self.rank(past), self.rank(past + self.inputs));
        let mut d = Mat::zeros(self.inputs, self.outputs);
        for (i, inputs) in self.direct.iter().enumerate() {
            let beyond = Mat::from_fn(to - from, inputs.len(), |row, j| u[(from + row, inputs[j])]);
            let target = y.submatrix(from, i, to - from, 1);
            let found = least_squares("the inputs beyond the past", beyond.as_ref(), target)?.x;
            inputs.iter().enumerate().for_each(|(j, input)| d[(*input, i)] = found[(j, 0)]);
        }
        let by_past = self.regress(past, (y - u * &d).as_ref())?;
        Ok((by_past, d))
    }

    /// Number of past signals, p (m + l).
    pub(crate) fn past_signals(&self) -> usize {
        self.past * self.channels()
    }

    fn channels(&self) -> usize {
        self.inputs + self.outputs
    }

    /// Reciprocal condition number of the inputs' Hankel matrix with rows of unit length.
    pub(crate) fn require_excitation(&self) -> Result<f64> {
        let (m, q) = (self.inputs, self.channels());
        let inputs =
            Mat::from_fn(self.r.nrows(), (self.past + self.horizon) * m, |i, j| self.r[(i, j / m * q + j % m)]);
        require_excitation(inputs.as_ref(), m)
    }

    /// The past signals that a state at time k + `later` is read from, transposed: a column per signal.
    pub(crate) fn past(&self, later: usize) -> MatRef<'_, f64> {
        self.r.as_ref().subcols(later * self.channels(), self.past_signals())
    }

    /// `u(k + i)`, transposed.
    pub(crate) fn inputs_at(&self, i: usize) -> MatRef<'_, f64> {
        self.r.as_ref().subcols(self.past_signals() + i * self.channels(), self.inputs)
    }

    /// `y(k + i)`, transposed.
    pub(crate) fn outputs_at(&self, i: usize) -> MatRef<'_, f64> {
        self.r.as_ref().subcols(self.past_signals() + i * self.channels() + self.inputs, self.outputs)
    }

    /// `z(k + i)`, transposed.
    fn signals_at(&self, i: usize) -> MatRef<'_, f64> {
        self.r.as_ref().subcols(self.past_signals() + i * self.channels(), self.channels())
    }

    /// `Xi_i`, transposed, for i up to p.
    fn xi(&self, i: usize) -> MatRef<'_, f64> {
        self.xi.as_ref().subrows((self.past - i) * self.channels(), self.channels())
    }

    /// Directions that the leading columns span; they are the leading rows.
    pub(crate) fn rank(&self, columns: usize) -> usize {
        leading_rank(self.r.as_ref(), columns)
    }

    /// Coefficients of columns of the factor on its `count` leading columns, of least norm where these are dependent.
    pub(super) fn regress(&self, count: usize, targets: MatRef<'_, f64>) -> Result<Mat<f64>> {
        if self.report.by == Factorisation::Gram {
            let mut found = targets.subrows(0, count).to_owned();
            self.r.as_ref().submatrix(0, 0, count, count).solve_upper_triangular_in_place(found.as_mut());
            return Ok(found);
        }
        let rank = self.rank(count);
        let leading = self.r.as_ref().submatrix(0, 0, rank, count);
        Ok(least_squares("the past inputs and outputs", leading, targets.subrows(0, rank))?.x)
    }

    /// `y(k+i) - D u(k+i) - sum_{j=1..i} Xi_j z(k+i-j)`, i < f, transposed: what the predictor takes from the past alone,
    /// and the innovation.
    pub(crate) fn future_without_known_share(&self) -> Mat<f64> {
        let l = self.outputs;
        let mut rest = Mat::zeros(self.r.nrows(), self.horizon * l);
        for i in 0..self.horizon {
            let mut share = self.outputs_at(i) - self.inputs_at(i) * &self.d;
            for j in 1..=i.min(self.past) {
                share -= self.signals_at(i - j) * self.xi(j);
            }
            rest.as_mut().subcols_mut(i * l, l).copy_from(share);
        }
        rest
    }

    /// States from the singular value decomposition `T Z_p = U S V'` of future outputs as the past predicts them, given
    /// by their coefficients on the past signals (transposed): `x = U' T z_p`.
    pub(crate) fn states_of_prediction(&self, coefficients: MatRef<'_, f64>) -> Result<StateMap> {
        let rank = self.rank(self.past_signals());
        let predicted = self.past(0).subrows(0, rank) * coefficients;
        let svd = predicted.thin_svd().map_err(no_singular_values)?;
        let by_past = coefficients * svd.V();
        let mut singular_values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        singular_values.resize(coefficients.ncols(), 0.0);
        Ok(StateMap { by_past, singular_values })
    }
}

pub(crate) fn no_singular_values<E>(_: E) -> Error {
    Error::NoConvergence { what: "the singular values of the predicted outputs".into(), iterations: 0 }
}
