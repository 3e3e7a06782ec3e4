//! What the stages of a run take: what was asked for, the records, the loop that ran, and its coprime factors.

use crate::records::RunRecords;
use crate::settings::{PredictionKind, RunSettings};
use crate::stages::factors::{DeclaredLoop, LoopFactors};
use crate::stages::signals::DeviationSignals;

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

impl RunContext<'_> {
    /// What drives the models on verification records: as stated, or what suits the nominal model and what is known.
    pub(crate) fn prediction(&self) -> PredictionKind {
        let data = &self.settings.data;
        // A known alpha drives the loop through the factors.
        let driven = if data.alpha.is_empty() { data.excitation_is_known() } else { self.factorisation.is_some() };
        // Without a nominal model the factors are those of the recommended one.
        let of_factors = || Some(self.factorisation?.factors.nominal());
        let bounded = self.declared.nominal.as_ref().or_else(of_factors).is_none_or(|g| g.is_stable().unwrap_or(true));
        let suits = if driven && !bounded { PredictionKind::ClosedLoop } else { PredictionKind::OpenLoop };
        self.settings.verification.prediction.unwrap_or(suits)
    }
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
