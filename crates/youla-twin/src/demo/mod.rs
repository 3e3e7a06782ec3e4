//! The demonstrations: settings and simulated records of a machine under feedback, as `youla demo` takes them.

mod bearing;
mod levitation;

use crate::Result;
use youla_run::{RunRecords, RunSettings};

/// The machines that can be simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DemoMachine {
    /// A levitated mass, unstable, under a PD controller with strong sensor noise.
    Levitation,
    /// The gas bearing of the paper, 2 x 2, with a nominal model of half the true A.
    Bearing,
}

/// Settings and simulated records of the demonstration.
#[derive(Debug, Clone)]
pub struct Demo {
    /// The settings for `youla identify`.
    pub settings: RunSettings,
    /// What the machine would have logged.
    pub records: RunRecords,
}

/// Settings and records of a simulated machine; the same seed gives the same records.
///
/// # Errors
/// Never for the parameters that are built in.
pub fn demo(machine: DemoMachine, seed: u64) -> Result<Demo> {
    match machine {
        DemoMachine::Levitation => levitation::levitation(seed),
        DemoMachine::Bearing => bearing::bearing(seed),
    }
}
