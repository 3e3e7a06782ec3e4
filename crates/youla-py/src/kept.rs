//! What a run that was kept in files needs of the library: the region of its model, MATLAB files, its report, its folder again.

use crate::failure::{Failure, Result};
use crate::logs::{Log, records};
use crate::matrices::{ModelIn, ModelOut, model_in, model_out};
use crate::options::Options;
use crate::region::{self, RegionOut};
use crate::worker;
use numpy::ndarray::{Array2, ShapeBuilder};
use numpy::{Complex64, IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use youla::identify::likelihood::Region as LibraryRegion;
use youla::lti::Discrete;
use youla_io::folder::RunFolder;
use youla_io::{Value, mat_from_bytes};
use youla_run::{RunSettings, pid_kept, records_in_memory, redesign_kept};

/// The region of a recommended model, from `4-identify/region.json`.
#[pyclass(frozen, module = "youla._native")]
pub(crate) struct Region {
    region: LibraryRegion,
}

#[pymethods]
impl Region {
    #[new]
    fn new(json: &str) -> PyResult<Self> {
        let region = serde_json::from_str(json);
        let refused = |e| Failure::input(format!("4-identify/region.json: {e}"));
        Ok(Region { region: region.map_err(refused)? })
    }

    /// The response of the model with its region.
    fn response<'py>(
        &self,
        py: Python<'py>,
        model: ModelIn<'py>,
        hz: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<RegionOut<'py>> {
        let (model, hz) = (model_in(&model)?, hz.as_array().to_vec());
        let known = || region::Region::recommended(&model, &self.region, &hz);
        Ok(worker::detached(py, known)?.out(py))
    }

    /// Standard deviation of a figure with these slopes in the entries of the response at a frequency.
    fn along(&self, hz: f64, slopes: PyReadonlyArray2<'_, Complex64>) -> f64 {
        region::along(&self.region, hz, &slopes)
    }
}

/// The matrices of a MATLAB file; `name` is named in errors.
#[pyfunction]
pub(crate) fn read_mat<'py>(
    py: Python<'py>,
    content: Vec<u8>,
    name: &str,
) -> PyResult<BTreeMap<String, Bound<'py, PyArray2<f64>>>> {
    let found = py.detach(|| mat_from_bytes(&content, name)).map_err(Failure::from)?;
    let matrix = |variable: &youla_io::Variable| match &variable.value {
        Value::Real { dims, data } if dims.len() == 2 => {
            let array = Array2::from_shape_vec((dims[0], dims[1]).f(), data.clone()).ok()?;
            Some((variable.name.clone(), array.as_standard_layout().into_owned().into_pyarray(py)))
        }
        _ => None,
    };
    Ok(found.variables().iter().filter_map(matrix).collect())
}

/// report.html of report.json.
#[pyfunction]
pub(crate) fn report_html(py: Python<'_>, json: &str) -> PyResult<String> {
    Ok(py.detach(|| Ok::<_, Failure>(youla_report::html(&serde_json::from_str(json)?)?))?)
}

/// The text of run.toml as JSON, with all options.
#[pyfunction]
pub(crate) fn settings_json(toml: &str) -> PyResult<String> {
    let parsed = RunSettings::parse(toml, Path::new("run.toml")).map_err(Failure::from)?;
    Ok(serde_json::to_string(&parsed).map_err(Failure::from)?)
}

/// The controller that settings hold, in positive feedback, at a sample time in seconds.
#[pyfunction]
pub(crate) fn controller_model(py: Python<'_>, chosen: Options, dt: f64) -> PyResult<ModelOut<'_>> {
    let of = || -> Result<_> {
        let settings = chosen.settings()?;
        settings.check()?;
        Ok(settings.controller.realise(Discrete::new(dt)?, None, Path::new(""))?)
    };
    Ok(model_out(py, of()?.system()))
}

/// Refuses settings with keys or values that do not exist.
#[pyfunction]
pub(crate) fn check_settings(chosen: Options) -> PyResult<()> {
    chosen.settings()?.check().map_err(Failure::from)?;
    Ok(())
}

/// Writes the files of a run as a run folder.
#[pyfunction]
pub(crate) fn write_files(
    py: Python<'_>,
    folder: PathBuf,
    replace: bool,
    files: BTreeMap<String, Vec<u8>>,
) -> PyResult<String> {
    let of = || -> Result<String> {
        let target = RunFolder::create(&folder, replace)?;
        for (name, content) in &files {
            let write = |path: &Path| {
                std::fs::write(path, content).map_err(|source| youla_io::Error::Io { path: path.to_owned(), source })
            };
            target.file(name, write)?;
        }
        Ok(target.finish()?.display().to_string())
    };
    worker::detached(py, of)
}

/// A new controller on a run that was kept: `models` are its plant and the model on which is designed.
#[pyfunction]
pub(crate) fn redesign<'py>(
    py: Python<'py>,
    chosen: Options,
    logs: Vec<Log<'py>>,
    models: [ModelIn<'py>; 2],
    region: &Region,
    choices: Options,
) -> PyResult<(String, ModelOut<'py>)> {
    let (chosen, logs, region) = (chosen.settings()?, records(py, logs)?, region.region.clone());
    let (plant, model) = (model_in(&models[0])?, model_in(&models[1])?);
    let new = worker::run(py, false, move |_| {
        let records = records_in_memory(&chosen.data, logs)?;
        let options = choices.of("redesign")?;
        Ok(redesign_kept(&chosen, &records, (&plant, &model), &region, &options)?)
    })?;
    let promised = serde_json::to_string(&youla_run::RedesignEntry::from(&new)).map_err(Failure::from)?;
    Ok((promised, model_out(py, &new.controller.system)))
}

/// One PID for several runs that were kept: the settings and records of the first, and plant and region of each, and what speaks against any.
#[pyfunction]
pub(crate) fn redesign_pid<'py>(
    py: Python<'py>,
    chosen: Options,
    logs: Vec<Log<'py>>,
    points: Vec<(ModelIn<'py>, PyRef<'py, Region>)>,
    doubts: Vec<String>,
    choices: Options,
) -> PyResult<(String, ModelOut<'py>)> {
    let (chosen, logs) = (chosen.settings()?, records(py, logs)?);
    let point = |(model, region): &(ModelIn<'py>, PyRef<'py, Region>)| Ok((model_in(model)?, region.region.clone()));
    let points: Vec<_> = points.iter().map(point).collect::<Result<_>>()?;
    let new = worker::run(py, false, move |_| {
        let records = records_in_memory(&chosen.data, logs)?;
        let points = points.iter().map(|(plant, region)| (plant, region)).collect();
        Ok(pid_kept(&chosen, &records, points, doubts, &choices.of("redesign")?)?)
    })?;
    let promised = serde_json::to_string(&youla_run::PidEntry::from(&new)).map_err(Failure::from)?;
    Ok((promised, model_out(py, &new.system)))
}
