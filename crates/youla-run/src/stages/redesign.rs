//! `[redesign]`: a new controller on the model of a run, with what it is worth.

use crate::stages::context::RunContext;
use crate::stages::reduction::RunReduction;
use crate::{Error, Result};
use youla::identify::likelihood::Recommendation;
use youla_loop::redesign::{Redesign, RedesignProblem, redesign};

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
    let (input, output) = run.records.sizes();
    let problem = RedesignProblem {
        plant: &recommended.plant,
        model: reduced.map_or(&recommended.plant, |r| &r.found.reduction.model),
        factors: &factorisation.factors,
        region: Some(&recommended.region),
        input_size: &input,
        output_size: &output,
    };
    Some(redesign(&problem, options).map_err(|e| Error::from(e).within("[redesign]")))
}
