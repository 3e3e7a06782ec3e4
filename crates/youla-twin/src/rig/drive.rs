//! The command's way to the valves: limits of the amplifier, then the delay of the computer.

use super::parameters::RigParameters;

/// What became of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuation {
    /// The command within the limits, V: the one that an observer should use.
    pub applied: [f64; 2],
    /// Whether it had to be limited, per axis.
    pub saturated: [bool; 2],
}

/// Limits around the bias and a queue of commands on their way.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    low: f64,
    high: f64,
    queue: Vec<[f64; 2]>,
    next: usize,
}

impl Drive {
    pub(super) fn new(parameters: &RigParameters) -> Self {
        let a = &parameters.actuator;
        Drive {
            low: a.command_min.value - a.bias.value,
            high: a.command_max.value - a.bias.value,
            queue: vec![[0.0; 2]; parameters.timing.delay.value],
            next: 0,
        }
    }

    /// What became of the command u(k).
    pub(super) fn limit(&self, u: [f64; 2]) -> Actuation {
        let applied = u.map(|u| u.clamp(self.low, self.high));
        Actuation { applied, saturated: [applied[0] != u[0], applied[1] != u[1]] }
    }

    /// The command that is delivered when `newest` is sent.
    pub(super) fn delayed(&mut self, newest: [f64; 2]) -> [f64; 2] {
        let Some(slot) = self.queue.get_mut(self.next) else {
            return newest;
        };
        let delivered = std::mem::replace(slot, newest);
        self.next = (self.next + 1) % self.queue.len();
        delivered
    }
}
