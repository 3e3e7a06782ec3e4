//! Direct identification: the plant from u and y as if the loop were open.
//!
//! The estimate is biased where the inputs contain fed-back noise; it is the baseline that the Hansen scheme is measured
//! against.

use super::subspace::{Experiment, SubspaceModel, SubspaceOptions, subspace};
use crate::Result;
use crate::lti::Discrete;

/// A plant model identified from measured inputs and outputs without regard to the loop.
#[derive(Debug, Clone)]
pub struct DirectModel {
    /// The estimate of the plant.
    pub plant: SubspaceModel,
}

/// Identifies the plant from its measured inputs u and outputs y.
///
/// # Errors
/// Those of [`subspace`].
pub fn direct(experiments: &[Experiment<'_>], time: Discrete, options: &SubspaceOptions) -> Result<DirectModel> {
    Ok(DirectModel { plant: subspace(experiments, time, options)? })
}
