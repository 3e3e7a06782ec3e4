//! A model from a file: JSON as in a run folder, MATLAB version 5 or 7.3, NumPy archive.

use super::NamedModel;
use super::predictor::Predictor;
use crate::error::{Error, Result};
use crate::matfile::mat_from_bytes;
use crate::model_file::ModelFile;
use crate::npz::npz_from_bytes;
use crate::values::{Value, Variables};
use serde::Deserialize;
use std::path::Path;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;

/// Reads a discrete-time model: the fields or variables `a`, `b`, `c`, `d` and `ts`; of JSON and MATLAB files also the names.
///
/// The format is that of the contents, not of the name. Channels without a name are `u1`, `u2`, ... and `y1`, `y2`, ...; the model
/// has the name of the file where it states none.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`], [`Error::NotAModel`] for other JSON and for a model that was refused; the errors of
/// [`crate::read_mat`] and [`crate::read_npz`]; [`youla::Error::UnknownChannel`] for a variable that is not there;
/// [`youla::Error::Shape`], [`youla::Error::NotFinite`], [`youla::Error::Ports`] for matrices that do not fit.
///
/// ```no_run
/// let hansen = youla_io::export::read_model("runs/my-machine-001/5-recombine/hansen.json")?;
/// println!("{} states", hansen.system.order());
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn read_model(path: impl AsRef<Path>) -> Result<NamedModel> {
    let path = path.as_ref();
    model_from_bytes(&crate::open::read_bytes(path)?, path)
}

/// The same of a file that is in memory; `path` is named in errors.
///
/// # Errors
/// Those of [`read_model`] but for the operating system's.
pub fn model_from_bytes(bytes: &[u8], path: impl AsRef<Path>) -> Result<NamedModel> {
    let path = path.as_ref();
    let mut model = match bytes.trim_ascii_start().first() {
        Some(b'{' | b'[') | None => of_json(bytes, path),
        Some(b'P') if bytes.starts_with(b"PK\x03\x04") => of_variables(&npz_from_bytes(bytes, path)?, path),
        _ if is_text(bytes) => Err(Error::NotAModel {
            path: path.to_owned(),
            problem: "this is text, but no model; give a run folder, or a model as JSON, MATLAB or NumPy file".into(),
        }),
        _ => of_variables(&mat_from_bytes(bytes, path)?, path),
    }?;
    model.origin = path.display().to_string();
    Ok(model)
}

/// Text without a header of MATLAB, which is text as well.
fn is_text(bytes: &[u8]) -> bool {
    !bytes.starts_with(b"MATLAB") && std::str::from_utf8(bytes).is_ok_and(|text| !text.contains('\0'))
}

/// A run folder holds this in place of a model that could not be computed.
#[derive(Deserialize)]
struct Refused {
    refused: String,
}

fn of_json(bytes: &[u8], path: &Path) -> Result<NamedModel> {
    let not = |problem: String| Error::NotAModel { path: path.to_owned(), problem };
    if let Ok(Refused { refused }) = serde_json::from_slice(bytes) {
        return Err(not(format!("there is no model; it was refused: {refused}")));
    }
    let file: ModelFile =
        serde_json::from_slice(bytes).map_err(|e| not(format!("this is not a model as JSON: {e}")))?;
    let system = file.system().map_err(|e| e.within(shown(path)))?;
    let channels = channels(&system, file.inputs, file.outputs);
    let model = NamedModel::new(&file.name.unwrap_or_else(|| stem(path)), system, channels)?;
    Ok(NamedModel { details: file.details, provenance: file.provenance.unwrap_or_default(), ..model })
}

fn of_variables(file: &Variables, path: &Path) -> Result<NamedModel> {
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|name| file.matrix(name));
    let time = Discrete::new(file.scalar("ts")?)?;
    let system = StateSpace::new(a?, b?, c?, d?, time).map_err(|e| e.within(shown(path)))?;
    let (u, y) = (names(file, "inputs", "input_units"), names(file, "outputs", "output_units"));
    let name = text(file.get("name").ok()).unwrap_or_else(|| stem(path));
    let channels = channels(&system, u, y);
    Ok(NamedModel { details: Predictor::details(file), ..NamedModel::new(&name, system, channels)? })
}

/// Names and units from cells of text, where there are such.
fn names(file: &Variables, names: &str, units: &str) -> Option<Vec<Channel>> {
    let cell = |name: &str| match file.get(name) {
        Ok(Value::Cell { items, .. }) => items.iter().map(|item| text(Some(item))).collect::<Option<Vec<_>>>(),
        _ => None,
    };
    let (names, units) = (cell(names)?, cell(units).unwrap_or_default());
    let unit = |k: usize| units.get(k).cloned().unwrap_or_default();
    Some(names.into_iter().enumerate().map(|(k, name)| Channel::new(name, unit(k))).collect())
}

fn text(value: Option<&Value>) -> Option<String> {
    match value {
        Some(Value::Text(lines)) => Some(lines.first().cloned().unwrap_or_default()),
        _ => None,
    }
}

fn channels(
    system: &StateSpace<Discrete>,
    inputs: Option<Vec<Channel>>,
    outputs: Option<Vec<Channel>>,
) -> (Vec<Channel>, Vec<Channel>) {
    let numbered =
        |letter: &str, count: usize| (1..=count).map(|k| Channel::new(format!("{letter}{k}"), "")).collect::<Vec<_>>();
    (
        inputs.unwrap_or_else(|| numbered("u", system.inputs())),
        outputs.unwrap_or_else(|| numbered("y", system.outputs())),
    )
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| "model".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
