//! Direct identification: the plant from u and y as if the loop were open.
//!
//! The estimate is biased where the inputs contain fed-back noise; it is the baseline that the Hansen scheme is measured
//! against.

use super::subspace::{Experiment, SubspaceData, SubspaceModel, SubspaceOptions};
use crate::lti::Discrete;
use crate::{MatRef, Result};

/// Identifies the plant from its measured inputs u and outputs y, without regard to the loop.
///
/// # Errors
/// Those of [`super::subspace::subspace`].
pub fn direct(experiments: &[Experiment<'_>], time: Discrete, options: &SubspaceOptions) -> Result<SubspaceModel> {
    direct_disturbed(experiments, &[], time, options)
}

/// The same for outputs with disturbances of known shape, one matrix of known signals (samples x signals) for each
/// experiment, or none at all; [`SubspaceModel::disturbances`] are their coefficients.
///
/// # Errors
/// As [`direct`]; shapes of the known signals.
pub fn direct_disturbed(
    experiments: &[Experiment<'_>],
    disturbances: &[MatRef<'_, f64>],
    time: Discrete,
    options: &SubspaceOptions,
) -> Result<SubspaceModel> {
    SubspaceData::disturbed(experiments, disturbances, time, options)?.identify(options)
}
