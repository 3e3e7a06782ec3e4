//! The reduction of a run: in its loop, scaled where the method needs it.

use crate::Result;
use crate::records::RunRecords;
use youla::factor::CoprimeFactors;
use youla::lti::{Discrete, StateSpace};
use youla::reduce::{LoopReduction, ReductionLoop, ReductionMethod, ReductionOptions, reduce_in_loop};

/// A reduction and the scales on which it rests.
#[derive(Debug, Clone)]
pub struct RunReduction {
    /// The options as they were used: with the scales that the records gave.
    pub options: ReductionOptions,
    /// The reduced model, its loop and all orders.
    pub found: LoopReduction<Discrete>,
}

/// Reduces the plant in its loop. Normalised coprime factors depend on the unit of the outputs against that of the inputs: where no
/// scales are given, the rms of the estimation records is theirs.
pub(crate) fn run_reduction(
    factors: &CoprimeFactors<Discrete>,
    plant: &StateSpace<Discrete>,
    records: &RunRecords,
    options: &ReductionOptions,
) -> Result<RunReduction> {
    let mut options = options.clone();
    if options.method == ReductionMethod::NormalisedCoprime {
        let (inputs, outputs) = records.sizes();
        options.output_scale.get_or_insert(outputs);
        options.input_scale.get_or_insert(inputs);
    }
    let model = ReductionLoop::of_plant(factors, plant)?;
    let found = reduce_in_loop(&model, &options)?;
    Ok(RunReduction { options, found })
}
