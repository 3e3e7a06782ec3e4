//! Controller design with positive feedback (state feedback `u = F x` and observer gain L with `A + B F` and `A + L C`
//! stable) and the loops that controllers close.

mod closed_loop;
mod gap;
mod kalman;
mod lqr;
mod margin;
mod margins;
mod observer_controller;
mod real_time;
mod running_controller;

pub use closed_loop::{closed_loop, with_input_port};
pub(crate) use gap::normalised_right_factors;
pub use gap::{ChannelScales, NuGap, coprime_margin, nu_gap};
pub use kalman::{NoiseCovariance, ObserverGain, kalman};
pub use lqr::{LqrWeights, StateFeedback, flip_feedback_sign, lqr};
pub use margin::peak_sensitivity;
pub use margins::{
    ChannelMargins, DelayLimit, DiskMargin, DiskMargins, GainLimit, IsoZone, Margins, PhaseLimit, margins,
};
pub use margins::{LinearMargins, MARGIN_NAMES};
pub use observer_controller::observer_controller;
pub use real_time::real_time_controller;
pub use running_controller::RunningController;
