//! `youla demo`: settings and simulated records of a machine under feedback.

mod levitation;

use crate::output::Failure;
use clap::ValueEnum;
use youla_run::{RunRecords, RunSettings};

/// The machines that can be simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Machine {
    /// A levitated mass, unstable, under a PD controller with strong sensor noise
    Levitation,
    /// The gas bearing of the paper, 2 x 2, with a nominal model of half the true A
    Bearing,
}

/// Settings and records of a simulated machine; the same seed gives the same records.
///
/// # Errors
/// Never for the parameters that are built in.
pub fn demo(machine: Machine, seed: u64) -> Result<(RunSettings, RunRecords), Failure> {
    match machine {
        Machine::Levitation => levitation::levitation(seed),
        Machine::Bearing => Ok(youla_paper::demo(seed).map(|demo| (demo.settings, demo.records))?),
    }
}
