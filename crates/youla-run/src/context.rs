//! What the stages of a run take: what was asked for, the records, the loop that ran, and its coprime factors.

use super::factorise::{DeclaredLoop, LoopFactors};
use super::records::RunRecords;
use super::settings::RunSettings;
use super::signals::DeviationSignals;

/// Settings, records and loop of a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunContext<'a> {
    /// What was asked for.
    pub(crate) settings: &'a RunSettings,
    /// The records.
    pub(crate) records: &'a RunRecords,
    /// Nominal model and controller.
    pub(crate) declared: &'a DeclaredLoop,
    /// The factors of the loop, where they exist.
    pub(crate) factorisation: Option<&'a LoopFactors>,
}

/// The same where the factors and the signals alpha and beta exist.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SchemeContext<'a> {
    /// Settings, records and loop.
    pub(crate) run: RunContext<'a>,
    /// The factors of the loop.
    pub(crate) factorisation: &'a LoopFactors,
    /// alpha and beta.
    pub(crate) signals: &'a DeviationSignals,
}
