//! `[redesign]`: a new controller on the model of a run, with what it is worth.

use crate::records::RunRecords;
use crate::stages::context::RunContext;
use crate::stages::reduction::RunReduction;
use crate::{Error, Result};
use youla::factor::CoprimeFactors;
use youla::identify::likelihood::{Recommendation, Region};
use youla::lti::{Discrete, StateSpace};
use youla_loop::redesign::structured::{PidOptions, PidProblem, PidRedesign, design_pid};
use youla_loop::redesign::{Redesign, RedesignOptions, RedesignProblem, redesign};

/// Designs on the reduced model where there is one, else on the recommended plant; every new controller is tested on the plant and its
/// region.
///
/// # Errors
/// As [`redesign`].
pub(crate) fn redesigned(
    run: RunContext<'_>,
    recommended: &Recommendation,
    reduced: Option<&RunReduction>,
) -> Option<Result<Redesign>> {
    let (options, factorisation) = (run.settings.redesign.as_ref()?, run.factorisation?);
    let plant = &recommended.plant;
    let model = reduced.map_or(plant, |r| &r.found.reduction.model);
    Some(design(run.records, (plant, model), &factorisation.factors, &recommended.region, options))
}

/// The PID where `structure` asks for one.
///
/// # Errors
/// As [`design_pid`].
pub(crate) fn pid(run: RunContext<'_>, recommended: &Recommendation) -> Option<Result<PidRedesign>> {
    let options = run.settings.redesign.as_ref()?;
    options.structure?;
    Some(pid_of(run, vec![(&recommended.plant, &recommended.region)], recommended.trusted(), options))
}

/// One PID for plants and their regions at which the controller of a run ran.
///
/// # Errors
/// As [`design_pid`].
pub(crate) fn pid_of(
    run: RunContext<'_>,
    points: Vec<(&StateSpace<Discrete>, &Region)>,
    trusted: bool,
    options: &RedesignOptions,
) -> Result<PidRedesign> {
    let (running, delay) = (run.declared.controller(), run.settings.controller.delay());
    let reference = run.settings.controller.reference_path(running.time())?;
    let problem = PidProblem { points, running, delay, reference, trusted };
    let discretisation = options.pid.discretisation.or(run.settings.controller.discretisation());
    let found = design_pid(&problem, &PidOptions { discretisation, ..options.pid.clone() }, &options.band);
    found.map_err(|e| Error::from(e).within("[redesign]"))
}

/// Designs on `model` and tests on `plant` and its region.
pub(crate) fn design(
    records: &RunRecords,
    (plant, model): (&StateSpace<Discrete>, &StateSpace<Discrete>),
    factors: &CoprimeFactors<Discrete>,
    region: &Region,
    options: &RedesignOptions,
) -> Result<Redesign> {
    if options.structure.is_some() {
        let what = "`structure` in an LQG or Q of a finished run";
        let instead = "state [redesign] structure before the run; in Python youla.redesign(run, structure=\"pid\") takes it afterwards too";
        return Err(Error::Method(youla::Error::Unsupported { what, instead }));
    }
    let (input, output) = records.sizes();
    let problem =
        RedesignProblem { plant, model, factors, region: Some(region), input_size: &input, output_size: &output };
    redesign(&problem, options).map_err(|e| Error::from(e).within("[redesign]"))
}
