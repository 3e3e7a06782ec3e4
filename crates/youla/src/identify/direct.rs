//! Direct identification: the plant from u and y as if the loop were open.
//!
//! The estimate is biased where the inputs contain fed-back noise; it is the baseline that the Hansen scheme is measured
//! against.

use super::subspace::{Experiment, SubspaceModel, SubspaceOptions, subspace};
use crate::Result;
use crate::lti::Discrete;

/// Identifies the plant from its measured inputs u and outputs y, without regard to the loop.
///
/// # Errors
/// Those of [`super::subspace::subspace`].
pub fn direct(experiments: &[Experiment<'_>], time: Discrete, options: &SubspaceOptions) -> Result<SubspaceModel> {
    subspace(experiments, time, options)
}
