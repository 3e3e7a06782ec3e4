//! Linear time-invariant systems.

mod connect;
mod discretise;
mod eigen;
mod gains;
mod initial;
mod minimal;
pub mod modes;
mod norms;
mod partitioned;
mod response;
mod scaling;
mod simulate;
mod state_space;
mod time;
mod transfer;
mod visible;
mod zeros;

pub use eigen::Eigen;
pub use eigen::SharedMode;
pub(crate) use gains::{largest_singular_direction, largest_singular_value};
pub use initial::simulate_best;
pub use modes::Mode;
pub(crate) use norms::{Curve, Part, below_level, continuous_image, crossings};
pub use norms::{PeakGain, PeakOptions, h2_norm, hinf_norm, linf_norm};
pub use partitioned::Partitioned;
pub use response::{FrequencyResponse, frequency_response};
pub(crate) use simulate::simulate_joined;
pub use simulate::{SimulationState, Simulator, simulate};
pub use state_space::StateSpace;
pub use time::{Continuous, Discrete, TimeDomain};
pub use transfer::PolynomialMatrix;
pub use visible::{VisibleMode, VisibleModes};
