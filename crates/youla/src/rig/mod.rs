//! Simulated machines: the gas bearing of the paper.

mod bearing;

pub use bearing::{Bearing, degraded};
