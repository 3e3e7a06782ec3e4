//! The result of a run: what each stage found, and what was asked for but is impossible.

use crate::check::DataCheck;
use crate::method::Method;
use crate::records::RunRecords;
use crate::settings::RunSettings;
use crate::stages::certificate::RunCertificate;
use crate::stages::factors::{DeclaredLoop, LoopFactors};
use crate::stages::grey_box::GreyBoxRun;
use crate::stages::nonparametric::LinesOfRun;
use crate::stages::redesign::doubts;
use crate::stages::reduction::RunReduction;
use crate::stages::signals::DeviationSignals;
use crate::stages::uncertainty::SystemUncertainty;
use crate::stages::validate::Validation;
use crate::{Error, Result};
use youla::identify::hansen::HansenModel;
use youla::identify::likelihood::Recommendation;
use youla::identify::subspace::SubspaceModel;
use youla::lti::{Discrete, StateSpace};
use youla::signal::IndirectResponse;
use youla_loop::redesign::Redesign;
use youla_loop::redesign::structured::PidRedesign;

/// Everything that a run found. A method that is impossible does not end the run: its field holds the reason.
#[derive(Debug)]
pub struct Identification {
    /// What was asked for.
    pub settings: RunSettings,
    /// The records.
    pub records: RunRecords,
    /// The check of the records.
    pub data: DataCheck,
    /// Nominal model and controller.
    pub declared: DeclaredLoop,
    /// The recommended model with its evidence.
    pub recommended: Result<Recommendation>,
    /// The coprime factors, with alpha and beta of the estimation records.
    pub filtered: Result<Filtered>,
    /// S and G(S) of the modified Hansen scheme; `None` where alpha and beta do not exist.
    pub hansen: Option<Result<HansenModel>>,
    /// The loop of the recommended plant: the exact test by S, the region, margins; `None` without factors.
    pub certificate: Option<Result<RunCertificate>>,
    /// The reduced plant in its loop where it was asked for.
    pub reduction: Option<Result<RunReduction>>,
    /// The physical structure where one was declared.
    pub grey_box: Option<Result<GreyBoxRun>>,
    /// Its uncertainty, where it can be had.
    pub grey_box_uncertainty: Option<SystemUncertainty>,
    /// The new controller where it was asked for.
    pub redesign: Option<Result<Redesign>>,
    /// The new PID where one was asked for.
    pub pid: Option<Result<PidRedesign>>,
    /// The direct model where it was asked for.
    pub direct: Option<Result<SubspaceModel>>,
    /// The non-parametric response of the plant where an excitation is known.
    pub indirect: Option<Result<IndirectResponse>>,
    /// The plant without a model, where an excitation is known: at its lines, or in windows.
    pub lines: Option<Result<LinesOfRun>>,
    /// Frequencies of the responses of all models, Hz.
    pub hz: Vec<f64>,
    /// Evidence on every model.
    pub validation: Validation,
}

/// Factors and signals of the scheme.
#[derive(Debug)]
pub struct Filtered {
    /// The factors of nominal model and controller.
    pub factorisation: LoopFactors,
    /// alpha and beta of the estimation records; none of records that are shorter than the transient of the filter.
    pub signals: Result<DeviationSignals>,
}

impl Filtered {
    /// alpha and beta, where they exist.
    pub(crate) fn signals(&self) -> Option<&DeviationSignals> {
        self.signals.as_ref().ok()
    }
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
            refusal("recommended", "recommended model", Some(&self.recommended)),
            refusal(
                "factors",
                "coprime factorisation, and so no Hansen scheme (the recommended model needs neither)",
                Some(&self.filtered),
            ),
            refusal(
                "signals",
                "alpha and beta, and so no Hansen scheme (the recommended model needs neither)",
                self.filtered.as_ref().ok().map(|filtered| &filtered.signals),
            ),
            refusal(Method::Hansen.key(), "model by the Hansen scheme", self.hansen.as_ref()),
            refusal(Method::Direct.key(), "direct model", self.direct.as_ref()),
            refusal(Method::HansenReduced.key(), "reduced model", self.reduction.as_ref()),
            refusal("certificate", "certificate of the loop", self.certificate.as_ref()),
            refusal(Method::GreyBox.key(), "grey-box model", self.grey_box.as_ref()),
            refusal("indirect", "indirect frequency response", self.indirect.as_ref()),
            refusal("lines", "response at the lines of the excitation", self.lines.as_ref()),
            refusal("redesign", "new controller", self.redesign.as_ref()),
            refusal("pid", "new PID", self.pid.as_ref()),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// S, the deviation of the recommended plant from the nominal model; `None` without one of them, and without factors.
    ///
    /// # Errors
    /// Numerical conditions of [`youla::factor::CoprimeFactors::deviation_of`].
    pub fn deviation(&self) -> Result<Option<StateSpace<Discrete>>> {
        let (Some(_), Ok(model), Ok(filtered)) = (&self.declared.nominal, &self.recommended, &self.filtered) else {
            return Ok(None);
        };
        Ok(Some(filtered.factorisation.factors.deviation_of(&model.plant)?))
    }

    /// The scheme, where it gave a model.
    pub fn scheme(&self) -> Option<&HansenModel> {
        found(self.hansen.as_ref())
    }

    /// The direct model, where there is one.
    pub fn direct(&self) -> Option<&SubspaceModel> {
        found(self.direct.as_ref())
    }

    /// The reduced model, where there is one.
    pub(crate) fn reduced(&self) -> Option<&RunReduction> {
        found(self.reduction.as_ref())
    }

    /// The certificate of the loop, where there is one.
    pub fn certified(&self) -> Option<&RunCertificate> {
        found(self.certificate.as_ref())
    }

    /// The estimate of the physical structure, where there is one.
    pub(crate) fn structure(&self) -> Option<&GreyBoxRun> {
        found(self.grey_box.as_ref())
    }

    /// The new controller, where there is one.
    pub(crate) fn new_controller(&self) -> Option<&Redesign> {
        found(self.redesign.as_ref())
    }

    /// The new PID, where there is one.
    pub(crate) fn new_pid(&self) -> Option<&PidRedesign> {
        found(self.pid.as_ref())
    }

    /// What speaks against a design on this run, a sentence each: a model that is not trusted, a stated controller that is not the one in the log.
    pub(crate) fn doubts(&self) -> Vec<String> {
        doubts(self.recommended.as_ref().ok(), &self.data)
    }

    /// Why the new controller that was asked for is not there or should not be taken.
    pub fn redesign_reservation(&self) -> Option<String> {
        let asked = self.settings.redesign.as_ref()?;
        let reasons = match (&self.pid, &self.redesign, asked.structure) {
            (Some(Err(error)), ..) | (_, Some(Err(error)), None) => error.to_string(),
            (Some(Ok(new)), ..) => new.reservations().join("; "),
            (_, Some(Ok(new)), None) => [self.doubts(), new.reservations()].concat().join("; "),
            (None, _, Some(_)) => "[redesign] structure needs the recommended model, which this run lacks".into(),
            (_, None, None) => {
                "[redesign] needs the recommended model and coprime factors, which this run lacks".into()
            }
        };
        Some(reasons).filter(|reasons| !reasons.is_empty())
    }

    /// The uncertainty of a model beside the recommended one.
    pub(crate) fn uncertainty(&self, method: Method) -> Option<&SystemUncertainty> {
        self.grey_box_uncertainty.as_ref().filter(|_| method == Method::GreyBox)
    }

    /// Whether and how well the declared controller explains the inputs; see [`DeviationSignals::controller_mismatch`].
    pub fn controller_mismatch(&self) -> Option<f64> {
        self.signals()?.controller_mismatch
    }

    /// alpha and beta of the estimation records, where they exist.
    pub(crate) fn signals(&self) -> Option<&DeviationSignals> {
        self.filtered.as_ref().ok()?.signals()
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
