//! Controller design with positive feedback: state feedback `u = F x` and observer gain L with `A + B F` and `A + L C`
//! stable.

mod kalman;
mod lqr;

pub use kalman::{NoiseCovariance, ObserverGain, kalman};
pub use lqr::{LqrWeights, StateFeedback, flip_feedback_sign, lqr};
