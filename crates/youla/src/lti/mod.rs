//! Linear time-invariant systems.

mod connect;
mod partitioned;
mod scaling;
mod state_space;
mod time;
mod transfer;

pub use partitioned::Partitioned;
pub use state_space::StateSpace;
pub use time::{Continuous, Discrete, TimeDomain};
pub use transfer::PolynomialMatrix;
