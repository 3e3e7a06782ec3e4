//! `[redesign]`: a new controller on the model of a run, with what it is worth.

use crate::records::RunRecords;
use crate::stages::context::RunContext;
use crate::stages::reduction::RunReduction;
use crate::{Error, Result};
use youla::factor::CoprimeFactors;
use youla::identify::likelihood::{Recommendation, Region};
use youla::lti::{Discrete, StateSpace};
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

/// Designs on `model` and tests on `plant` and its region.
pub(crate) fn design(
    records: &RunRecords,
    (plant, model): (&StateSpace<Discrete>, &StateSpace<Discrete>),
    factors: &CoprimeFactors<Discrete>,
    region: &Region,
    options: &RedesignOptions,
) -> Result<Redesign> {
    let (input, output) = records.sizes();
    let problem =
        RedesignProblem { plant, model, factors, region: Some(region), input_size: &input, output_size: &output };
    redesign(&problem, options).map_err(|e| Error::from(e).within("[redesign]"))
}
