//! `[redesign]`: a new controller on the model of a run, with what it is worth.

use crate::check::DataCheck;
use crate::records::RunRecords;
use crate::stages::context::RunContext;
use crate::stages::reduction::RunReduction;
use crate::{Error, Result};
use youla::factor::CoprimeFactors;
use youla::identify::likelihood::{Evidence, Recommendation, Region, TestOutcome};
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
    let delay = run.settings.controller.delay();
    Some(design(run.records, (plant, model), (&factorisation.factors, delay), &recommended.region, options))
}

/// What speaks against a design on a run: a model that is not trusted, and a stated controller, with its delay and its units, that is not the
/// one in the log.
pub(crate) fn doubts(recommended: Option<&Recommendation>, data: &DataCheck) -> Vec<String> {
    let model = "the model is not trusted, and what is proved on its region may not hold";
    let untrusted = recommended.is_some_and(|model| !model.trusted()).then(|| model.to_owned());
    let another = data.findings.iter().find(|f| f.shows_another_controller());
    let shown = another.map(|f| format!("{}. {}", f.what, f.advice));
    let failed = |e: &&Evidence| e.question.ends_with("(controller)") && e.outcome == TestOutcome::Failed;
    let refuted = || recommended?.evidence.iter().find(failed).map(Evidence::to_string);
    let controller = shown.or_else(refuted).map(|why| {
        format!("the design takes over delay and units of the stated controller, and the log shows another one: {why}")
    });
    untrusted.into_iter().chain(controller).collect()
}

/// The PID where `structure` asks for one.
///
/// # Errors
/// As [`design_pid`].
pub(crate) fn pid(
    run: RunContext<'_>,
    recommended: &Recommendation,
    doubts: Vec<String>,
) -> Option<Result<PidRedesign>> {
    let options = run.settings.redesign.as_ref()?;
    options.structure?;
    Some(pid_of(run, vec![(&recommended.plant, &recommended.region)], doubts, options))
}

/// One PID for plants and their regions at which the controller of a run ran.
///
/// # Errors
/// As [`design_pid`].
pub(crate) fn pid_of(
    run: RunContext<'_>,
    points: Vec<(&StateSpace<Discrete>, &Region)>,
    doubts: Vec<String>,
    options: &RedesignOptions,
) -> Result<PidRedesign> {
    let (running, delay) = (run.declared.controller(), run.settings.controller.delay());
    let reference = run.settings.controller.reference_path(running.time())?;
    let problem = PidProblem { points, running, delay, reference, doubts };
    let discretisation = options.pid.discretisation.or(run.settings.controller.discretisation());
    let found = design_pid(&problem, &PidOptions { discretisation, ..options.pid.clone() }, &options.band);
    found.map_err(|e| Error::from(e).within("[redesign]"))
}

/// Designs on `model` and tests on `plant` and its region.
pub(crate) fn design(
    records: &RunRecords,
    (plant, model): (&StateSpace<Discrete>, &StateSpace<Discrete>),
    (factors, delay): (&CoprimeFactors<Discrete>, usize),
    region: &Region,
    options: &RedesignOptions,
) -> Result<Redesign> {
    if options.structure.is_some() {
        let what = "`structure` in an LQG or Q of a finished run";
        let instead = "state [redesign] structure before the run; in Python youla.redesign(run, structure=\"pid\") takes it afterwards too";
        return Err(Error::Method(youla::Error::Unsupported { what, instead }));
    }
    let (input, output) = records.sizes();
    let problem = RedesignProblem {
        plant,
        model,
        factors,
        region: Some(region),
        input_size: &input,
        output_size: &output,
        delay,
    };
    redesign(&problem, options).map_err(|e| Error::from(e).within("[redesign]"))
}
