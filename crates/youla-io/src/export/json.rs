//! A model as JSON, in the form of `run::ModelFile`.

use super::NamedModel;
use super::controller::FilterData;
use crate::{Error, Result};
use serde_json::json;

pub(super) fn json(model: &NamedModel) -> Result<String> {
    let FilterData { a, b, c, d } = FilterData::new(&model.system);
    let poles: Vec<[f64; 2]> = model.system.poles()?.iter().map(|p| [p.re, p.im]).collect();
    let file = json!({
        "name": model.name, "inputs": model.inputs, "outputs": model.outputs, "ts": model.system.time().ts(),
        "a": a, "b": b, "c": c, "d": d, "poles": poles,
        "details": model.details, "provenance": model.provenance,
    });
    let text = serde_json::to_string_pretty(&file).map_err(|source| Error::Json { source })?;
    Ok(text + "\n")
}
