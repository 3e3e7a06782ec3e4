//! Simulated machines and what runs around them: the gas bearing of the paper as a linear model, as a structure and as a digital twin; the
//! demonstrations; the loop of the firmware, in this process or on a Cortex-M4 in QEMU, in lock-step with the twin; twins that a host talks to.

mod demo;
mod error;
mod lock_step;
mod qemu;
pub mod rig;
mod running;
mod serve;
mod station;
mod target;

pub use demo::{Demo, DemoMachine, demo};
pub use error::{Error, Result};
pub use lock_step::{LockStep, LoggedValues};
pub use rig::BearingStructure;
pub use running::{LoopDescription, RunningLoop, padded};
pub use serve::{TwinPlant, serve_loop};
pub use station::Q_STATES;
pub use target::Target;
