//! The modified Hansen scheme: an open-loop identification of the Youla deviation system S, eq. (25).
//!
//! ```text
//! beta = S alpha + (Mt + S Ut) n,        alpha independent of the noise n
//! ```
//!
//! Because alpha does not depend on n, any open-loop method is unbiased here, with any noise model, even for an unstable
//! plant. Source: the paper, eqs (20)-(25); Hansen, Franklin and Kosut 1989.

use super::innovation_form::{self, InnovationForm, NoiseForm};
use super::subspace::{
    DeviationEvidence, Experiment, NoUncertainty, SubspaceData, SubspaceModel, SubspaceOptions, Uncertainty,
};
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
    /// The innovation form of S where it was asked for.
    pub innovation_form: Option<InnovationForm>,
    /// That of G(S), where it was asked for; that of S is with `deviation`.
    pub uncertainty: Option<Uncertainty>,
    /// Whether the data contradict the nominal model, where an uncertainty was asked for.
    pub evidence: Option<Result<DeviationEvidence, NoUncertainty>>,
}

/// Choices of [`hansen`]; those of the subspace method alone are options too: `subspace.into()`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HansenOptions {
    /// The subspace method that identifies S.
    pub subspace: SubspaceOptions,
    /// How the noise of beta is modelled.
    pub noise: NoiseForm,
}

impl From<SubspaceOptions> for HansenOptions {
    fn from(subspace: SubspaceOptions) -> Self {
        HansenOptions { subspace, ..Default::default() }
    }
}

/// Identifies S from alpha and beta of one or more experiments and recombines it to the plant G(S).
///
/// The controller stabilises G(S) exactly when S is stable. The uncertainty of S carries over to the plant by the linear part of
/// ```text
/// G(S + dS) - G(S) = (Mt + (S + dS) Ut)^-1 dS (M + U S)^-1
/// ```
/// A known disturbance d of y ([`YoulaSignals::with_disturbance`]) is one of beta, `(Mt + S Ut) d`: for lines of constant
/// frequency, or of a speed that changes slowly against the loop, of the same shape and another size.
///
/// # Errors
/// As [`super::subspace::subspace`]; [`crate::Error::AlgebraicLoop`] when G(S) is not well posed; for the innovation form
/// [`crate::Error::Unstable`] where `A - K_s C` is not stable, as for an unstable plant, and [`crate::Error::Unsupported`] for
/// delays.
pub fn hansen(
    factors: &CoprimeFactors<Discrete>,
    experiments: &[YoulaSignals],
    options: &HansenOptions,
) -> Result<HansenModel> {
    HansenData::new(factors, experiments, &options.subspace)?.identify(options)
}

impl YoulaSignals {
    /// alpha as input and beta as output of S, with the known disturbance.
    pub fn experiment(&self) -> Experiment<'_> {
        Experiment { disturbance: self.disturbance(), ..Experiment::new(self.alpha(), self.beta()) }
    }
}

/// alpha and beta with the triangular factor of their block-Hankel matrix: models of several orders or structures and
/// stabilisation diagrams from one pass over the data.
pub struct HansenData<'a> {
    factors: &'a CoprimeFactors<Discrete>,
    data: SubspaceData<'a>,
}

impl<'a> HansenData<'a> {
    /// Checks and factors the signals for the method of `options`.
    ///
    /// # Errors
    /// As [`SubspaceData::new`].
    pub fn new(
        factors: &'a CoprimeFactors<Discrete>,
        experiments: &'a [YoulaSignals],
        options: &SubspaceOptions,
    ) -> Result<Self> {
        let experiments: Vec<Experiment<'a>> = experiments.iter().map(YoulaSignals::experiment).collect();
        Ok(HansenData { factors, data: SubspaceData::new(&experiments, factors.nominal().time(), options)? })
    }

    /// The factored data: alpha as inputs, beta as outputs.
    pub fn subspace(&self) -> &SubspaceData<'a> {
        &self.data
    }

    /// Identifies S and recombines it to G(S).
    ///
    /// # Errors
    /// As [`hansen`] and [`SubspaceData::identify`].
    pub fn identify(&self, options: &HansenOptions) -> Result<HansenModel> {
        let HansenOptions { subspace, noise } = options;
        let (deviation, innovation_form) = match noise {
            NoiseForm::Free => (self.data.identify(subspace)?, None),
            NoiseForm::Innovation(refits) => {
                innovation_form::check(subspace, refits)?;
                let (model, form) = innovation_form::refit(self.factors, &self.data, subspace, refits)?;
                (model, Some(form))
            }
        };
        let plant = self.factors.plant_of(&deviation.model)?;
        let uncertainty =
            deviation.uncertainty.as_ref().map(|u| u.through(|s| self.factors.plant_of(s))).transpose()?;
        let evidence = uncertainty.is_some().then(|| self.data.evidence(deviation.order.order, subspace));
        Ok(HansenModel { deviation, plant, innovation_form, uncertainty, evidence })
    }
}
