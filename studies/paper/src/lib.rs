//! The paper as a computation: its gas bearing, the digital twin of the rig, its study and its experiments, every figure and table.

pub mod bearing_structure;
pub mod demo;
mod error;
pub mod rig;
pub mod run;
pub mod story;
pub mod study;

pub use bearing_structure::BearingStructure;
pub use demo::{Demo, demo};
pub use error::{Error, Result};
