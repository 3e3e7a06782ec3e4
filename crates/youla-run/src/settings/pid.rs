//! PID controllers of run.toml, in parallel and in ideal form; how they are computed is in [`youla_loop::redesign::structured`].

use super::feedback::Feedback;
use crate::Result;
use serde::{Deserialize, Serialize};
use youla::lti::{Discrete, StateSpace};
pub use youla_loop::redesign::structured::Discretisation;
use youla_loop::redesign::structured::PidGains;

/// PID in its parallel form, `kp + ki/s + kd s/(1 + derivative_filter s)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ParallelPid {
    /// Sign in which the controller is written down; never guessed.
    pub feedback: Feedback,
    /// The rule by which integral and derivative were programmed.
    pub discretisation: Discretisation,
    /// Proportional gain.
    pub kp: f64,
    /// Integral gain, per second.
    #[serde(default)]
    pub ki: f64,
    /// Derivative gain, seconds.
    #[serde(default)]
    pub kd: f64,
    /// Time constant of the filter of the derivative, seconds.
    #[serde(default)]
    pub derivative_filter: f64,
    /// Dead time in whole samples, beyond what the controller itself delays.
    #[serde(default)]
    pub delay: usize,
}

/// PID in its ideal form, `kp (1 + 1/(ti s) + td s/(1 + derivative_filter s))`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdealPid {
    /// Sign in which the controller is written down; never guessed.
    pub feedback: Feedback,
    /// The rule by which integral and derivative were programmed.
    pub discretisation: Discretisation,
    /// Gain of all three parts.
    pub kp: f64,
    /// Integral time, seconds; no integral part when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ti: Option<f64>,
    /// Derivative time, seconds.
    #[serde(default)]
    pub td: f64,
    /// Time constant of the filter of the derivative, seconds.
    #[serde(default)]
    pub derivative_filter: f64,
    /// Dead time in whole samples, beyond what the controller itself delays.
    #[serde(default)]
    pub delay: usize,
}

impl ParallelPid {
    pub(super) fn parts(&self) -> Pid {
        let Self { discretisation, kp, ki, kd, derivative_filter: filter, .. } = *self;
        Pid { discretisation, kp, ki, kd, filter, integral_time: None }
    }
}

impl IdealPid {
    pub(super) fn parts(&self) -> Pid {
        let Self { discretisation, kp, ti, td, derivative_filter: filter, .. } = *self;
        let ki = ti.map_or(0.0, |ti| kp / ti);
        Pid { discretisation, kp, ki, kd: kp * td, filter, integral_time: ti }
    }
}

/// The parallel form.
pub(super) struct Pid {
    pub(super) discretisation: Discretisation,
    pub(super) kp: f64,
    pub(super) ki: f64,
    pub(super) kd: f64,
    pub(super) filter: f64,
    /// Ti, where the ideal form was given.
    pub(super) integral_time: Option<f64>,
}

impl Pid {
    pub(super) fn problem(&self) -> Option<String> {
        let Pid { discretisation, kp, ki, kd, filter, integral_time } = self;
        if integral_time.is_some_and(|ti| ti.is_nan() || ti <= 0.0) {
            return Some(
                "[controller] ti must be a positive time in seconds; leave it out where there is no integral part"
                    .into(),
            );
        }
        if ![*kp, *ki, *kd].iter().all(|k| k.is_finite()) {
            return Some("[controller] has a gain of the PID that is no finite number".into());
        }
        if !(*filter >= 0.0 && filter.is_finite()) {
            return Some(format!(
                "[controller] derivative_filter is {filter}, but must be a time in seconds, zero or positive"
            ));
        }
        let rings = *discretisation == Discretisation::Tustin && *kd != 0.0 && *filter == 0.0;
        rings.then(|| {
            "[controller] a derivative by discretisation = \"tustin\" without derivative_filter never stops ringing (pole at \
             z = -1); state derivative_filter, or discretisation = \"backward-euler\""
                .into()
        })
    }

    /// From the error to the command, with a state for each part that is there.
    pub(super) fn system(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        Ok(self.gains().system(time)?)
    }

    pub(super) fn gains(&self) -> PidGains {
        let Pid { discretisation, kp, ki, kd, filter, .. } = *self;
        PidGains { discretisation, kp, ki, kd, derivative_filter: filter }
    }
}
