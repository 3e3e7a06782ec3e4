//! Settings and options from the JSON of keyword arguments, by way of the text of run.toml: the same structs, checks and sentences.

use crate::failure::{Failure, OPTIONS, Result};
use serde::de::DeserializeOwned;
use std::path::Path;
use youla_run::RunSettings;

/// The TOML of a JSON object.
pub(crate) fn as_toml(json: &str) -> Result<String> {
    let table: toml::Table = serde_json::from_str(json)?;
    toml::to_string(&table).map_err(|e| Failure::input(format!("these options cannot be written as run.toml: {e}")))
}

/// The settings of a run.
pub(crate) fn settings(json: &str) -> Result<RunSettings> {
    Ok(RunSettings::parse(&as_toml(json)?, Path::new(OPTIONS))?)
}

/// A struct of options, as the table `table` of run.toml would hold them.
pub(crate) fn options<T: DeserializeOwned>(json: &str, table: &str) -> Result<T> {
    Ok(youla_run::parse_table(&as_toml(json)?, Path::new(OPTIONS), table)?)
}
