//! Identification methods: the subspace family, and what is built on it.

pub mod direct;
pub mod fit;
pub mod hansen;
mod identified;
pub mod innovation_form;
pub mod likelihood;
pub mod subspace;
mod verdict;

pub use direct::direct;
pub use hansen::{HansenData, HansenModel, HansenOptions, hansen};
pub use identified::{Deviation, Identified, identify, identify_response};
pub use innovation_form::{InnovationOptions, NoiseForm};
pub use subspace::{
    Experiment, Horizon, Order, Stability, SubspaceData, SubspaceMethod, SubspaceModel, SubspaceOptions,
    UncertaintyMethod, UncertaintyOptions, subspace,
};
