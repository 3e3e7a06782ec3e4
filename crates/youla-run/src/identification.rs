//! The result of a run: what each stage found, and what was asked for but is impossible.

use super::certificate::RunCertificate;
use super::check::DataCheck;
use super::factorise::Factorisation;
use super::grey_box::GreyBoxRun;
use super::method::Method;
use super::records::RunRecords;
use super::reduction::RunReduction;
use super::settings::RunSettings;
use super::signals::DeviationSignals;
use super::stabilisation::Diagrams;
use super::uncertainty::RunUncertainty;
use super::verdict::Verdict;
use crate::{Error, Result};
use youla::identify::hansen::HansenModel;
use youla::identify::subspace::SubspaceModel;
use youla::signal::IndirectResponse;
use youla_greybox::hansen_refine::Refinement;
use youla_loop::redesign::Redesign;

/// Everything that a run found.
#[derive(Debug)]
pub struct Identification {
    /// What was asked for.
    pub settings: RunSettings,
    /// The records.
    pub records: RunRecords,
    /// The check of the records.
    pub data: DataCheck,
    /// Nominal model, controller and their factors.
    pub factorisation: Factorisation,
    /// alpha and beta of the estimation records.
    pub signals: DeviationSignals,
    /// S and G(S).
    pub hansen: HansenModel,
    /// What the refinement of S changed, where it was asked for.
    pub refinement: Option<Refinement>,
    /// Frequencies of the responses of all models, Hz.
    pub hz: Vec<f64>,
    /// The uncertainty of S, of G(S) and of the physical structure.
    pub uncertainty: RunUncertainty,
    /// `G_red(S)` in its loop where it was asked for, or the reason why there is none.
    pub reduction: Option<Result<RunReduction>>,
    /// The direct model where it was asked for, or the reason why there is none.
    pub direct: Option<Result<SubspaceModel>>,
    /// The physical structure where one was declared, or the reason why it has no estimate.
    pub grey_box: Option<Result<GreyBoxRun>>,
    /// Stabilisation diagrams.
    pub diagrams: Diagrams,
    /// The non-parametric response of the plant where an excitation is known, or the reason why there is none.
    pub indirect: Option<Result<IndirectResponse>>,
    /// Evidence on every model.
    pub verdict: Verdict,
    /// The loop of G(S): the exact test, the region of S, errors in the description of the controller.
    pub certificate: RunCertificate,
    /// The new controller where it was asked for, or the reason why there is none.
    pub redesign: Option<Result<Redesign>>,
}

/// Something that was asked for but is impossible; the run goes on without it.
#[derive(Debug, Clone, Copy)]
pub struct Refusal<'a> {
    /// Key in summary.json.
    pub key: &'static str,
    /// In words.
    pub what: &'static str,
    /// The reason.
    pub error: &'a Error,
}

impl Identification {
    /// What was asked for but is impossible, with the reasons.
    pub fn refusals(&self) -> Vec<Refusal<'_>> {
        [
            refusal(Method::Direct.key(), "direct model", self.direct.as_ref()),
            refusal(Method::HansenReduced.key(), "reduced model", self.reduction.as_ref()),
            refusal(Method::GreyBox.key(), "grey-box model", self.grey_box.as_ref()),
            refusal("stabilisation", "stabilisation diagram of S", self.diagrams.deviation.as_ref()),
            refusal("stabilisation_direct", "stabilisation diagram of the direct model", self.diagrams.direct.as_ref()),
            refusal("indirect", "indirect frequency response", self.indirect.as_ref()),
            refusal("redesign", "new controller", self.redesign.as_ref()),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// The reduced model, where there is one.
    pub(crate) fn reduced(&self) -> Option<&RunReduction> {
        found(self.reduction.as_ref())
    }

    /// The estimate of the physical structure, where there is one.
    pub(crate) fn structure(&self) -> Option<&GreyBoxRun> {
        found(self.grey_box.as_ref())
    }

    /// The new controller, where there is one.
    pub(crate) fn new_controller(&self) -> Option<&Redesign> {
        found(self.redesign.as_ref())
    }
}

/// The result of something that was asked for and is possible.
pub(crate) fn found<T>(outcome: Option<&Result<T>>) -> Option<&T> {
    outcome?.as_ref().ok()
}

fn refusal<'a, T>(key: &'static str, what: &'static str, outcome: Option<&'a Result<T>>) -> Option<Refusal<'a>> {
    let error = outcome?.as_ref().err()?;
    Some(Refusal { key, what, error })
}
