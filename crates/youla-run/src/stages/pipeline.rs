//! The driver: from records, controller and, where one is given, nominal model to models with evidence. Read this file first.

use crate::check::check_records;
use crate::error::no_model::NoModel;
use crate::method::Method;
use crate::records::RunRecords;
use crate::result::{Filtered, Identification, found};
use crate::settings::RunSettings;
use crate::stages::certificate::certificate;
use crate::stages::clock::{Stage, StageClock};
use crate::stages::context::{RunContext, SchemeContext};
use crate::stages::direct::direct;
use crate::stages::factors::{NO_NOMINAL, declared_loop, factorise};
use crate::stages::grey_box::criterion::SchemeStart;
use crate::stages::grey_box::{GreyBoxRun, grey_box};
use crate::stages::hansen::require_length;
use crate::stages::nonparametric::lines;
use crate::stages::recommend::{defects, is_of_outliers, named_controllers, recommend, weigh};
use crate::stages::redesign::{doubts, pid, redesigned};
use crate::stages::reduction::run_reduction;
use crate::stages::responses::{check_grid, grid, indirect};
use crate::stages::signals::deviation_signals;
use crate::stages::uncertainty::structure_uncertainty;
use crate::stages::validate::{Candidates, verify};
use crate::{Error, Result};
use std::path::Path;
use youla::ErrorKind;
use youla::control::{RunningController, closed_loop, with_input_port};
use youla::identify::{HansenModel, hansen};
use youla::lti::{Discrete, StateSpace};

/// Identifies the plant of a loop from its records: the recommended model by maximum likelihood, and beside it what was asked for: the
/// modified Hansen scheme, direct identification, a physical structure.
///
/// The coprime factors are those of the nominal model and the controller. Without a nominal model the recommended plant takes its place,
/// whose S is zero; what rests on the region of S and on the loop is the same.
///
/// A method that is impossible on these records does not end the run: its field of the result holds the reason.
///
/// # Errors
/// Bad input; [`Error::NoModel`] with the reason of every candidate where no method gives a model.
pub fn identify(
    settings: RunSettings,
    records: RunRecords,
    folder: &Path,
    clock: &mut StageClock<'_>,
) -> Result<Identification> {
    settings.check()?;
    check_grid(&settings.frequency_response, records.time)?;
    let declared = declared_loop(&settings, &records, folder)?;
    let of_nominal = |nominal| own_line(filtered((nominal, &declared.running), &settings, &records, clock));
    let of_nominal = declared.nominal.as_ref().map(of_nominal).transpose()?;
    let factors = found(of_nominal.as_ref());
    let factorisation = factors.map(|f| &f.factorisation);
    let run = RunContext { settings: &settings, records: &records, declared: &declared, factorisation };
    let context =
        factors.and_then(|f| Some(SchemeContext { run, factorisation: &f.factorisation, signals: f.signals()? }));
    let mut data = clock.run(Stage::Check, || check_records(&settings, &records, Some(declared.stated())))?;
    let outliers = data.findings.iter().any(is_of_outliers);
    let (recommended, (s, direct)) = clock.run(Stage::Identify, || {
        let others = || match records.measured {
            None => rayon::join(|| structures(run, context), || direct(&records, &settings)), // (25), (17)
            Some(_) => Default::default(),
        };
        rayon::join(|| recommend(run, outliers), others)
    });
    let (s, grey_box) = s;
    let (mut recommended, s) = (own_line(recommended)?, s.map(own_line).transpose()?);
    if let Ok(model) = &mut recommended {
        model.evidence.extend(named_controllers(&data, model));
        model.evidence.extend(defects(&data));
        weigh(&mut data, model);
    }
    let filtered = match (of_nominal, &recommended) {
        (Some(filtered), _) => filtered,
        (None, Ok(model)) => {
            own_line(filtered((&model.plant, &declared.running), &settings, &records, clock))?.map_err(of_recommended)
        }
        (None, Err(_)) => Err(Error::Method(NO_NOMINAL)),
    };
    let factorisation = filtered.as_ref().ok().map(|f| &f.factorisation);
    let run = RunContext { settings: &settings, records: &records, declared: &declared, factorisation };
    let reduction = clock.run(Stage::Reduce, || {
        let (model, options) = (recommended.as_ref().ok()?, settings.reduction.as_ref()?);
        Some(run_reduction(&factorisation?.factors, &model.plant, &records, options)) // (29)
    });
    let candidates = Candidates {
        recommended: recommended.as_ref().ok(),
        hansen: found(s.as_ref()),
        direct: found(direct.as_ref()),
        reduction: found(reduction.as_ref()),
        grey_box: found(grey_box.as_ref()),
    };
    let identified = candidates.identified();
    if identified.is_empty() {
        let asked = direct.is_some();
        let outcomes = [
            ("the recommended model", recommended.err()),
            (
                "the modified Hansen scheme",
                settings.hansen.as_ref().and_then(|_| filtered.and_then(|f| f.signals).err().or_else(|| s?.err())),
            ),
            ("direct identification", direct.and_then(Result::err)),
            ("the physical structure", grey_box.and_then(Result::err)),
        ];
        let reasons = outcomes.into_iter().filter_map(|(name, reason)| Some((name, reason?))).collect();
        return Err(Error::NoModel(NoModel::new(reasons, asked, records.time)));
    }
    // The loop has resonances of its own, at the peaks of the sensitivity.
    let looped = recommended
        .as_ref()
        .ok()
        .and_then(|model| closed_loop(&model.plant, &with_input_port(declared.controller()).ok()?).ok());
    let models: Vec<_> = declared.nominal.iter().chain(identified).chain(&looped).collect();
    let valid = recommended.as_ref().ok().and_then(|model| Some(model.bands.first()?[0]));
    let hz = grid(&settings.frequency_response, &models, records.time, valid)?;
    // (26), the loop certificate and the response that rests on no model.
    let ((indirect, lines), validation) = clock.run(Stage::Validate, || {
        let indirect = match &records.measured {
            None => indirect(run, filtered.as_ref().ok().and_then(Filtered::signals)),
            Some(measured) => Some(measured.shown()),
        };
        Ok::<_, Error>(((indirect, lines(run)), verify(run, &candidates)?))
    })?;
    let intervals = found(grey_box.as_ref()).and_then(|run| run.intervals.as_ref().ok());
    let grey_box_uncertainty = intervals.map(|known| structure_uncertainty(known, &hz)).transpose()?;
    let margins = validation.of(Method::Likelihood).and_then(|of| of.robustness.margins.as_ref().ok());
    let certificate = clock
        .run(Stage::Certify, || Some(certificate(run, &factorisation?.factors, recommended.as_ref().ok()?, margins)));
    let (redesign, pid) = clock.run(Stage::Redesign, || match recommended.as_ref() {
        Ok(model) => match pid(run, model, doubts(Some(model), &data)) {
            None => (redesigned(run, model, found(reduction.as_ref())), None),
            new => (None, new),
        },
        Err(_) => (None, None),
    });
    Ok(Identification {
        settings,
        records,
        data,
        declared,
        recommended,
        filtered,
        hansen: s,
        certificate,
        reduction,
        grey_box,
        grey_box_uncertainty,
        redesign,
        pid,
        direct,
        indirect,
        lines,
        hz,
        validation,
    })
}

/// Separates what costs a method its line from what ends the run: a numerical condition, a record that is too short for the
/// method and a nominal model that the controller does not stabilise are of the first kind, other bad input of the second.
fn own_line<T>(outcome: Result<T>) -> Result<Result<T>> {
    match outcome {
        Err(e) if e.kind() == ErrorKind::BadInput && !e.is_of_the_records() => Err(e),
        outcome => Ok(outcome),
    }
}

/// The same reason where the model is the recommended one.
fn of_recommended(error: Error) -> Error {
    match error {
        Error::NotStabilised { pole, .. } => {
            let cause =
                "the verdict says whether the log agrees with the declared controller, and whether it shows this pole"
                    .to_owned();
            Error::NotStabilised { model: "recommended", pole, cause }
        }
        other => other,
    }
}

/// Factors of a model and the controller, alpha and beta.
fn filtered(
    (model, running): (&StateSpace<Discrete>, &RunningController),
    settings: &RunSettings,
    records: &RunRecords,
    clock: &mut StageClock<'_>,
) -> Result<Filtered> {
    let of_loop = || factorise((model, running), records.sizes(), &settings.factors); // (13)-(15)
    let factorisation = clock.run(Stage::Factor, of_loop)?;
    let settle = settings.factors.settle;
    let of_records = || deviation_signals(&factorisation.factors, &records.estimation, settle); // (28)
    let signals = own_line(clock.run(Stage::Signals, of_records))?;
    Ok(Filtered { factorisation, signals })
}

/// The scheme where it was asked for, and the physical structure that is started from it.
fn structures(
    run: RunContext<'_>,
    context: Option<SchemeContext<'_>>,
) -> (Option<Result<HansenModel>>, Option<Result<GreyBoxRun>>) {
    let asked = run.settings.hansen.is_some() || run.settings.grey_box.is_some();
    let s = context.filter(|_| asked).map(of_scheme);
    let start = found(s.as_ref()).zip(context).map(|(s, context)| SchemeStart {
        factors: &context.factorisation.factors,
        signals: context.signals,
        hansen: s,
    });
    let grey_box = grey_box(run, start);
    (s, grey_box)
}

/// S and G(S).
fn of_scheme(context: SchemeContext<'_>) -> Result<HansenModel> {
    let SchemeContext { run, factorisation, signals } = context;
    let options = run.settings.hansen.clone().unwrap_or_default();
    require_length(&options, run.records, signals.settle)?;
    let found = hansen(&factorisation.factors, &signals.experiments, &options);
    found.map_err(|e| Error::from(e).within(signals.context()))
}
