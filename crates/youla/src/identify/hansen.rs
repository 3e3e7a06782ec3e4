//! The modified Hansen scheme: an open-loop identification of the Youla deviation system S, eq. (25).
//!
//! ```text
//! beta = S alpha + (Mt + S Ut) n,        alpha independent of the noise n
//! ```
//!
//! Because alpha does not depend on n, any open-loop method is unbiased here, with any noise model, even for an unstable
//! plant. Source: the paper, eqs (20)-(25); Hansen, Franklin and Kosut 1989.

pub use super::evidence::Evidence;
use super::evidence::evidence;
use super::subspace::{Experiment, NoUncertainty, SubspaceModel, SubspaceOptions, Uncertainty, subspace};
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
    /// That of G(S), where it was asked for; that of S is with `deviation`.
    pub uncertainty: Option<Uncertainty>,
    /// Whether the data contradict the nominal model, where an uncertainty was asked for.
    pub evidence: Option<Result<Evidence, NoUncertainty>>,
}

/// Identifies S from the signals of one or more experiments and recombines it to the plant G(S).
///
/// The controller stabilises G(S) exactly when S is stable.
///
/// The uncertainty of S carries over to the plant by the linear part of
/// ```text
/// G(S + dS) - G(S) = (Mt + (S + dS) Ut)^-1 dS (M + U S)^-1
/// ```
///
/// # Errors
/// As [`subspace`]; [`crate::Error::AlgebraicLoop`] when G(S) is not well posed.
pub fn hansen(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    let experiments: Vec<_> = signals.iter().map(|s| Experiment { u: s.alpha.as_ref(), y: s.beta.as_ref() }).collect();
    let deviation = subspace(&experiments, factors.nominal().time(), options)?;
    let plant = factors.plant_of(&deviation.model)?;
    let uncertainty = deviation.uncertainty.as_ref().map(|u| u.through(|s| factors.plant_of(s))).transpose()?;
    let order = deviation.model.order();
    let evidence = uncertainty.is_some().then(|| evidence(signals, factors.nominal().time(), order, options));
    Ok(HansenModel { deviation, plant, uncertainty, evidence })
}
