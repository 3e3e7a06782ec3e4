//! The modified Hansen scheme on the records of a run: S by (25), G(S) by (17).

use crate::records::RunRecords;
use crate::{Error, Result};
use youla::identify::subspace::SubspaceOptions;

/// Refuses a part of a file that is too short for the horizon, by its name.
///
/// # Errors
/// [`youla::Error::TooFewSamples`].
pub(crate) fn require_length(options: &SubspaceOptions, records: &RunRecords, settle: usize) -> Result<()> {
    let (past, horizon) = options.block_rows();
    let delay = options.delays.iter().copied().max().unwrap_or(0);
    let needed = [past, horizon, delay, settle].into_iter().fold(0, usize::saturating_add);
    let of_file = |name: &str| records.segments.iter().any(|segment| segment.record == name);
    match records.estimation.iter().find(|r| of_file(r.name()) && r.samples() < needed) {
        None => Ok(()),
        Some(record) => {
            let what = format!(
                "{}, a part of a file, with a horizon of {horizon} and a past of {past} block rows and {settle} samples of \
                 settling (leave it out by `segments`)",
                record.name()
            );
            Err(Error::Method(youla::Error::TooFewSamples { what, found: record.samples(), needed }))
        }
    }
}
