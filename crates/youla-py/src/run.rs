//! A run in memory.

use crate::failure::{Failure, Result};
use crate::logs::{Log, TableIn, records, table};
use crate::matrices::{ModelOut, array, model_out};
use crate::options::Options;
use crate::region::{Region, RegionOut, response_array};
use crate::worker::{self, Stop};
use numpy::{Complex64, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla_run::{
    Identification, Method, RunRecords, RunSettings, Stage, StageClock, StageTimes, page, read_records, read_settings,
    records_in_memory, redesign_of, response_in_memory, summary, write_run,
};

/// The result of a run.
#[pyclass(frozen, module = "youla._native")]
pub(crate) struct Run {
    found: Arc<Identification>,
    seconds: StageTimes,
}

/// Identifies from records in memory; `single` uses one core only.
#[pyfunction]
#[pyo3(signature = (chosen, logs, single = false, response = None))]
pub(crate) fn identify(
    py: Python<'_>,
    chosen: Options,
    logs: Vec<Log<'_>>,
    single: bool,
    response: Option<TableIn<'_>>,
) -> PyResult<Run> {
    let chosen = chosen.settings()?;
    let logs = records(py, logs)?;
    let response = response.map(table);
    worker::run(py, single, move |stop| {
        pipeline(chosen, Path::new("."), stop, |chosen| match response {
            None => Ok(records_in_memory(&chosen.data, logs)?),
            Some(response) => Ok(response_in_memory(&chosen.data, response, logs)?),
        })
    })
}

/// Identifies as `youla identify run.toml` does.
#[pyfunction]
pub(crate) fn identify_file(py: Python<'_>, path: PathBuf) -> PyResult<Run> {
    worker::run(py, false, move |stop| {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let read = |chosen: &RunSettings| Ok(read_records(&chosen.data, &folder)?);
        read_settings(&path)
            .map_err(Failure::from)
            .and_then(|chosen| pipeline(chosen, &folder, stop, read))
            .map_err(Failure::of_file)
    })
}

/// Identifies a simulated machine, `levitation` or `bearing`.
#[pyfunction]
pub(crate) fn demo(py: Python<'_>, machine: &str, seed: u64) -> PyResult<Run> {
    let machine = match machine {
        "levitation" => youla_twin::DemoMachine::Levitation,
        "bearing" => youla_twin::DemoMachine::Bearing,
        other => {
            let message = format!("machine is {other:?}, but must be \"levitation\" or \"bearing\"");
            return Err(Failure::input(message).into());
        }
    };
    worker::run(py, false, move |stop| {
        let demo = youla_twin::demo(machine, seed)?;
        pipeline(demo.settings, Path::new("."), stop, |_| Ok(demo.records))
    })
}

fn pipeline(
    chosen: RunSettings,
    folder: &Path,
    stop: &Stop,
    read: impl FnOnce(&RunSettings) -> Result<RunRecords>,
) -> Result<Run> {
    let mut announce = |_: Stage| stop.announce();
    let mut clock = StageClock::new(&mut announce);
    let records = clock.run(Stage::Record, || read(&chosen))?;
    let found = youla_run::identify(chosen, records, folder, &mut clock)?;
    Ok(Run { found: Arc::new(found), seconds: clock.seconds })
}

/// Names of runs, the pairs and their distances, as JSON; the page is written to `page`.
#[pyfunction]
pub(crate) fn compare(py: Python<'_>, folders: Vec<PathBuf>, model: String, page: Option<PathBuf>) -> PyResult<String> {
    worker::run(py, false, move |_| {
        let found = youla_run::compare(&folders, &model)?;
        if let Some(page) = page {
            youla_run::write_comparison(&found, &page, true)?;
        }
        Ok(serde_json::json!({ "runs": found.runs, "model": found.model, "distances": found.distances }).to_string())
    })
}

/// Name, measured outputs and predictions by method of a verification record.
type Predictions<'py> = (String, Bound<'py, PyArray2<f64>>, BTreeMap<String, Bound<'py, PyArray2<f64>>>);

/// Frequencies in Hz and the response `[frequency, output, input]`.
type Measured<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray3<Complex64>>);

/// Names and units of inputs and of outputs.
type Ports = (Vec<(String, String)>, Vec<(String, String)>);

#[pymethods]
impl Run {
    /// summary.json.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        let of = || Ok::<_, Failure>(summary(&self.found, &self.seconds)?.to_string());
        worker::detached(py, of)
    }

    /// The settings as run.toml.
    fn settings(&self) -> PyResult<String> {
        Ok(self.found.settings.to_toml().map_err(Failure::from)?)
    }

    /// Keys of the models that exist.
    fn models(&self) -> Vec<String> {
        let validated = self.found.validation.models.iter().map(|v| v.method.key().to_owned());
        let others =
            ["controller", "deviation", "new_controller"].into_iter().filter(|key| self.model_of(key).is_some());
        validated.chain(others.map(String::from)).collect()
    }

    /// The matrices of a model; `None` where it does not exist.
    fn model<'py>(&self, py: Python<'py>, key: &str) -> Option<ModelOut<'py>> {
        self.model_of(key).map(|model| model_out(py, &model))
    }

    /// Names and units of inputs and outputs.
    fn ports(&self) -> Ports {
        let named = |channels: &[Channel]| channels.iter().map(|c| (c.name.clone(), c.unit.clone())).collect();
        (named(&self.found.records.inputs), named(&self.found.records.outputs))
    }

    /// Frequencies of the report, Hz.
    fn hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.found.hz)
    }

    /// The response of a model with its region.
    fn response<'py>(&self, py: Python<'py>, key: &str, hz: PyReadonlyArray1<'py, f64>) -> PyResult<RegionOut<'py>> {
        let hz: Vec<f64> = hz.as_array().to_vec();
        Ok(worker::detached(py, || self.region(key, &hz))?.out(py))
    }

    /// Standard deviation of a figure of the recommended model whose slopes in the entries of its response at a frequency are given.
    fn deviation_along(&self, hz: f64, slopes: PyReadonlyArray2<'_, Complex64>) -> Option<f64> {
        let found = self.found.recommended.as_ref().ok()?;
        let fits = slopes.as_array().dim() == (found.plant.outputs(), found.plant.inputs());
        fits.then(|| crate::region::along(&found.region, hz, &slopes))
    }

    /// The non-parametric response of the plant where an excitation is known.
    fn measured_response<'py>(&self, py: Python<'py>) -> Option<Measured<'py>> {
        let measured = self.found.indirect.as_ref()?.as_ref().ok()?;
        let hz = measured.response.omega.iter().map(|w| w / std::f64::consts::TAU).collect();
        Some((PyArray1::from_vec(py, hz), response_array(py, &measured.response)))
    }

    /// The verification records beside the predictions of the models.
    fn predictions<'py>(&self, py: Python<'py>) -> Vec<Predictions<'py>> {
        let of = |(k, record): (usize, &youla::signal::LoopRecord)| {
            let predicted = self.found.validation.models.iter().filter_map(|v| {
                let y = v.records.get(k)?.predicted.as_ref().ok()?;
                Some((v.method.key().to_owned(), array(py, y.as_ref())))
            });
            (record.name().to_owned(), array(py, record.y()), predicted.collect())
        };
        self.found.records.verification.iter().enumerate().map(of).collect()
    }

    /// A, B, C, D, K and the covariance of e of the predictor of the recommended model.
    fn predictor<'py>(&self, py: Python<'py>) -> Option<Vec<Bound<'py, PyArray2<f64>>>> {
        let p = &self.found.recommended.as_ref().ok()?.predictor;
        let k = p.k.as_ref()?;
        Some([&p.a, &p.b, &p.c, &p.d, k, &p.covariance].map(|m| array(py, m.as_ref())).to_vec())
    }

    /// report.json.
    fn page(&self, py: Python<'_>) -> PyResult<String> {
        worker::detached(py, || Ok(serde_json::to_string(&self.report()?)?))
    }

    /// report.html.
    fn html(&self, py: Python<'_>) -> PyResult<String> {
        let of = || {
            // Drawn from the rounded numbers of report.json, as the program does.
            let written = serde_json::to_vec(&self.report()?)?;
            Ok::<_, Failure>(youla_report::html(&serde_json::from_slice(&written)?)?)
        };
        worker::detached(py, of)
    }

    /// Writes the run folder that the program writes.
    fn write(&self, py: Python<'_>, folder: PathBuf, replace: bool) -> PyResult<String> {
        let of = || {
            let mut announce = |_: Stage| {};
            let mut clock = StageClock::new(&mut announce);
            clock.seconds = self.seconds.clone();
            let written = write_run(&self.found, &folder, replace, &mut clock)?;
            Ok::<_, Failure>(written.folder.display().to_string())
        };
        worker::detached(py, of)
    }

    /// A new controller: what it promises as JSON, and its matrices (positive feedback).
    fn redesign<'py>(&self, py: Python<'py>, chosen: Options) -> PyResult<(String, ModelOut<'py>)> {
        let found = self.found.clone();
        let new = worker::run(py, false, move |_| Ok(redesign_of(&found, &chosen.of("redesign")?)?))?;
        let promised = serde_json::to_string(&youla_run::RedesignEntry::from(&new)).map_err(Failure::from)?;
        Ok((promised, model_out(py, &new.controller.system)))
    }
}

impl Run {
    fn report(&self) -> Result<youla_report::ReportData> {
        Ok(page(&self.found, &summary(&self.found, &self.seconds)?, "")?)
    }

    fn model_of(&self, key: &str) -> Option<Cow<'_, StateSpace<Discrete>>> {
        if key == "deviation" {
            return self.found.deviation().ok()?.map(Cow::Owned);
        }
        let model = match key {
            "controller" => Some(self.found.declared.controller()),
            "new_controller" => match &self.found.pid {
                Some(pid) => Some(&pid.as_ref().ok()?.system),
                None => Some(&self.found.redesign.as_ref()?.as_ref().ok()?.controller.system),
            },
            key => Some(&self.found.validation.of(*Method::ALL.iter().find(|m| m.key() == key)?)?.model),
        };
        model.map(Cow::Borrowed)
    }

    fn region(&self, key: &str, hz: &[f64]) -> Result<Region> {
        let omega = crate::region::omega(hz);
        let band = match key {
            "likelihood" => {
                if let Ok(found) = &self.found.recommended {
                    return Region::recommended(&found.plant, &found.region, hz);
                }
                None
            }
            "grey_box" => {
                let run = self.found.grey_box.as_ref();
                run.and_then(|run| run.as_ref().ok()?.intervals.as_ref().ok()?.response(&omega).ok())
            }
            _ => None,
        };
        let model = self.model_of(key).ok_or_else(|| {
            Failure::input(format!(
                "this run has no model {:?}; it has {}",
                youla::error::short(key),
                self.models().join(", ")
            ))
        })?;
        band.map_or_else(|| Region::none(&model, hz), |band| Ok(Region::band(band)))
    }
}
