//! MOESP, N4SID and CVA: A and C from the projection of the future outputs along the past, beyond the future inputs.

pub(crate) mod hankel;
mod projection;
mod realisation;

use crate::error::OrderLimit;
use crate::identify::subspace::innovation::{self, Innovation};
use crate::identify::subspace::open_loop::hankel::HankelFactor;
use crate::identify::subspace::open_loop::projection::{Projection, canonical_correlations, project};
use crate::identify::subspace::open_loop::realisation::{StateSequences, realise};
use crate::identify::subspace::order::Evidence;
use crate::identify::subspace::output_pair::OutputPair;
use crate::identify::subspace::triangle::factorisation::HankelLq;
use crate::identify::subspace::{SubspaceMethod, SubspaceOptions};
use crate::{Error, Result};
use faer::MatRef;

/// The projection that the weight names.
pub(super) struct OpenLoop {
    pub(super) factor: HankelFactor,
    pub(super) projection: Projection,
    pub(super) excitation_rcond: f64,
    method: SubspaceMethod,
}

impl OpenLoop {
    pub(super) fn new(data: &HankelLq, options: &SubspaceOptions) -> Result<Self> {
        let (past, horizon) = options.block_rows();
        let factor = HankelFactor::new(data, past, horizon)?;
        let (excitation_rcond, projection) =
            rayon::join(|| factor.require_excitation(), || project(&factor, options.method));
        let (excitation_rcond, projection) = (excitation_rcond?, projection?);
        Ok(OpenLoop { factor, projection, excitation_rcond, method: options.method })
    }

    pub(super) fn evidence(&self) -> Result<Evidence> {
        let factor = &self.factor;
        Ok(Evidence {
            inputs: factor.inputs,
            outputs: factor.outputs,
            horizon: factor.horizon,
            columns: factor.columns,
            canonical_correlations: canonical_correlations(factor, &self.projection)?,
        })
    }

    /// A and C.
    pub(super) fn realise(&self, order: usize) -> Result<OutputPair> {
        realise(self.method, &self.factor, self.observability(order)?)
    }

    /// From the residuals of the state and output equations with given A and C.
    pub(super) fn innovation(&self, pair: &OutputPair) -> Result<Innovation> {
        let states = StateSequences::new(&self.factor, self.observability(pair.a.nrows())?)?;
        let residuals = states.residuals(pair);
        Ok(innovation::identify(residuals, states.present_outputs(), self.factor.columns, pair))
    }

    fn observability(&self, order: usize) -> Result<MatRef<'_, f64>> {
        let (outputs, horizon) = (self.factor.outputs, self.factor.horizon);
        let largest = (horizon - 1) * outputs;
        if order > largest {
            return Err(Error::Order { order, limit: OrderLimit::Horizon { largest, horizon } });
        }
        Ok(self.projection.observability(order))
    }
}
