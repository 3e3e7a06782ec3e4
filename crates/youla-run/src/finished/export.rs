//! What a run folder holds, for [`youla_io::export`].

use crate::folder::artefacts::{Provenance, SCHEMA};
use crate::records::SourceFile;
use crate::settings::RunSettings;
use crate::summary::Summary;
use crate::summary::entries::Refused;
use crate::summary::pid::PidEntry;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use youla::Mat;
use youla::lti::{Discrete, StateSpace};
use youla::signal::{Channel, unknown};
use youla_io::export::{
    ControllerExport, ExportedController, LoopExport, NamedModel, ObserverData, PidExport, model_from_bytes, read_model,
};
use youla_io::sha256;
use youla_loop::redesign::structured::{Discretisation, Notch};

/// The model files of a run folder; the first that is there is what a run is exported as.
const MODELS: [&str; 11] = [
    "4-identify/recommended",
    "5-recombine/hansen",
    "6-reduce/hansen_reduced",
    "4-identify/direct",
    "4-identify/grey_box",
    "4-identify/deviation",
    "2-factor/nominal",
    "2-factor/controller",
    "2-factor/left",
    "2-factor/right",
    "8-redesign/new_controller",
];

/// Reads a model for export: a file as [`read_model`] does, or the model `name` of a run folder, `recommended` by default, else the first that the run holds. One that
/// does not say where it comes from gets the file and its SHA-256 as provenance.
///
/// # Errors
/// Those of [`read_model`]; [`youla_io::Error::NotAModel`] for a folder that is no run folder, and for a name given with a file;
/// [`youla::Error::UnknownChannel`] for a model that the run does not hold, with those that it holds.
pub fn model_for_export(source: &Path, name: Option<&str>) -> Result<NamedModel> {
    let path = match (source.is_dir(), name) {
        (true, name) => model_file(source, name)?,
        (false, None) => source.to_owned(),
        (false, Some(_)) => {
            return Err(not(source, "this is no folder; a model is chosen by name in a run folder only"));
        }
    };
    let mut model = read_model(&path)?;
    if model.provenance.is_null() {
        let file = SourceFile { path: path.display().to_string(), purpose: "model".into(), sha256: sha256(&path)? };
        let program = concat!("youla ", env!("CARGO_PKG_VERSION")).into();
        let provenance = Provenance { schema: SCHEMA, program, seed: None, sources: vec![file], options: () };
        model.provenance = serde_json::to_value(provenance)
            .map_err(|source| Error::Report(youla_report::Error::ReportData { source }))?;
    }
    model.origin = origin(source, &path)?;
    Ok(model)
}

/// The controller of a run folder with its ports, from `2-factor/`, and a Q: a model from beta to alpha, or the `controller.json` of a
/// redesign that holds one.
///
/// # Errors
/// Those of [`read_model`]; [`youla_io::Error::NotAModel`] for a source that is no run folder.
pub fn controller_for_export(run: &Path, q: Option<&Path>) -> Result<ControllerExport> {
    require_run(run)?;
    let path = run.join("2-factor/left.json");
    let (nominal, left) = (read_model(base_of(run))?, read_model(&path)?);
    let q_origin = q.map(|q| Ok::<_, Error>(format!(" and {}", origin(q, q)?))).transpose()?.unwrap_or_default();
    let of_machine = [nominal.inputs.as_slice(), &nominal.outputs].concat();
    let q = q.map(|path| parameter(path, &of_machine)).transpose()?;
    Ok(ControllerExport {
        name: "controller".into(),
        measured: nominal.outputs,
        commanded: nominal.inputs,
        nominal: nominal.system,
        left: left.system,
        q,
        origin: origin(run, &path)? + &q_origin,
    })
}

/// The model of the factors of a run: the nominal one, the recommended one where none was given.
fn base_of(run: &Path) -> PathBuf {
    let nominal = run.join("2-factor/nominal.json");
    if nominal.is_file() { nominal } else { run.join("4-identify/recommended.json") }
}

/// The loop of a firmware: nominal model and gains of a run whose controller is an observer, or those of the `controller.json` of a redesign
/// by LQG.
///
/// # Errors
/// Those of [`read_model`]; [`youla_io::Error::NotAModel`] for a source whose controller is no observer.
pub fn loop_for_export(source: &Path) -> Result<LoopExport> {
    if source.is_dir() { loop_of_run(source) } else { loop_of_redesign(source) }
}

/// The new PID of a run, of several loops that of one, counted from 1.
///
/// # Errors
/// Those of [`read_model`]; [`youla_io::Error::NotAModel`] for a run without a new PID, and for a loop that it has not.
pub fn pid_for_export(run: &Path, of_loop: Option<usize>) -> Result<PidExport> {
    require_run(run)?;
    let path = run.join("8-redesign/pid.json");
    let found = new_pid(run)?;
    let model = read_model(run.join("8-redesign/new_controller.json"))?;
    let loops = found.controllers.len();
    let place = match of_loop {
        None if loops == 1 => 0,
        Some(place) if (1..=loops).contains(&place) => place - 1,
        None => return Err(not(run, &format!("this run has new PIDs for {loops} loops; add --loop 1 to {loops}"))),
        Some(place) => return Err(not(run, &format!("--loop is {place}, but must be from 1 to {loops}"))),
    };
    let (c, ts) = (&found.controllers[place], model.system.time().ts());
    let [(ki, i, _), (kd, d, lag)] = c.gains.parts(ts);
    let notch = |n: &Notch| ([n.hz, n.width, n.depth], n.coefficients(ts));
    Ok(PidExport {
        name: if loops == 1 { "pid".into() } else { format!("pid_{}", place + 1) },
        measured: model.inputs[place].clone(),
        commanded: model.outputs[place].clone(),
        ts,
        kp: c.gains.kp,
        ki,
        kd,
        derivative_filter: c.gains.derivative_filter,
        tustin: c.gains.discretisation == Discretisation::Tustin,
        integral: i.map(|b| ki * b),
        derivative: if kd == 0.0 { [0.0; 2] } else { [kd * d[0] / lag[0], -lag[1] / lag[0]] },
        notches: c.notches.iter().map(notch).collect(),
        delay: c.delay,
        reference_filter: found.steps.last().and_then(|s| s.reference_filters.get(place)).copied().unwrap_or(0.0),
        reference_weights: found
            .reference_weights
            .and_then(|of| of.get(place).map(|w| [w.proportional, w.derivative]))
            .unwrap_or([1.0; 2]),
        plant: (loops == 1).then(|| recommended_of(run)).flatten(),
        origin: origin(run, &path)?,
    })
}

/// The recommended plant of a run, where it has one input and one output.
fn recommended_of(run: &Path) -> Option<StateSpace<Discrete>> {
    let plant = read_model(run.join("4-identify/recommended.json")).ok()?.system;
    (plant.inputs() == 1 && plant.outputs() == 1).then_some(plant)
}

/// The new PID of a run as `8-redesign/pid.json` states it.
fn new_pid(run: &Path) -> Result<PidEntry> {
    let path = run.join("8-redesign/pid.json");
    if !path.is_file() {
        let problem = "8-redesign/pid.json is not there: this run has no new PID, or the file was removed; with structure = \"pid\" in [redesign] \
                       `youla identify` writes it";
        return Err(not(run, problem));
    }
    let text = youla_io::read_text(&path)?;
    if let Ok(Refused { refused }) = serde_json::from_str(&text) {
        return Err(not(run, &format!("this run found no new PID: {refused}")));
    }
    serde_json::from_str(&text).map_err(|source| Error::NotASummary { path, source })
}

/// What a run says against what is exported of it, its recommended model or its new PID; empty where it says nothing, and for what is no run.
pub fn caution_for_export(source: &Path, pid: bool) -> String {
    let Ok(summary) = Summary::read(source) else { return String::new() };
    let mut all = Vec::new();
    if summary.recommended.is_some_and(|model| !model.trusted) {
        all.push("the recommended model of this run is not trusted".to_owned());
    }
    let reservations = if pid { new_pid(source).map_or(Vec::new(), |found| found.reservations) } else { Vec::new() };
    if !reservations.is_empty() {
        all.push(format!("do not take this controller as it is: {}", reservations.join("; ")));
    }
    all.join("; ")
}

fn loop_of_run(run: &Path) -> Result<LoopExport> {
    require_run(run)?;
    let (path, settings) = (base_of(run), RunSettings::read(&run.join("run.toml"))?);
    let nominal = read_model(&path)?;
    let time = nominal.system.time();
    let running = settings.controller.realise(time, Some(&nominal.system), run)?;
    let Some([f, l]) = running.gains() else {
        let problem = "the controller of this run is no observer with gains; the loop of the firmware needs [controller.observer], and \
                       --to c-controller exports any controller";
        return Err(not(run, problem));
    };
    // States of one size, which single precision needs.
    let scale = nominal.system.state_scales()?;
    let f = Mat::from_fn(f.nrows(), f.ncols(), |i, j| f[(i, j)] * scale[j]);
    let l = Mat::from_fn(l.nrows(), l.ncols(), |i, j| l[(i, j)] / scale[i]);
    Ok(LoopExport {
        name: "loop".into(),
        observer: ObserverData::new(&nominal.system.with_scaled_states(&scale), f.as_ref(), l.as_ref()),
        measured: nominal.outputs,
        commanded: nominal.inputs,
        ts: time.ts(),
        origin: origin(run, &path)?,
    })
}

fn loop_of_redesign(path: &Path) -> Result<LoopExport> {
    let bytes = youla_io::read_bytes(path)?;
    let found: Option<ExportedController> = serde_json::from_slice(&bytes).ok();
    let Some(ExportedController { observer: Some(observer), ts, measured, commanded, .. }) = found else {
        let problem = "this is neither a run folder nor the controller.json of a redesign by LQG";
        return Err(not(path, problem));
    };
    let origin = origin(path, path)?;
    Ok(LoopExport { name: "loop".into(), measured, commanded, observer, ts, origin })
}

/// Q from either kind of file; `of_machine` are the channels of the machine, which are none of beta and alpha.
fn parameter(path: &Path, of_machine: &[Channel]) -> Result<StateSpace<Discrete>> {
    let bytes = youla_io::read_bytes(path)?;
    match serde_json::from_slice::<ExportedController>(&bytes) {
        Ok(ExportedController { q: Some(q), ts, .. }) => Ok(q.system(Discrete::new(ts)?)?),
        Ok(_) => Err(not(path, "this controller was not designed by its Q")),
        Err(_) => {
            let model = model_from_bytes(&bytes, path)?;
            let foreign = |names: &[Channel]| names.iter().any(|c| of_machine.iter().any(|own| own.name == c.name));
            if foreign(&model.inputs) || foreign(&model.outputs) {
                let [from, to] = [&model.inputs, &model.outputs]
                    .map(|of| of.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", "));
                let problem = format!(
                    "this model goes from {from} to {to}, channels of the machine; a Q goes from beta to alpha"
                );
                return Err(not(path, &problem));
            }
            Ok(model.system)
        }
    }
}

fn model_file(run: &Path, name: Option<&str>) -> Result<PathBuf> {
    require_run(run)?;
    let there: Vec<&str> = MODELS.into_iter().filter(|path| run.join(path).with_extension("mat").is_file()).collect();
    let last = |path: &str| path.rsplit('/').next().unwrap_or(path).to_owned();
    let name = name.map_or_else(|| there.first().map_or_else(String::new, |path| last(path)), str::to_owned);
    match there.iter().find(|path| last(path) == name) {
        Some(path) => Ok(run.join(path).with_extension("json")),
        None => {
            let names = there.iter().map(|path| last(path)).collect();
            Err(unknown(&format!("the run {}", run.display()), &name, names).into())
        }
    }
}

fn require_run(run: &Path) -> Result<()> {
    match run.join("summary.json").is_file() {
        true => Ok(()),
        false => Err(not(run, "this is no run folder (there is no summary.json in it)")),
    }
}

fn not(path: &Path, problem: &str) -> Error {
    Error::File(youla_io::Error::NotAModel { path: path.to_owned(), problem: problem.to_owned() })
}

/// [`file_of`], with what the run says against it.
fn origin(source: &Path, path: &Path) -> Result<String> {
    let from = file_of(source, path)?;
    let caution = caution_for_export(source, path.ends_with("pid.json"));
    Ok(if caution.is_empty() { from } else { format!("{from}. CAUTION: {caution}") })
}

/// The file from the run folder on, or its name, with the first digits of its SHA-256.
fn file_of(source: &Path, path: &Path) -> Result<String> {
    let from = source.parent().filter(|_| source != path);
    let shown = match from {
        Some(parent) => path.strip_prefix(parent).unwrap_or(path).display().to_string(),
        None => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
    };
    Ok(format!("{shown}, SHA-256 {}", &sha256(path)?[..16]))
}
