//! The circle of commissioning on a machine: excite, record, identify, redesign, switch and verify, under stated limits.

mod bench;
mod error;
mod identify;
mod parameter;
mod running;
mod station;
mod target;

pub use error::{Error, Result};
pub use running::LoopDescription;

#[cfg(test)]
mod tests;
