//! Models for other tools: as data (JSON, MATLAB, NumPy), as scripts (python-control, MATLAB) and as C99 headers of the model
//! and of the controller `J_K(Q)` of (21), (22), so that firmware runs the experiment itself.
//!
//! Sequences for an experiment are exported as text, MATLAB file and C99 header.
//!
//! Every number is written with as many digits as it takes to read back the same bits.

mod c;
mod c_controller;
mod c_loop;
mod controller;
mod json;
mod matlab;
mod npz;
mod pid;
mod pid_tables;
mod precision;
mod predictor;
mod python;
mod read;
mod second_order;
mod sequence;
mod text;

pub use c_controller::{CController, ControllerExport, c_controller};
pub use c_loop::{LoopExport, c_loop};
pub use controller::{ExportedController, ObserverData};
pub use pid::{PidExport, PidForm, export_pid, weighted_error};
pub use pid_tables::Firmware;
pub use precision::SingleError;
pub use read::{model_from_bytes, read_model};
pub use sequence::{SequenceFormat, export_sequence};

use crate::error::{Error, Result};
use crate::folder::replace_file;
use crate::matfile::mat_to_bytes;
use crate::target::require_free;
use crate::values::{Value, Variable};
use std::path::Path;
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;

/// A discrete-time model with what is known of it besides its matrices.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedModel {
    /// What the model is, for example `hansen`.
    pub name: String,
    /// Channels of its inputs.
    pub inputs: Vec<Channel>,
    /// Channels of its outputs.
    pub outputs: Vec<Channel>,
    /// The model.
    pub system: StateSpace<Discrete>,
    /// Further results that belong to it, as its JSON file states them; `null` where there are none.
    pub details: serde_json::Value,
    /// Where it comes from, as its JSON file states it; `null` where nothing is known.
    pub provenance: serde_json::Value,
    /// The file that it was read from, for the comments of scripts and headers; may be empty.
    pub origin: String,
}

impl NamedModel {
    /// A model with channels.
    ///
    /// # Errors
    /// [`youla::Error::Ports`] where their numbers are not those of the model.
    pub fn new(
        name: &str,
        system: StateSpace<Discrete>,
        (inputs, outputs): (Vec<Channel>, Vec<Channel>),
    ) -> Result<Self> {
        for (what, expected, found) in [
            ("the number of names of inputs", system.inputs(), inputs.len()),
            ("the number of names of outputs", system.outputs(), outputs.len()),
        ] {
            if expected != found {
                return Err(Error::Method(youla::Error::Ports {
                    what: format!("{what} of the model {name:?}"),
                    expected,
                    found,
                }));
            }
        }
        let (details, provenance) = (serde_json::Value::Null, serde_json::Value::Null);
        Ok(NamedModel { name: name.to_owned(), inputs, outputs, system, details, provenance, origin: String::new() })
    }
}

/// What a model can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelFormat {
    /// MATLAB file of version 5: `a`, `b`, `c`, `d`, `ts`, names, predictor.
    Mat,
    /// JSON, as in a run folder.
    Json,
    /// NumPy archive: `a`, `b`, `c`, `d`, `ts`, predictor.
    Npz,
    /// Script that makes a `control.ss` of python-control.
    Python,
    /// Script that makes an `ss` of MATLAB or Octave.
    Matlab,
    /// C99 header: output and update of the state, in double or single precision.
    C,
}

impl ModelFormat {
    /// All formats.
    pub const ALL: [ModelFormat; 6] = [
        ModelFormat::Mat,
        ModelFormat::Json,
        ModelFormat::Npz,
        ModelFormat::Python,
        ModelFormat::Matlab,
        ModelFormat::C,
    ];

    /// Its name on the command line.
    pub fn key(self) -> &'static str {
        match self {
            ModelFormat::Mat => "mat",
            ModelFormat::Json => "json",
            ModelFormat::Npz => "npz",
            ModelFormat::Python => "python",
            ModelFormat::Matlab => "matlab",
            ModelFormat::C => "c",
        }
    }

    /// What its files end in.
    pub fn extension(self) -> &'static str {
        match self {
            ModelFormat::Python => "py",
            ModelFormat::Matlab => "m",
            ModelFormat::C => "h",
            data => data.key(),
        }
    }
}

/// A model as the bytes of a file. The same model gives the same bytes.
///
/// # Errors
/// [`youla::Error::NoConvergence`] of its poles (JSON, C); [`youla::Error::OutOfRange`] for a C header of a model without inputs or outputs;
/// [`Error::WrongVariable`] for a matrix that is too large for a MATLAB file.
///
/// ```
/// use youla_io::export::{ModelFormat, NamedModel, export_model, model_from_bytes};
/// use youla::{Mat, linalg::eye, lti::{Discrete, StateSpace}, signal::Channel};
/// let system = StateSpace::new(Mat::zeros(1, 1), eye(1), eye(1), eye(1), Discrete::new(0.1)?)?;
/// let model = NamedModel::new("hansen", system, (vec![Channel::new("u", "V")], vec![Channel::new("y", "um")]))?;
/// let bytes = export_model(&model, ModelFormat::Npz)?;
/// assert_eq!(model_from_bytes(&bytes, "hansen.npz")?.system, model.system);
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn export_model(model: &NamedModel, format: ModelFormat) -> Result<Vec<u8>> {
    match format {
        ModelFormat::Mat => mat(model),
        ModelFormat::Json => json::json(model).map(String::into_bytes),
        ModelFormat::Npz => npz::npz(model),
        ModelFormat::Python => Ok(python::python(model).into_bytes()),
        ModelFormat::Matlab => Ok(matlab::matlab(model).into_bytes()),
        ModelFormat::C => c::c(model).map(String::into_bytes),
    }
}

/// Writes the bytes of an export beside their place and moves them there when whole. An existing file stays unless `replace` is set.
///
/// # Errors
/// [`Error::FileExists`], [`Error::Io`]; nothing is left behind then.
pub fn write_export(path: &Path, bytes: &[u8], replace: bool) -> Result<()> {
    require_free(path, replace, &[])?;
    replace_file(path, bytes)
}

/// `a`, `b`, `c`, `d`, `ts` as in a run folder, `predictor_a` and so on where the model has a predictor, and the names and units of the channels as cells of text.
fn mat(model: &NamedModel) -> Result<Vec<u8>> {
    let g = &model.system;
    let cell = |of: fn(&Channel) -> &String, channels: &[Channel]| Value::Cell {
        dims: vec![1, channels.len()],
        items: channels.iter().map(|c| Value::text(of(c))).collect(),
    };
    let own = [
        ("a", Value::matrix(g.a())),
        ("b", Value::matrix(g.b())),
        ("c", Value::matrix(g.c())),
        ("d", Value::matrix(g.d())),
        ("ts", Value::scalar(g.time().ts())),
        ("name", Value::text(&model.name)),
        ("inputs", cell(|c| &c.name, &model.inputs)),
        ("outputs", cell(|c| &c.name, &model.outputs)),
        ("input_units", cell(|c| &c.unit, &model.inputs)),
        ("output_units", cell(|c| &c.unit, &model.outputs)),
        ("program", Value::text(text::PROGRAM)),
    ];
    let mut variables = own.map(|(name, value)| Variable { name: name.into(), value }).to_vec();
    if let Some(predictor) = predictor::Predictor::of(model) {
        let matrices = predictor.matrices(model);
        variables.extend(matrices.map(|(name, m)| Variable { name, value: Value::matrix(m.as_ref()) }));
    }
    mat_to_bytes(&variables)
}

#[cfg(test)]
mod tests;
