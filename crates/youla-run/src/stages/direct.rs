//! Direct identification from (u, y), for comparison.

use crate::Result;
use crate::records::RunRecords;
use crate::settings::RunSettings;
use youla::identify::subspace::{SubspaceModel, subspace};

/// The plant from u and y; `None` where it was not asked for.
pub(crate) fn direct(records: &RunRecords, settings: &RunSettings) -> Option<Result<SubspaceModel>> {
    let options = settings.direct.as_ref()?;
    Some(subspace(&records.experiments(), records.time, options).map_err(Into::into))
}
