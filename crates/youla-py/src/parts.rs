//! Stages that need no run: the check of records, subspace identification, an excitation.

use crate::failure::Failure;
use crate::logs::{Log, records};
use crate::matrices::{ModelOut, array, model_out};
use crate::options::Options;
use crate::worker;
use numpy::PyArray2;
use pyo3::prelude::*;
use std::path::Path;
use youla::identify::subspace::{SubspaceModel, SubspaceOptions};
use youla_loop::excite::ExciteOptions;
use youla_run::{ExcitationPort, Feedback, agreement as agreement_of, check_in_memory, excite_run, records_in_memory};

/// Checks records, with their controller where `controller` says so; the findings as JSON.
#[pyfunction]
pub(crate) fn check(py: Python<'_>, chosen: Options, logs: Vec<Log<'_>>, controller: bool) -> PyResult<String> {
    let chosen = chosen.settings()?;
    let logs = records(py, logs)?;
    worker::run(py, false, move |_| {
        let records = records_in_memory(&chosen.data, logs)?;
        let found = check_in_memory(&chosen, &records, Path::new("."), controller)?;
        Ok(serde_json::to_string(&found.entry())?)
    })
}

/// What the records say of the sign of a controller that states none, for a message; the settings lack `feedback` only.
#[pyfunction]
pub(crate) fn agreement(py: Python<'_>, unsigned: Options, logs: Vec<Log<'_>>) -> PyResult<&'static str> {
    let logs = records(py, logs)?;
    worker::run(py, false, move |_| {
        let Some(with) = unsigned.without_feedback() else { return Ok("") };
        let check = |sign: Feedback| {
            let chosen = with(sign)?;
            let records = records_in_memory(&chosen.data, logs.clone()).ok()?;
            check_in_memory(&chosen, &records, Path::new("."), true).ok()
        };
        Ok(agreement_of(check))
    })
}

/// A model by subspace identification from u and y.
#[pyclass(frozen, module = "youla._native")]
pub(crate) struct Subspace {
    found: SubspaceModel,
}

/// Identifies from u and y by a subspace method.
#[pyfunction]
pub(crate) fn subspace(py: Python<'_>, chosen: Options, logs: Vec<Log<'_>>, choices: Options) -> PyResult<Subspace> {
    let (chosen, choices) = (chosen.settings()?, choices.of::<SubspaceOptions>("direct")?);
    let logs = records(py, logs)?;
    worker::run(py, false, move |_| {
        let records = records_in_memory(&chosen.data, logs)?;
        let found = youla::identify::direct::direct(&records.experiments(), records.time, &choices)?;
        Ok(Subspace { found })
    })
}

#[pymethods]
impl Subspace {
    /// The matrices.
    fn model<'py>(&self, py: Python<'py>) -> ModelOut<'py> {
        model_out(py, &self.found.model)
    }

    /// Singular values from which the order is chosen, descending.
    fn singular_values(&self) -> Vec<f64> {
        self.found.singular_values.clone()
    }

    /// Block rows of the future and of the past.
    fn horizons(&self) -> (usize, usize) {
        (self.found.horizon, self.found.past)
    }
}

/// An excitation: samples x inputs, sample time, what it is and promises as JSON.
type ExcitationOut<'py> = (Bound<'py, PyArray2<f64>>, f64, String);

/// An excitation for the loop of the nominal model; `port` is `input` or `alpha`.
#[pyfunction]
pub(crate) fn excite<'py>(
    py: Python<'py>,
    chosen: Options,
    choices: Options,
    port: &str,
) -> PyResult<ExcitationOut<'py>> {
    let (chosen, choices) = (chosen.settings()?, choices.of::<ExciteOptions>("excite")?);
    let port = match port {
        "input" => ExcitationPort::Input,
        "alpha" => ExcitationPort::Alpha,
        other => {
            let message = format!("port is {other:?}, but must be \"input\" or \"alpha\"");
            return Err(Failure::input(message).into());
        }
    };
    let made = worker::run(py, false, move |_| Ok(excite_run(&chosen, Path::new("."), &choices, Some(port), None)?))?;
    let promised = serde_json::to_string(&made.excited.summary).map_err(Failure::from)?;
    Ok((array(py, made.excited.alpha.as_ref()), made.excited.time.ts(), promised))
}
