//! What every stage after the factorisation takes: what was asked for, the records, and the loop that ran.

use super::factorise::Factorisation;
use super::records::RunRecords;
use super::settings::RunSettings;

/// Settings, records and loop of a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunContext<'a> {
    /// What was asked for.
    pub(crate) settings: &'a RunSettings,
    /// The records.
    pub(crate) records: &'a RunRecords,
    /// Nominal model, controller and their factors.
    pub(crate) factorisation: &'a Factorisation,
}
