//! Linear time-invariant systems.

mod state_space;
mod time;

pub use state_space::StateSpace;
pub use time::{Continuous, Discrete, TimeDomain};
