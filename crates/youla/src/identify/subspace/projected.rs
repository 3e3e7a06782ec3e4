//! What all orders of one method share: the projection with its singular values, from which a model of any order follows.

use crate::Result;
use crate::identify::subspace::innovation::Innovation;
use crate::identify::subspace::open_loop::OpenLoop;
use crate::identify::subspace::order::Evidence;
use crate::identify::subspace::output_pair::OutputPair;
use crate::identify::subspace::predictor_form::PredictorForm;
use crate::identify::subspace::stability::{self, StabilityReport};
use crate::identify::subspace::triangle::factorisation::HankelLq;
use crate::identify::subspace::{DataFactor, Stability, SubspaceOptions};
use crate::lti::Discrete;

/// The projection of one method.
pub(super) enum Projected {
    /// MOESP, N4SID, CVA.
    OpenLoop(OpenLoop),
    /// PBSIDopt, SSARX.
    Predictor(PredictorForm),
}

/// A, C and the innovations of one order, in scaled units.
pub(super) struct Estimate {
    pub(super) pair: OutputPair,
    pub(super) stability: StabilityReport,
    pub(super) innovation: Innovation,
}

impl Projected {
    /// The projection by the method, horizon and past of `options`.
    pub(super) fn new(data: &HankelLq, options: &SubspaceOptions) -> Result<Self> {
        Ok(match options.method.is_for_closed_loops() {
            true => Projected::Predictor(PredictorForm::new(data, options)?),
            false => Projected::OpenLoop(OpenLoop::new(data, options)?),
        })
    }

    /// What the choice of the order depends on.
    pub(super) fn evidence(&self) -> Result<Evidence> {
        match self {
            Projected::OpenLoop(shared) => shared.evidence(),
            Projected::Predictor(shared) => Ok(shared.evidence()),
        }
    }

    /// A and C of one order as they come out.
    pub(super) fn realise(&self, order: usize) -> Result<OutputPair> {
        match self {
            Projected::OpenLoop(shared) => shared.realise(order),
            Projected::Predictor(shared) => shared.realise(order),
        }
    }

    /// A and C of one order with the choice on stability applied, and their innovations.
    pub(super) fn estimate(&self, order: usize, choice: Stability, time: Discrete) -> Result<Estimate> {
        let (pair, stability) = stability::apply(choice, self.realise(order)?, time)?;
        let innovation = self.innovation(&pair)?;
        Ok(Estimate { pair, stability, innovation })
    }

    /// From the residuals of both equations with given A and C.
    pub(super) fn innovation(&self, pair: &OutputPair) -> Result<Innovation> {
        match self {
            Projected::OpenLoop(shared) => shared.innovation(pair),
            Projected::Predictor(shared) => shared.innovation(pair),
        }
    }

    /// Descending, horizon x outputs of them.
    pub(super) fn singular_values(&self) -> &[f64] {
        match self {
            Projected::OpenLoop(shared) => &shared.projection.singular_values,
            Projected::Predictor(shared) => &shared.map.singular_values,
        }
    }

    /// Smallest over largest singular value of the inputs' Hankel matrix.
    pub(super) fn excitation_rcond(&self) -> f64 {
        match self {
            Projected::OpenLoop(shared) => shared.excitation_rcond,
            Projected::Predictor(shared) => shared.excitation_rcond,
        }
    }

    /// How the data were factored, and the number of columns.
    pub(super) fn data(&self) -> (DataFactor, usize) {
        match self {
            Projected::OpenLoop(shared) => (shared.factor.report, shared.factor.columns),
            Projected::Predictor(shared) => (shared.varx.report, shared.varx.columns),
        }
    }
}
