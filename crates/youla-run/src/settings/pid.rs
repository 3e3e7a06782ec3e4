//! PID controllers `kp + ki/s + kd s/(1 + filter s)` as they are programmed (K. J. Åström, T. Hägglund, Advanced PID Control, ISA,
//! 2006, section 13.4): with `q = z^-1`,
//!
//! ```text
//!                    integral                          filtered derivative
//! backward Euler     ki ts / (1 - q)                   kd (1 - q) / (filter + ts - filter q)
//! Tustin             ki ts/2 (1 + q) / (1 - q)         2 kd (1 - q) / (2 filter + ts + (ts - 2 filter) q)
//! ```

use super::controller::Feedback;
use crate::Result;
use serde::{Deserialize, Serialize};
use youla::Mat;
use youla::lti::{Discrete, StateSpace};

/// How the integral and the derivative part of a PID were programmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Discretisation {
    /// Backward differences, `s = (1 - z^-1)/ts`: the integral includes the error of the present sample.
    BackwardEuler,
    /// Tustin's rule, `s = 2/ts (1 - z^-1)/(1 + z^-1)`.
    Tustin,
}

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
        let (ts, filter) = (time.ts(), self.filter);
        let mut sum = StateSpace::gain(Mat::from_fn(1, 1, |_, _| self.kp), time)?;
        let (integral, derivative) = match self.discretisation {
            Discretisation::BackwardEuler => {
                let integral = [vec![self.ki * ts], vec![1.0, -1.0]];
                (integral, [vec![self.kd, -self.kd], vec![filter + ts, -filter]])
            }
            Discretisation::Tustin => {
                let half = 0.5 * self.ki * ts;
                let derivative = [vec![2.0 * self.kd, -2.0 * self.kd], vec![2.0 * filter + ts, ts - 2.0 * filter]];
                ([vec![half, half], vec![1.0, -1.0]], derivative)
            }
        };
        for (gain, [numerator, denominator]) in [(self.ki, integral), (self.kd, derivative)] {
            if gain != 0.0 {
                let part = StateSpace::difference_equation(&vec![vec![numerator]], &vec![vec![denominator]], time)?;
                sum = sum.plus(&part)?;
            }
        }
        Ok(sum)
    }
}
