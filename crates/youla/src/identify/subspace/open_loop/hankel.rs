//! `[U_f; U_p; Y_p; Y_f]' = Q R` for the open-loop methods.

use crate::identify::subspace::DataFactor;
use crate::identify::subspace::triangle::factorisation::HankelLq;
use crate::identify::subspace::triangle::hankel_layout::HankelLayout;
use crate::linalg::{leading_rank, triangular_condition};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Condition number below which no exact one is needed to know that the inputs are exciting.
pub(crate) const FAR_FROM_DEPENDENT: f64 = 1e8;

/// The factor R and where its blocks are.
pub(crate) struct HankelFactor {
    r: Mat<f64>,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    /// Block rows of the past and of the future.
    past: usize,
    pub(crate) horizon: usize,
    /// Columns of the Hankel matrices.
    pub(crate) columns: usize,
    /// Directions spanned by `[U_f; U_p]`, and with `Y_p`, and with the first block row of `Y_f`.
    input_rank: usize,
    past_rank: usize,
    present_rank: usize,
    /// How R was found.
    pub(crate) report: DataFactor,
}

impl HankelFactor {
    pub(crate) fn new(data: &HankelLq, past: usize, horizon: usize) -> Result<Self> {
        let (inputs, outputs, columns, report) = (data.inputs, data.outputs, data.columns, data.report);
        let r = data.arranged(HankelLayout::InputsFirst, past, horizon)?;
        let all_inputs = (past + horizon) * inputs;
        let before_future = all_inputs + past * outputs;
        let rank = |columns| leading_rank(r.as_ref(), columns);
        let (input_rank, past_rank, present_rank) =
            (rank(all_inputs), rank(before_future), rank(before_future + outputs));
        Ok(HankelFactor { inputs, outputs, past, horizon, columns, input_rank, past_rank, present_rank, r, report })
    }

    /// Reciprocal condition number of the inputs' Hankel matrix with rows of unit length.
    pub(crate) fn require_excitation(&self) -> Result<f64> {
        let needed = (self.past + self.horizon) * self.inputs;
        let inputs = self.r.as_ref().submatrix(0, 0, needed.min(self.r.nrows()), needed);
        require_excitation(inputs, self.inputs)
    }

    /// `R32`: what the past inputs and outputs tell about the future outputs beyond the future inputs, transposed.
    pub(crate) fn future_by_past(&self) -> MatRef<'_, f64> {
        self.future_outputs().subrows(self.input_start(), self.past_rank - self.input_start())
    }

    /// The future outputs without what the future inputs explain, transposed: `[R32; R33]`.
    pub(crate) fn future_beyond_inputs(&self) -> MatRef<'_, f64> {
        self.future_outputs().subrows(self.input_start(), self.r.nrows() - self.input_start())
    }

    /// Projection of the future outputs onto past and inputs, transposed.
    pub(crate) fn future_projected(&self) -> MatRef<'_, f64> {
        self.future_outputs().subrows(0, self.past_rank)
    }

    /// Projection of the future outputs but for their first block row onto past, inputs and that block row, transposed.
    pub(crate) fn later_future_projected(&self) -> MatRef<'_, f64> {
        let future = self.future_outputs();
        future.submatrix(0, self.outputs, self.present_rank, future.ncols() - self.outputs)
    }

    /// First block row of the future outputs, transposed.
    pub(crate) fn present_outputs(&self) -> MatRef<'_, f64> {
        self.future_outputs().submatrix(0, 0, self.present_rank, self.outputs)
    }

    /// The future inputs, transposed.
    pub(crate) fn future_inputs(&self) -> MatRef<'_, f64> {
        self.r.as_ref().submatrix(0, 0, self.present_rank, self.horizon * self.inputs)
    }

    fn future_outputs(&self) -> MatRef<'_, f64> {
        let count = self.horizon * self.outputs;
        self.r.as_ref().subcols(self.r.ncols() - count, count)
    }

    /// First direction beyond the future inputs.
    fn input_start(&self) -> usize {
        (self.horizon * self.inputs).min(self.input_rank)
    }
}

/// Reciprocal condition number of the inputs' Hankel matrix with rows of unit length, from their columns of R: an estimate
/// where they are far from dependent.
pub(crate) fn require_excitation(inputs: MatRef<'_, f64>, channels: usize) -> Result<f64> {
    let needed = inputs.ncols();
    let length: Vec<f64> = inputs.col_iter().map(|column| column.norm_l2().max(f64::MIN_POSITIVE)).collect();
    let unit = Mat::from_fn(inputs.nrows(), needed, |i, j| inputs[(i, j)] / length[j]);
    if unit.nrows() >= needed {
        let is_triangle = unit.col_iter().enumerate().all(|(j, column)| column.iter().skip(j + 1).all(|v| *v == 0.0));
        let condition = match is_triangle {
            true => triangular_condition(unit.subrows(0, needed).transpose()),
            false => triangular_condition(unit.qr().thin_R().transpose()),
        };
        if condition < FAR_FROM_DEPENDENT {
            return Ok(1.0 / condition);
        }
    }
    let sigma = unit.singular_values().map_err(|_| Error::NoConvergence {
        what: "the singular values of the input Hankel matrix".into(),
        iterations: 0,
    })?;
    let rank = sigma.iter().filter(|s| **s > 1e-12 * sigma[0]).count();
    if rank < needed {
        return Err(Error::InsufficientExcitation {
            what: "the set of inputs".into(),
            block_rows: needed / channels.max(1),
            rank,
            needed,
        });
    }
    Ok(sigma[needed - 1] / sigma[0])
}
