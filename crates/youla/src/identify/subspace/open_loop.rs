//! MOESP, N4SID and CVA: A and C from the projection of the future outputs along the past, beyond the future inputs.

use super::factorisation::DataTriangle;
use super::hankel::HankelFactor;
use super::order::{Evidence, choose};
use super::projection::{canonical_correlations, project};
use super::realisation::{OutputPair, StateSequences, realise};
use super::{Estimate, SubspaceOptions, innovation, stability};
use crate::Result;
use crate::lti::Discrete;
use faer::Mat;

/// A, C and the innovations by the method that the weight names.
pub(super) fn estimate(data: &DataTriangle, options: &SubspaceOptions, time: Discrete) -> Result<Estimate> {
    let factor = HankelFactor::new(data, options.past(), options.horizon)?;
    let excitation_rcond = factor.require_excitation()?;
    let projection = project(&factor, options.weight)?;
    let order = choose(
        options.order,
        Evidence {
            inputs: factor.inputs,
            outputs: factor.outputs,
            horizon: factor.horizon,
            columns: factor.columns,
            singular_values: &projection.singular_values,
            canonical_correlations: canonical_correlations(&factor, &projection)?,
        },
    )?;
    let states = StateSequences::new(&factor, projection.observability(order.order))?;
    let (pair, stability) = stability::apply(options.stability, realise(options.weight, &states)?, time)?;
    let innovation = innovation::identify(states.residuals(&pair), states.present_outputs(), factor.columns, &pair);
    Ok(Estimate {
        pair,
        stability,
        innovation,
        singular_values: projection.singular_values,
        order,
        columns: factor.columns,
        excitation_rcond,
        factor: factor.report,
    })
}

/// A and C alone for a given order, with the Kalman gain where it is asked for.
pub(super) fn pair_and_gain(
    data: &DataTriangle,
    options: &SubspaceOptions,
    order: usize,
    with_gain: bool,
) -> Result<(OutputPair, Option<Mat<f64>>)> {
    let factor = HankelFactor::new(data, options.past(), options.horizon)?;
    let projection = project(&factor, options.weight)?;
    let states = StateSequences::new(&factor, projection.observability(order))?;
    let pair = realise(options.weight, &states)?;
    let gain = match with_gain {
        true => innovation::identify(states.residuals(&pair), states.present_outputs(), factor.columns, &pair)
            .gain()
            .map(|gain| gain.to_owned()),
        false => None,
    };
    Ok((pair, gain))
}
