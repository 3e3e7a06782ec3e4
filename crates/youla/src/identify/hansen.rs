//! The modified Hansen scheme: an open-loop identification of the Youla deviation system S, eq. (25).
//!
//! ```text
//! beta = S alpha + (Mt + S Ut) n,        alpha independent of the noise n
//! ```
//!
//! Because alpha does not depend on n, any open-loop method is unbiased here, with any noise model, even for an unstable
//! plant. Source: the paper, eqs (20)-(25); Hansen, Franklin and Kosut 1989.

use super::innovation_form::{DeviationOptions, InnovationForm, hansen_structured};
use super::subspace::{Evidence, Experiment, NoUncertainty, SubspaceData, SubspaceModel, SubspaceOptions, Uncertainty};
use crate::factor::{CoprimeFactors, YoulaSignals};
use crate::lti::{Discrete, StateSpace};
use crate::{MatRef, Result};

/// The identified deviation system and the plant that it stands for.
#[derive(Debug, Clone)]
pub struct HansenModel {
    /// S, from alpha to beta, with all evidence of its identification.
    pub deviation: SubspaceModel,
    /// `G(S) = F_u(J_G, S)`, of order n + n_S.
    pub plant: StateSpace<Discrete>,
    /// The innovation form of S where it was asked for.
    pub innovation_form: Option<InnovationForm>,
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
/// As [`super::subspace::subspace`]; [`crate::Error::AlgebraicLoop`] when G(S) is not well posed.
pub fn hansen(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    hansen_disturbed(factors, signals, &[], options)
}

/// The same where the outputs carry disturbances of known shape, one matrix of known signals (samples x signals) for each
/// experiment, or none at all. A disturbance d of y is one of beta, `(Mt + S Ut) d`: for lines of constant frequency, or of a
/// speed that changes slowly against the loop, of the same shape and another size.
///
/// # Errors
/// As [`hansen`]; shapes of the known signals.
pub fn hansen_disturbed(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    disturbances: &[MatRef<'_, f64>],
    options: &SubspaceOptions,
) -> Result<HansenModel> {
    let data = deviation_data(factors, signals, disturbances, options)?;
    hansen_structured(factors, &data, options, &DeviationOptions::default())
}

/// The signals of one or more experiments, factored for the method of `options`: for models of several orders, or what else
/// [`SubspaceData`] serves.
///
/// # Errors
/// As [`SubspaceData::disturbed`].
pub fn deviation_data(
    factors: &CoprimeFactors<Discrete>,
    signals: &[YoulaSignals],
    disturbances: &[MatRef<'_, f64>],
    options: &SubspaceOptions,
) -> Result<SubspaceData> {
    let experiments: Vec<_> = signals.iter().map(|s| Experiment { u: s.alpha.as_ref(), y: s.beta.as_ref() }).collect();
    SubspaceData::disturbed(&experiments, disturbances, factors.nominal().time(), options)
}
