//! Direct identification from (u, y), for comparison.

use crate::Result;
use crate::records::RunRecords;
use crate::settings::RunSettings;
use crate::stages::stabilisation::diagram;
use youla::identify::subspace::stabilisation::StabilisationDiagram;
use youla::identify::subspace::{SubspaceData, SubspaceModel, SubspaceOptions};

/// The plant from u and y, and its stabilisation diagram; each `None` where it was not asked for or there is no model.
pub(crate) fn direct(
    records: &RunRecords,
    settings: &RunSettings,
) -> (Option<Result<SubspaceModel>>, Option<Result<StabilisationDiagram>>) {
    match settings.direct.as_ref().map(|options| model(records, options)) {
        None => (None, None),
        Some(Err(reason)) => (Some(Err(reason)), None),
        Some(Ok((model, diagram))) => (Some(Ok(model)), Some(diagram)),
    }
}

fn model(records: &RunRecords, options: &SubspaceOptions) -> Result<(SubspaceModel, Result<StabilisationDiagram>)> {
    let data = SubspaceData::new(&records.experiments(), records.time, options)?;
    let model = data.identify(options)?;
    let diagram = diagram(&data, &model, options);
    Ok((model, diagram))
}
