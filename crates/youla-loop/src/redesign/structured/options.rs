//! Choices of a PID design and the limits that it keeps.

use super::pid::Discretisation;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The structure of a new controller, where it is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerStructure {
    /// P, PI, PD or PID with a filtered derivative and notches, one for each loop of a machine with as many outputs as inputs.
    Pid,
}

/// The parts of a PID.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PidTerms {
    /// Proportional.
    P,
    /// Proportional and integral.
    Pi,
    /// Proportional and filtered derivative.
    Pd,
    /// All three.
    #[default]
    Pid,
}

impl PidTerms {
    /// Whether there is an integral part.
    pub(crate) fn integral(self) -> bool {
        matches!(self, PidTerms::Pi | PidTerms::Pid)
    }

    /// Whether there is a derivative part.
    pub(crate) fn derivative(self) -> bool {
        matches!(self, PidTerms::Pd | PidTerms::Pid)
    }
}

/// The table `[redesign.pid]` of run.toml: what is designed, and the limits that hold at every drawn model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PidOptions {
    /// Parts of the controller.
    pub terms: PidTerms,
    /// Notches behind it, at most 4.
    pub notches: usize,
    /// The rule by which integral and derivative are programmed; when absent, that of the running controller where it is such a PID,
    /// backward differences otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub discretisation: Option<Discretisation>,
    /// Largest peak of the sensitivity. 2 keeps a gain margin of 2 and a phase margin of 29 degrees by itself (Åström and Hägglund,
    /// Advanced PID Control, section 4.6, recommend 1.2 to 2).
    pub peak_sensitivity: f64,
    /// Least factor by which the gain may rise, or fall where less gain is unstable too.
    pub gain_margin: f64,
    /// Least phase margin, degrees.
    pub phase_margin: f64,
    /// Least delay margin, seconds.
    pub delay_margin: f64,
    /// Largest rms of u per rms of white noise of the sensor, as a factor of that of the running controller.
    pub command_effort: f64,
}

impl Default for PidOptions {
    fn default() -> Self {
        PidOptions {
            terms: PidTerms::default(),
            notches: 0,
            discretisation: None,
            peak_sensitivity: 2.0,
            gain_margin: 2.0,
            phase_margin: 30.0,
            delay_margin: 0.0,
            command_effort: 2.0,
        }
    }
}

/// More notches are searched for in vain: each has three parameters. Chosen, not measured.
const MOST_NOTCHES: usize = 4;

/// A key, its value, what it must be, and whether it is.
type Key<'a> = (&'static str, f64, &'static str, &'a dyn Fn(f64) -> bool);

impl PidOptions {
    /// Whether all is as by default.
    pub fn is_default(&self) -> bool {
        *self == PidOptions::default()
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// [`youla::Error::OutOfRange`] with the key of run.toml.
    pub fn check(&self) -> Result<()> {
        let at_least = |least: f64| move |v: f64| v >= least && v.is_finite();
        let above = |v: f64| v > 1.0 && v.is_finite();
        let few = |v: f64| v <= MOST_NOTCHES as f64;
        let keys: [Key<'_>; 6] = [
            ("notches", self.notches as f64, "at most 4", &few),
            ("peak_sensitivity", self.peak_sensitivity, "above 1", &above),
            ("gain_margin", self.gain_margin, "a factor from 1 to 5 (6 dB are 2)", &|v| (1.0..=5.0).contains(&v)),
            ("phase_margin", self.phase_margin, "0 for none, or from 5 to 90 degrees", &|v| {
                v == 0.0 || (5.0..=90.0).contains(&v)
            }),
            ("delay_margin", self.delay_margin, "zero or a time in seconds", &at_least(0.0)),
            ("command_effort", self.command_effort, "positive", &|v| v > 0.0 && v.is_finite()),
        ];
        match keys.into_iter().find(|(_, value, _, good)| !good(*value)) {
            None => Ok(()),
            Some((key, value, must, _)) => {
                let what = format!("[redesign.pid] {key}");
                Err(Error::Method(youla::Error::OutOfRange { what, value, must }))
            }
        }
    }
}
