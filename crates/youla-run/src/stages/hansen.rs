//! The modified Hansen scheme on the records of a run: S by (25), G(S) by (17), the diagram of S.

use crate::records::RunRecords;
use crate::stages::context::SchemeContext;
use crate::stages::stabilisation::diagram;
use crate::{Error, Result};
use youla::identify::hansen::{HansenData, HansenModel, HansenOptions};
use youla::identify::subspace::SubspaceOptions;
use youla::identify::subspace::stabilisation::StabilisationDiagram;

/// What the scheme gives.
pub(crate) struct Scheme {
    /// S and G(S).
    pub(crate) hansen: HansenModel,
    /// The stabilisation diagram of S, or the reason why there is none.
    pub(crate) diagram: Result<StabilisationDiagram>,
}

/// S, G(S) and the diagram of S.
///
/// # Errors
/// Those of [`HansenData::identify`].
pub(crate) fn scheme(context: SchemeContext<'_>) -> Result<Scheme> {
    let SchemeContext { run, factorisation, signals } = context;
    let (settings, factors) = (run.settings, &factorisation.factors);
    let data = HansenData::new(factors, &signals.experiments, &settings.hansen)?;
    let options = HansenOptions { subspace: settings.hansen.clone(), noise: settings.deviation.noise() };
    let hansen = data.identify(&options)?;
    let diagram = diagram(data.subspace(), &hansen.deviation, &settings.hansen);
    Ok(Scheme { hansen, diagram })
}

/// Refuses a part of a file that is too short for the horizon, by its name.
///
/// # Errors
/// [`youla::Error::TooFewSamples`].
pub(crate) fn require_length(options: &SubspaceOptions, records: &RunRecords, settle: usize) -> Result<()> {
    let (past, horizon) = (options.horizon.past(), options.horizon.future());
    let delay = options.delays.iter().copied().max().unwrap_or(0);
    let needed = [past, horizon, delay, settle].into_iter().fold(0, usize::saturating_add);
    let of_file = |name: &str| records.segments.iter().any(|segment| segment.record == name);
    match records.estimation.iter().find(|r| of_file(&r.name) && r.samples() < needed) {
        None => Ok(()),
        Some(record) => {
            let what = format!(
                "{}, a part of a file, with a horizon of {horizon} and a past of {past} block rows and {settle} samples of \
                 settling (leave it out by `segments`)",
                record.name
            );
            Err(Error::Method(youla::Error::TooFewSamples { what, found: record.samples(), needed }))
        }
    }
}
