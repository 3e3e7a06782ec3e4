//! The cases.

use serde::{Deserialize, Serialize};

/// Records and starts of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum StartCase {
    /// Loops of the study of the paper with theta from 0 to 0.95 and a noise of 0.2 um rms; the start is the nominal model.
    #[serde(rename = "loop-0.2")]
    Loop02,
    /// The same with 1 um rms.
    #[serde(rename = "loop-1.0")]
    Loop10,
    /// Open loop; the true damping is a twentieth of that of the bearing. All parameters start at 0.4 to 2 times the truth.
    #[serde(rename = "light-damping")]
    LightDamping,
    /// Open loop under periodic square waves of 50 and 70 Hz. All parameters start at 0.2 to 0.4 times the truth.
    #[serde(rename = "periodic")]
    Periodic,
    /// Open loop; each parameter by itself starts within a factor of 8 around the truth.
    #[serde(rename = "far-start")]
    FarStart,
    /// Loops under square waves with holds of 5 to 60 samples, theta from 0.6 to 0.95.
    #[serde(rename = "slow-squares")]
    SlowSquares,
}

impl StartCase {
    /// All cases in the order in which they are listed.
    pub const ALL: [StartCase; 6] = [
        StartCase::Loop02,
        StartCase::Loop10,
        StartCase::LightDamping,
        StartCase::Periodic,
        StartCase::FarStart,
        StartCase::SlowSquares,
    ];

    /// Key in files and on the command line.
    pub fn key(self) -> &'static str {
        match self {
            StartCase::Loop02 => "loop-0.2",
            StartCase::Loop10 => "loop-1.0",
            StartCase::LightDamping => "light-damping",
            StartCase::Periodic => "periodic",
            StartCase::FarStart => "far-start",
            StartCase::SlowSquares => "slow-squares",
        }
    }

    /// What it is, in words.
    pub fn describe(self) -> &'static str {
        match self {
            StartCase::Loop02 => {
                "loops of the study, theta from 0 to 0.95, noise 0.2 um rms; start at the nominal model"
            }
            StartCase::Loop10 => "loops of the study, theta from 0 to 0.95, noise 1 um rms; start at the nominal model",
            StartCase::LightDamping => {
                "open loop, a twentieth of the damping, square waves with holds of 5 to 20 samples; all parameters start at one \
                 factor from 0.4 to 2 of the truth"
            }
            StartCase::Periodic => {
                "open loop, periodic square waves of 50 and 70 Hz; all parameters start at one factor from 0.2 to 0.4 of the truth"
            }
            StartCase::FarStart => {
                "open loop, square waves with holds of 5 to 20 samples; each parameter starts at its own factor from 1/8 to 8 of \
                 the truth"
            }
            StartCase::SlowSquares => {
                "loops under square waves with holds of 5 to 60 samples, theta from 0.6 to 0.95, noise 0.2 um rms; start at the \
                 nominal model"
            }
        }
    }

    /// What [`super::StartRow::setting`] is.
    pub fn setting(self) -> &'static str {
        match self {
            StartCase::FarStart => "largest factor",
            StartCase::LightDamping | StartCase::Periodic => "start factor",
            _ => "theta",
        }
    }

    /// The case with this key.
    pub fn of_key(key: &str) -> Option<StartCase> {
        StartCase::ALL.into_iter().find(|case| case.key() == key)
    }

    /// Whether there is a controller.
    pub fn in_loop(self) -> bool {
        matches!(self, StartCase::Loop02 | StartCase::Loop10 | StartCase::SlowSquares)
    }

    /// Items where no number is asked for.
    pub(super) fn usual_items(self) -> usize {
        if matches!(self, StartCase::Loop02 | StartCase::Loop10) { 500 } else { 100 }
    }
}
