//! Parts of a run alone, for programs that hold records and results in memory: the recommended model, and a new controller on a
//! finished run.

use crate::records::RunRecords;
use crate::result::Identification;
use crate::settings::RunSettings;
use crate::stages::context::RunContext;
use crate::stages::factors::{declared_loop, factorise};
use crate::stages::recommend::recommend;
use crate::stages::redesign::{design, pid_of, redesigned};
use crate::{Error, Result};
use std::path::Path;
use youla::identify::likelihood::{Recommendation, Region};
use youla::lti::{Discrete, StateSpace};
use youla_loop::redesign::structured::PidRedesign;
use youla_loop::redesign::{Redesign, RedesignOptions};

/// The recommended model of a run without anything else, wrong samples not looked for; paths are relative to `folder`.
///
/// # Errors
/// Those of [`crate::identify`] and of [`youla::identify()`].
pub fn recommend_alone(settings: &RunSettings, records: &RunRecords, folder: &Path) -> Result<Recommendation> {
    settings.check()?;
    let declared = declared_loop(settings, records, folder)?;
    recommend(RunContext { settings, records, declared: &declared, factorisation: None }, false)
}

/// A new controller on the plant and region of a run that was kept, designed on `model`.
///
/// # Errors
/// As [`redesign_of`]; whatever is wrong with nominal model and controller.
pub fn redesign_kept(
    settings: &RunSettings,
    records: &RunRecords,
    (plant, model): (&StateSpace<Discrete>, &StateSpace<Discrete>),
    region: &Region,
    options: &RedesignOptions,
) -> Result<Redesign> {
    let declared = declared_loop(settings, records, Path::new("."))?;
    let base = declared.nominal.as_ref().unwrap_or(plant);
    let factors = factorise((base, &declared.running), records.sizes(), &settings.factors)?.factors;
    design(records, (plant, model), (&factors, settings.controller.delay()), region, options)
}

/// One PID for the plants and regions of runs that were kept, with what speaks against any of them, as `[redesign] structure = "pid"` with these options gives it for one; settings
/// and records are those of the first run, whose controller ran at all points.
///
/// # Errors
/// As [`youla_loop::redesign::structured::design_pid`]; whatever is wrong with the controller.
pub fn pid_kept(
    settings: &RunSettings,
    records: &RunRecords,
    points: Vec<(&StateSpace<Discrete>, &Region)>,
    doubts: Vec<String>,
    options: &RedesignOptions,
) -> Result<PidRedesign> {
    let declared = declared_loop(settings, records, Path::new("."))?;
    pid_of(RunContext { settings, records, declared: &declared, factorisation: None }, points, doubts, options)
}

/// A new controller on the result of a run, as `[redesign]` with these options gives it.
///
/// # Errors
/// Those of [`youla_loop::redesign::redesign`]; the reason why the run has no factors or no model.
pub fn redesign_of(run: &Identification, options: &RedesignOptions) -> Result<Redesign> {
    let settings = RunSettings { redesign: Some(options.clone()), ..run.settings.clone() };
    let missing = || {
        Error::Method(youla::Error::Unsupported {
            what: "a redesign of a run without coprime factors or without a recommended model",
            instead: "its summary states under `refused` why there are none",
        })
    };
    let filtered = run.filtered.as_ref().map_err(|_| missing())?;
    let model = run.recommended.as_ref().map_err(|_| missing())?;
    let (records, declared, factorisation) = (&run.records, &run.declared, Some(&filtered.factorisation));
    let context = RunContext { settings: &settings, records, declared, factorisation };
    redesigned(context, model, run.reduced()).unwrap_or_else(|| Err(missing()))
}
