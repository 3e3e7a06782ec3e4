//! The modified Hansen scheme: an open-loop identification of the Youla deviation system S, eq. (25).
//!
//! ```text
//! beta = S alpha + (Mt + S Ut) n,        alpha independent of the noise n
//! ```
//!
//! Because alpha does not depend on n, any open-loop method is unbiased here, with any noise model, even for an unstable
//! plant. Source: the paper, eqs (20)-(25); Hansen, Franklin and Kosut 1989.

use super::subspace::{Experiment, SubspaceData, SubspaceModel, SubspaceOptions};
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

/// Identifies S from the signals of one or more experiments and recombines it to the plant G(S).
///
/// The controller stabilises G(S) exactly when S is stable.
///
/// # Errors
/// As [`super::subspace::subspace`]; [`crate::Error::AlgebraicLoop`] when G(S) is not well posed.
pub fn hansen(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    hansen_of(factors, &deviation_data(factors, signals, options)?, options)
}

/// The signals of one or more experiments, factored for the method of `options`: for models of several orders, or what else
/// [`SubspaceData`] serves.
///
/// # Errors
/// As [`SubspaceData::new`].
pub fn deviation_data(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    options: &SubspaceOptions,
) -> Result<SubspaceData> {
    let experiments: Vec<_> = signals.iter().map(|s| Experiment { u: s.alpha.as_ref(), y: s.beta.as_ref() }).collect();
    SubspaceData::new(&experiments, factors.nominal().time(), options)
}

/// As [`hansen`], from data factored before.
///
/// # Errors
/// As [`hansen`].
pub fn hansen_of(
    factors: &CoprimeFactors<Discrete>,
    data: &SubspaceData,
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    let deviation = data.identify(options)?;
    let plant = factors.plant_of(&deviation.model)?;
    Ok(HansenModel { deviation, plant })
}
