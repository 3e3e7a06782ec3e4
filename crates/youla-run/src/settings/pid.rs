//! PID controllers of run.toml, in parallel and in ideal form, one or one for each loop; how they are computed is in
//! [`youla_loop::redesign::structured`].

use super::feedback::Feedback;
use crate::Result;
use serde::{Deserialize, Serialize};
use youla::lti::{Discrete, StateSpace};
pub use youla_loop::redesign::structured::Discretisation;
use youla_loop::redesign::structured::{PidGains, diagonal};

/// A gain or a time of a PID: a number, or a list with one for each loop of a machine whose input k follows output k.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(untagged, expecting = "expected a number, or a list with one for each loop")]
pub enum LoopGain {
    /// Of all loops.
    One(f64),
    /// Of each.
    Each(Vec<f64>),
}

impl Default for LoopGain {
    fn default() -> Self {
        LoopGain::One(0.0)
    }
}

impl LoopGain {
    pub(super) fn of(&self, place: usize) -> f64 {
        match self {
            LoopGain::One(value) => *value,
            LoopGain::Each(values) => values.get(place).copied().unwrap_or(f64::NAN),
        }
    }

    fn loops(&self) -> Option<usize> {
        match self {
            LoopGain::One(_) => None,
            LoopGain::Each(values) => Some(values.len()),
        }
    }
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
    pub kp: LoopGain,
    /// Integral gain, per second.
    #[serde(default)]
    pub ki: LoopGain,
    /// Derivative gain, seconds.
    #[serde(default)]
    pub kd: LoopGain,
    /// Time constant of the filter of the derivative, seconds.
    #[serde(default)]
    pub derivative_filter: LoopGain,
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
    pub kp: LoopGain,
    /// Integral time, seconds; no integral part when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ti: Option<LoopGain>,
    /// Derivative time, seconds.
    #[serde(default)]
    pub td: LoopGain,
    /// Time constant of the filter of the derivative, seconds.
    #[serde(default)]
    pub derivative_filter: LoopGain,
    /// Dead time in whole samples, beyond what the controller itself delays.
    #[serde(default)]
    pub delay: usize,
}

impl ParallelPid {
    /// Loops for which it states gains of their own.
    pub(super) fn loops(&self) -> Option<usize> {
        let Self { kp, ki, kd, derivative_filter, .. } = self;
        [kp, ki, kd, derivative_filter].iter().find_map(|gain| gain.loops())
    }

    pub(super) fn parts(&self) -> PidLoops {
        let Self { discretisation, kp, ki, kd, derivative_filter: filter, .. } = self;
        PidLoops::new([("kp", kp), ("ki", ki), ("kd", kd), ("derivative_filter", filter)], |[kp, ki, kd, filter]| Pid {
            discretisation: *discretisation,
            kp,
            ki,
            kd,
            filter,
            integral_time: None,
        })
    }
}

impl IdealPid {
    /// The same in parallel form.
    pub(super) fn parallel(&self) -> ParallelPid {
        let Self { feedback, discretisation, delay, .. } = *self;
        let each = self.parts().0.unwrap_or_default();
        let gain = |of: fn(&Pid) -> f64| match &each[..] {
            [one] => LoopGain::One(of(one)),
            each => LoopGain::Each(each.iter().map(of).collect()),
        };
        let (kp, ki, kd) = (gain(|p| p.kp), gain(|p| p.ki), gain(|p| p.kd));
        ParallelPid { feedback, discretisation, kp, ki, kd, derivative_filter: gain(|p| p.filter), delay }
    }

    pub(super) fn parts(&self) -> PidLoops {
        let Self { discretisation, kp, ti, td, derivative_filter: filter, .. } = self;
        let never = LoopGain::One(f64::INFINITY);
        let times = ti.as_ref().unwrap_or(&never);
        PidLoops::new([("kp", kp), ("ti", times), ("td", td), ("derivative_filter", filter)], |[kp, ti, td, filter]| {
            Pid { discretisation: *discretisation, kp, ki: kp / ti, kd: kp * td, filter, integral_time: Some(ti) }
        })
    }
}

/// The PIDs of all loops, or what is wrong with their number.
pub(super) struct PidLoops(std::result::Result<Vec<Pid>, String>);

impl PidLoops {
    fn new(gains: [(&str, &LoopGain); 4], of: impl Fn([f64; 4]) -> Pid) -> Self {
        let mut lists = gains.iter().filter_map(|(key, gain)| Some((*key, gain.loops()?)));
        let Some((key, loops)) = lists.next() else {
            return PidLoops(Ok(vec![of(gains.map(|(_, gain)| gain.of(0)))]));
        };
        let all = "give each gain a number, or a list with one for each loop";
        if loops == 0 {
            return PidLoops(Err(format!("[controller] {key} is an empty list; {all}")));
        }
        if let Some((other, count)) = lists.find(|(_, count)| *count != loops) {
            return PidLoops(Err(format!(
                "[controller] the list {key} has another length ({loops}) than {other} ({count}); {all}"
            )));
        }
        PidLoops(Ok((0..loops).map(|k| of(gains.map(|(_, gain)| gain.of(k)))).collect()))
    }

    pub(super) fn problem(&self) -> Option<String> {
        match &self.0 {
            Ok(loops) => loops.iter().find_map(Pid::problem),
            Err(problem) => Some(problem.clone()),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.0.as_ref().map_or(0, Vec::len)
    }

    /// From the errors to the commands, input k following output k; what is wrong is refused before.
    pub(super) fn system(&self, time: Discrete) -> Result<StateSpace<Discrete>> {
        let loops = self.0.as_deref().unwrap_or_default();
        let each: Vec<_> = loops.iter().map(|pid| pid.gains().system(time)).collect::<youla::Result<_>>()?;
        Ok(diagonal(&each)?)
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

    pub(super) fn gains(&self) -> PidGains {
        let Pid { discretisation, kp, ki, kd, filter, .. } = *self;
        PidGains { discretisation, kp, ki, kd, derivative_filter: filter }
    }
}
