//! Settings and options from mappings of Python: what run.toml states, with the same structs, checks and sentences.

use crate::failure::{Failure, OPTIONS, Result};
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use std::path::Path;
use youla_run::RunSettings;

/// A table of run.toml, from a mapping of numbers, text, lists and mappings. It is kept as text: the one parser of run.toml states what is wrong.
pub(crate) struct Options(String);

impl<'py> FromPyObject<'_, 'py> for Options {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let refused = |e: String| Failure::input(format!("these options are none of run.toml: {e}"));
        let table: toml::Table = pythonize::depythonize(&given).map_err(|e| refused(e.to_string()))?;
        Ok(Options(toml::to_string(&table).map_err(|e| refused(e.to_string()))?))
    }
}

impl Options {
    /// The settings of a run.
    pub(crate) fn settings(&self) -> Result<RunSettings> {
        Ok(RunSettings::parse(&self.0, Path::new(OPTIONS))?)
    }

    /// For settings that lack `feedback` and nothing else: those with either sign.
    pub(crate) fn without_feedback(&self) -> Option<impl Fn(youla_run::Feedback) -> Option<RunSettings> + use<>> {
        RunSettings::without_feedback(&self.0)
    }

    /// A struct of options, as the table `table` of run.toml would hold them.
    pub(crate) fn of<T: DeserializeOwned>(&self, table: &str) -> Result<T> {
        Ok(youla_run::parse_table(&self.0, Path::new(OPTIONS), table)?)
    }
}
