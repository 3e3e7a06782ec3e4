//! The driver: from records, nominal model and controller to models with evidence. Read this file first.

use super::certificate::{RunCertificate, certificate};
use super::check::{DataCheck, check_records};
use super::factorise::{Factorisation, factorise_run};
use super::grey_box::{GreyBoxRun, grey_box};
use super::records::RunRecords;
use super::redesign::redesigned;
use super::reduction::{RunReduction, run_reduction};
use super::response::{check_grid, grid, indirect};
use super::settings::{RunSettings, StabilisationSettings};
use super::signals::{DeviationSignals, deviation_signals};
use super::stabilisation::{Diagrams, diagram};
use super::uncertainty::{RunUncertainty, run_uncertainty};
use super::verdict::{Method, Verdict, verify};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;
use youla::factor::CoprimeFactors;
use youla::identify::hansen::{HansenModel, deviation_data};
use youla::identify::innovation_form::hansen_structured;
use youla::identify::subspace::stabilisation::StabilisationDiagram;
use youla::identify::subspace::{SubspaceData, SubspaceModel, SubspaceOptions};
use youla::lti::Discrete;
use youla::signal::IndirectResponse;
use youla_greybox::hansen_refine::{RefinedHansen, Refinement, refine_hansen};
use youla_loop::redesign::Redesign;

/// A stage of a run, in the order in which data flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Records are read.
    Record,
    /// Coprime factors (13)-(15).
    Factor,
    /// alpha and beta (28).
    Signals,
    /// S and the direct model.
    Identify,
    /// `G_red(S)` (29).
    Reduce,
    /// Fits (26) and certificates.
    Validate,
    /// The loop under uncertainty and wrong descriptions.
    Certify,
    /// A new controller.
    Redesign,
    /// Artefacts are written.
    Write,
    /// The report is drawn.
    Report,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Stage; 10] = [
        Stage::Record,
        Stage::Factor,
        Stage::Signals,
        Stage::Identify,
        Stage::Reduce,
        Stage::Validate,
        Stage::Certify,
        Stage::Redesign,
        Stage::Write,
        Stage::Report,
    ];

    /// Name in summary.json and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Record => "record",
            Stage::Factor => "factor",
            Stage::Signals => "signals",
            Stage::Identify => "identify",
            Stage::Reduce => "reduce",
            Stage::Validate => "validate",
            Stage::Certify => "certify",
            Stage::Redesign => "redesign",
            Stage::Write => "write",
            Stage::Report => "report",
        }
    }
}

/// Seconds that each stage took.
pub type StageTimes = Vec<(Stage, f64)>;

/// Announces stages and measures them.
pub struct StageClock<'a> {
    announce: &'a mut dyn FnMut(Stage),
    /// Stages finished so far.
    pub seconds: StageTimes,
}

impl<'a> StageClock<'a> {
    /// A clock that calls `announce` at the start of each stage.
    pub fn new(announce: &'a mut dyn FnMut(Stage)) -> Self {
        StageClock { announce, seconds: Vec::new() }
    }

    /// Runs one stage.
    pub fn run<T>(&mut self, stage: Stage, work: impl FnOnce() -> T) -> T {
        (self.announce)(stage);
        let start = Instant::now();
        let result = work();
        self.seconds.push((stage, start.elapsed().as_secs_f64()));
        result
    }
}

/// Everything that a run found.
#[derive(Debug)]
pub struct Identification {
    /// What was asked for.
    pub settings: RunSettings,
    /// The records.
    pub records: RunRecords,
    /// What is wrong with them.
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
    /// The loop of G(S): the exact test, the region of S, wrong descriptions of the controller.
    pub certificate: Option<RunCertificate>,
    /// The new controller where it was asked for, or the reason why there is none.
    pub redesign: Option<Result<Redesign>>,
}

/// Where a failure of the scheme happened, with the likely cause when the log contradicts the declared controller.
fn deviation_context(signals: &DeviationSignals) -> String {
    let place = "[hansen] S from alpha to beta";
    match signals.controller_mismatch {
        Some(mismatch) if mismatch > SUSPICIOUS_MISMATCH => format!(
            "{place}, where the declared [controller] misses the known excitations by {:.0} % (check its coefficients, \
             sign, delay and saturation)",
            100.0 * mismatch
        ),
        _ => place.to_owned(),
    }
}

/// Relative miss of alpha from which the controller is to be doubted.
const SUSPICIOUS_MISMATCH: f64 = 0.05;

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
            refusal(Method::Direct.key(), "direct model", &self.direct),
            refusal(Method::HansenReduced.key(), "reduced model", &self.reduction),
            refusal(Method::GreyBox.key(), "grey-box model", &self.grey_box),
            refusal("stabilisation", "stabilisation diagram of S", &self.diagrams.deviation),
            refusal("stabilisation_direct", "stabilisation diagram of the direct model", &self.diagrams.direct),
            refusal("indirect", "indirect frequency response", &self.indirect),
            refusal("redesign", "new controller", &self.redesign),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

fn refusal<'a, T>(key: &'static str, what: &'static str, outcome: &'a Option<Result<T>>) -> Option<Refusal<'a>> {
    let error = outcome.as_ref()?.as_ref().err()?;
    Some(Refusal { key, what, error })
}

/// Refuses a part of a file that is too short for the horizon, by its name.
fn require_length(options: &SubspaceOptions, records: &RunRecords, settle: usize) -> Result<()> {
    let (past, horizon) = (options.past(), options.horizon);
    let delay = options.delays.iter().copied().max().unwrap_or(0);
    let needed = [past, horizon, delay, settle].into_iter().fold(0, usize::saturating_add);
    let of_file = |name: &str| records.segments.iter().any(|segment| segment.record == name);
    match records.estimation.iter().find(|r| of_file(&r.name) && r.samples() < needed) {
        None => Ok(()),
        Some(record) => {
            let what = format!(
                "{}, a part of a file, with a horizon of {horizon} and a past of {past} block rows and {settle} samples of \
                 settling (leave it out by `segments`)",
                record.name
            );
            Err(Error::Method(youla::Error::TooFewSamples { what, found: record.samples(), needed }))
        }
    }
}

/// S, G(S) and the diagram of S.
fn scheme(
    factors: &CoprimeFactors<Discrete>,
    signals: &DeviationSignals,
    records: &RunRecords,
    settings: &RunSettings,
) -> Result<(HansenModel, Option<Refinement>, Result<StabilisationDiagram>)> {
    let lines = records.disturbances(signals.settle);
    let data = deviation_data(factors, &signals.experiments, &lines, &settings.hansen)?;
    let found = hansen_structured(factors, &data, &settings.hansen, &settings.deviation.options())?;
    let diagram = diagram(&data, &found.deviation, &settings.hansen, &settings.stabilisation);
    let Some(options) = &settings.deviation.refine else { return Ok((found, None, diagram)) };
    let refined = refine_hansen(found, factors, &signals.experiments, &lines, options);
    let RefinedHansen { model, refinement } = refined.map_err(|e| e.within("[deviation.refine]"))?;
    Ok((model, Some(refinement), diagram))
}

/// The plant from u and y, and its diagram.
fn direct(
    records: &RunRecords,
    options: &SubspaceOptions,
    settings: &StabilisationSettings,
) -> Result<(SubspaceModel, Result<StabilisationDiagram>)> {
    let data = SubspaceData::disturbed(&records.experiments(), &records.disturbances(0), records.time, options)?;
    let found = data.identify(options)?;
    let diagram = diagram(&data, &found, options, settings);
    Ok((found, diagram))
}

/// Runs the modified Hansen scheme on records of a closed loop, beside direct identification.
///
/// A direct model, a reduction or an indirect response that is impossible does not end the run: the reason stands in its
/// place.
///
/// # Errors
/// Whatever makes the scheme itself impossible; see the functions called here in turn.
pub fn identify(
    settings: RunSettings,
    records: RunRecords,
    folder: &Path,
    clock: &mut StageClock<'_>,
) -> Result<Identification> {
    check_grid(&settings.frequency_response, records.time)?;
    let factorisation = clock.run(Stage::Factor, || factorise_run(&settings, &records, folder))?; // (13)-(15)
    let factors = &factorisation.factors;
    let (signals, data) = clock.run(Stage::Signals, || {
        let signals = deviation_signals(factors, &records.estimation, settings.factors.settle)?; // (28)
        Ok::<_, Error>((signals, check_records(&settings, &records, &factorisation.controller)?))
    })?;
    require_length(&settings.hansen, &records, signals.settle)?;
    let (scheme, direct, grey_box) = clock.run(Stage::Identify, || {
        let (scheme, direct) = rayon::join(
            || scheme(factors, &signals, &records, &settings), // (25), (17)
            || settings.direct.as_ref().map(|options| direct(&records, options, &settings.stabilisation)),
        );
        let hansen = scheme.as_ref().ok().map(|(hansen, _, _)| hansen);
        let grey_box = hansen.and_then(|hansen| grey_box(&factorisation, &signals, &records, hansen, &settings));
        (scheme, direct, grey_box)
    });
    let (hansen, refinement, deviation_diagram) = scheme.map_err(|e| e.within(deviation_context(&signals)))?;
    let (direct, direct_diagram) = match direct {
        Some(Ok((model, diagram))) => (Some(Ok(model)), Some(diagram)),
        Some(Err(reason)) => (Some(Err(reason)), None),
        None => (None, None),
    };
    let diagrams = Diagrams { deviation: Some(deviation_diagram), direct: direct_diagram };
    let reduction = clock.run(Stage::Reduce, || {
        settings.reduction.as_ref().map(|options| run_reduction(factors, &hansen, &records, options)) // (29)
    });
    let hz = grid(&settings.frequency_response, [&factorisation.nominal, &hansen.plant])?;
    let intervals = grey_box.as_ref().and_then(|run| run.as_ref().ok()?.intervals.as_ref().ok());
    let uncertainty = run_uncertainty(&hansen, intervals, &hz, settings.hansen.uncertainty.level)?;
    let mut found = Identification {
        verdict: Verdict::default(),
        certificate: None,
        redesign: None,
        settings,
        records,
        data,
        factorisation,
        signals,
        hansen,
        refinement,
        hz,
        uncertainty,
        reduction,
        direct,
        grey_box,
        diagrams,
        indirect: None,
    };
    // (26), the loop certificate and the response that rests on no model.
    (found.indirect, found.verdict) =
        clock.run(Stage::Validate, || Ok::<_, Error>((indirect(&found), verify(&found)?)))?;
    found.certificate = Some(clock.run(Stage::Certify, || certificate(&found))?);
    found.redesign = clock.run(Stage::Redesign, || redesigned(&found));
    Ok(found)
}
