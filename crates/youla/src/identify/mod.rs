//! Identification methods: the subspace family, and what is built on it.

pub mod direct;
pub mod hansen;
mod identified;
pub mod likelihood;
pub mod subspace;
mod verdict;

pub use direct::direct;
pub use hansen::{HansenModel, hansen};
pub use identified::{Deviation, Identified, identify, identify_response};
pub use subspace::{
    Experiment, Order, Stability, SubspaceData, SubspaceMethod, SubspaceModel, SubspaceOptions, subspace,
};
