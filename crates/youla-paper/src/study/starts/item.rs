//! One item: every search from its start, verification without noise.

use super::super::item::{Evaluated, Laps, fit_on, reflected};
use super::super::row::Status;
use super::case::StartCase;
use super::problem::{Problem, theta_of};
use super::row::StartRow;
use super::search::Search;
use super::settings::StartsSettings;
use crate::BearingStructure;
use crate::{Error, Result};
use youla::identify::subspace::Experiment;
use youla_greybox::hansen_pem::{HansenPemOptions, SchemeData, hansen_pem};
use youla_greybox::subspace_pem::{SubspacePemOptions, subspace_pem};
use youla_greybox::{
    GreyBoxModel, MultiStartOptions, Problem as GreyBoxProblem, StructureFit, greybox, greybox_multi_start,
};

/// Runs item number `index` of a case: one row per search of [`Search::of`]. A search that leads to no model, an unstable model,
/// and a loop without a controller are outcomes.
///
/// # Errors
/// Those of settings without meaning.
pub fn evaluate_starts(case: StartCase, index: usize, settings: &StartsSettings) -> Result<Evaluated<StartRow>> {
    let mut clock = Laps::start();
    let problem = match Problem::new(case, index, settings) {
        Ok(problem) => problem,
        Err(refused @ Error::NoController { .. }) => return Ok(without_loop(case, index, settings, &refused)),
        Err(other) => return Err(other),
    };
    clock.lap();
    let rows = Search::of(case)
        .map(|search| {
            let row = row(&problem, index, search, settings);
            clock.lap();
            row
        })
        .collect();
    Ok(Evaluated { rows, durations: clock.laps })
}

/// The rows of a loop that no controller closes with the margin.
fn without_loop(case: StartCase, index: usize, settings: &StartsSettings, refused: &Error) -> Evaluated<StartRow> {
    let setting = theta_of(case, index, settings);
    let row = |search| StartRow {
        status: Status::NoController,
        note: refused.to_string(),
        ..StartRow::without_model(index, setting, search)
    };
    Evaluated { rows: Search::of(case).map(row).collect(), durations: Vec::new() }
}

/// The model of a search, and what its own diagnostics say.
struct Found {
    model: GreyBoxModel,
    local_minimum_suspected: bool,
    note: String,
}

fn row(problem: &Problem, index: usize, search: Search, settings: &StartsSettings) -> StartRow {
    let empty = StartRow::without_model(index, problem.setting, search);
    let judged = find(problem, search, settings).and_then(|found| {
        let fit = fit_on(&problem.verification, &found.model.model)?;
        Ok((fit, found))
    });
    match judged {
        Ok((fit, Found { model, local_minimum_suspected, note })) => StartRow {
            status: if model.stable { Status::Stable } else { Status::Unstable },
            fit,
            cost: model.cost,
            steps: Some(model.iterations),
            local_minimum_suspected,
            note,
            ..empty
        },
        Err(error) => StartRow { note: error.to_string(), ..empty },
    }
}

fn find(problem: &Problem, search: Search, settings: &StartsSettings) -> Result<Found> {
    let (time, start, pem) = (problem.time, &problem.start, &settings.paper.pem);
    let record = [Experiment::new(problem.estimation.u.as_ref(), problem.estimation.y.as_ref())];
    let plain = |model| Found { model, local_minimum_suspected: false, note: String::new() };
    match search {
        Search::Truth => {
            Ok(greybox(&GreyBoxProblem::new(&BearingStructure, &record, time), &problem.truth, pem).map(plain)?)
        }
        Search::Pem => Ok(greybox(&GreyBoxProblem::new(&BearingStructure, &record, time), start, pem).map(plain)?),
        Search::PemMultiStart => {
            let options = MultiStartOptions { pem: pem.clone(), ..settings.multi_start.clone() };
            Ok(greybox_multi_start(&GreyBoxProblem::new(&BearingStructure, &record, time), start, &options)
                .map(|found| plain(found.model))?)
        }
        Search::HansenPem => from_hansen(problem, &record, settings),
        Search::SubspacePem => {
            let subspace = settings.subspace.clone();
            let options = SubspacePemOptions { subspace, pem: pem.clone(), ..Default::default() };
            let found = subspace_pem(&GreyBoxProblem::new(&BearingStructure, &record, time), None, &options)?;
            let note = projection_note(&found.projections)?.unwrap_or_default();
            Ok(Found { local_minimum_suspected: found.local_minimum_suspected(), note, model: found.model })
        }
    }
}

fn from_hansen(problem: &Problem, record: &[Experiment<'_>], settings: &StartsSettings) -> Result<Found> {
    let (what, instead) = ("hansen_pem on a record of an open loop", "take another search");
    let Some(design) = &problem.design else {
        return Err(Error::Method(youla::Error::Unsupported { what, instead }));
    };
    let signals = [design.factors.signals(record[0].u, record[0].y)?];
    let paper = &settings.paper;
    let options = HansenPemOptions { hansen: paper.hansen.clone(), pem: paper.pem.clone(), ..Default::default() };
    let data = SchemeData { factors: &design.factors, signals: &signals };
    let found = hansen_pem(data, &GreyBoxProblem::new(&BearingStructure, record, problem.time), None, &options)?;
    let notes = [Some(reflected(&found.hansen)).filter(|note| !note.is_empty()), projection_note(&found.projections)?];
    let note = notes.into_iter().flatten().collect::<Vec<_>>().join("; ");
    Ok(Found { local_minimum_suspected: found.local_minimum_suspected(), note, model: found.model })
}

/// Whether the projection from which the search started is unstable.
fn projection_note(projections: &[StructureFit]) -> Result<Option<String>> {
    let stable = projections.first().map_or(Ok(true), |best| best.model.is_stable())?;
    Ok((!stable).then(|| "the best projection is unstable".into()))
}
