//! The modified Hansen scheme: an open-loop identification of the Youla deviation system S, eq. (25).
//!
//! ```text
//! beta = S alpha + (Mt + S Ut) n,        alpha independent of the noise n
//! ```
//!
//! Because alpha does not depend on n, any open-loop method is unbiased here, with any noise model, even for an unstable
//! plant. Source: the paper, eqs (20)-(25); Hansen, Franklin and Kosut 1989.

use super::subspace::{Experiment, SubspaceModel, SubspaceOptions, subspace};
use crate::Result;
use crate::factor::{CoprimeFactors, YoulaSignals};
use crate::lti::{Discrete, StateSpace};

/// The identified deviation system and the plant that it stands for.
#[derive(Debug, Clone)]
pub struct HansenModel {
    /// S, from alpha to beta, with all evidence of its identification.
    pub deviation: SubspaceModel,
    /// `G(S) = F_u(J_G, S)`, of order n + n_S.
    pub plant: StateSpace<Discrete>,
}

/// Identifies S from alpha and beta of one or more experiments and recombines it to the plant G(S).
///
/// The controller stabilises G(S) exactly when S is stable.
/// A known disturbance d of y ([`YoulaSignals::with_disturbance`]) is one of beta, `(Mt + S Ut) d`: for lines of constant
/// frequency, or of a speed that changes slowly against the loop, of the same shape and another size.
///
/// # Errors
/// As [`super::subspace::subspace`]; [`crate::Error::AlgebraicLoop`] when G(S) is not well posed.
pub fn hansen(
    factors: &CoprimeFactors<Discrete>,
    experiments: &[YoulaSignals],
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    let experiments: Vec<Experiment<'_>> = experiments.iter().map(YoulaSignals::experiment).collect();
    let deviation = subspace(&experiments, factors.nominal().time(), options)?;
    let plant = factors.plant_of(&deviation.model)?;
    Ok(HansenModel { deviation, plant })
}

impl YoulaSignals {
    /// alpha as input and beta as output of S, with the known disturbance.
    pub(crate) fn experiment(&self) -> Experiment<'_> {
        Experiment { disturbance: self.disturbance(), ..Experiment::new(self.alpha(), self.beta()) }
    }
}
