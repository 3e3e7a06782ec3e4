//! The driver: from records, nominal model and controller to models with evidence. Read this file first.

use super::certificate::certificate;
use super::check::check_records;
use super::context::RunContext;
use super::direct::direct;
use super::factorise::factorise_run;
use super::grey_box::grey_box;
use super::identification::{Identification, found};
use super::records::RunRecords;
use super::redesign::redesigned;
use super::reduction::run_reduction;
use super::response::{check_grid, grid, indirect};
use super::scheme::{Scheme, require_length, scheme};
use super::settings::RunSettings;
use super::signals::deviation_signals;
use super::stabilisation::Diagrams;
use super::stage::{Stage, StageClock};
use super::uncertainty::run_uncertainty;
use super::verdict::{Candidates, verify};
use crate::{Error, Result};
use std::path::Path;

/// Runs the modified Hansen scheme on records of a closed loop, beside direct identification.
///
/// A direct model, a reduction, an indirect response or a redesign that is impossible does not end the run: its field of the
/// result holds the reason.
///
/// # Errors
/// Whatever makes the scheme itself impossible; see the functions called here in turn.
pub fn identify(
    settings: RunSettings,
    records: RunRecords,
    folder: &Path,
    clock: &mut StageClock<'_>,
) -> Result<Identification> {
    settings.check()?;
    check_grid(&settings.frequency_response, records.time)?;
    let factorisation = clock.run(Stage::Factor, || factorise_run(&settings, &records, folder))?; // (13)-(15)
    let run = RunContext { settings: &settings, records: &records, factorisation: &factorisation };
    let factors = &factorisation.factors;
    let (signals, data) = clock.run(Stage::Signals, || {
        let signals = deviation_signals(factors, &records.estimation, settings.factors.settle)?; // (28)
        Ok::<_, Error>((signals, check_records(&settings, &records, &factorisation.controller)?))
    })?;
    require_length(&settings.hansen, &records, signals.settle)?;
    let (scheme, direct, grey_box) = clock.run(Stage::Identify, || {
        let (scheme, direct) = rayon::join(|| scheme(run, &signals), || direct(&records, &settings)); // (25), (17)
        let grey_box = scheme.as_ref().ok().and_then(|scheme| grey_box(run, &signals, &scheme.hansen));
        (scheme, direct, grey_box)
    });
    let Scheme { hansen, refinement, diagram } = scheme.map_err(|e| e.within(signals.context()))?;
    let (direct, direct_diagram) = direct;
    let diagrams = Diagrams { deviation: Some(diagram), direct: direct_diagram };
    let reduction = clock.run(Stage::Reduce, || {
        settings.reduction.as_ref().map(|options| run_reduction(factors, &hansen, &records, options)) // (29)
    });
    let hz = grid(&settings.frequency_response, [&factorisation.nominal, &hansen.plant])?;
    let intervals = found(grey_box.as_ref()).and_then(|run| run.intervals.as_ref().ok());
    let uncertainty = run_uncertainty(&hansen, intervals, &hz, settings.hansen.uncertainty.level)?;
    let candidates = Candidates {
        hansen: &hansen,
        direct: found(direct.as_ref()),
        reduction: found(reduction.as_ref()),
        grey_box: found(grey_box.as_ref()),
    };
    // (26), the loop certificate and the response that rests on no model.
    let (indirect, verdict) =
        clock.run(Stage::Validate, || Ok::<_, Error>((indirect(run, &signals), verify(run, &candidates)?)))?;
    let certificate = clock.run(Stage::Certify, || certificate(run, &signals, &hansen))?;
    let redesign = clock.run(Stage::Redesign, || redesigned(run, &hansen, candidates.reduction));
    Ok(Identification {
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
        indirect,
        verdict,
        certificate,
        redesign,
    })
}
