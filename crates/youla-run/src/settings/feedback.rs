//! The sign in which a controller is written down.

use serde::{Deserialize, Serialize};

/// Which sign the controller was written down with; never guessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Feedback {
    /// `u = K (r - y)`; for observer gains `u = -F x` and `x+ = A x + B u + L (y - C x - D u)`, as MATLAB's lqr and place
    /// return them.
    Negative,
    /// `u = K (y - r)`; for observer gains `u = F x` and `x+ = A x + B u + L (C x + D u - y)`.
    Positive,
}

impl Feedback {
    /// The factor that turns a gain written in this convention into one of positive feedback.
    pub(super) fn sign(self) -> f64 {
        match self {
            Feedback::Negative => -1.0,
            Feedback::Positive => 1.0,
        }
    }
}
