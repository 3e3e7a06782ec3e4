//! A model as JSON, in the form of [`ModelFile`].

use super::NamedModel;
use crate::error::{Error, Result};
use crate::model_file::ModelFile;

pub(super) fn json(model: &NamedModel) -> Result<String> {
    let channels = (model.inputs.clone(), model.outputs.clone());
    let file = ModelFile::new(&model.name, &model.system, channels, model.details.clone(), &model.provenance)?;
    let text = serde_json::to_string_pretty(&file).map_err(|source| Error::Json { source })?;
    Ok(text + "\n")
}
