//! The JSON form of a discrete-time model: written by runs and exports, read by imports.

use crate::error::Result;
use crate::matrices::SystemMatrices;
use serde::{Deserialize, Serialize};
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;

/// A discrete-time model as JSON. `P` is the type of the provenance: any JSON value by default, a struct in a run folder.
///
/// A file of another program needs `ts`, `a`, `b`, `c` and `d` only.
///
/// ```
/// use youla_io::ModelFile;
/// let file: ModelFile = serde_json::from_str(r#"{"ts": 0.1, "a": [[0.5]], "b": [[1]], "c": [[1]], "d": [[0]]}"#)?;
/// assert_eq!(file.system()?.poles()?[0].re, 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelFile<P = Option<serde_json::Value>> {
    /// Name of the model, for example `hansen`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Channels of the inputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inputs: Option<Vec<Channel>>,
    /// Channels of the outputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Vec<Channel>>,
    /// Sample time, seconds.
    pub ts: f64,
    /// `a`, `b`, `c`, `d`.
    #[serde(flatten)]
    pub matrices: SystemMatrices,
    /// Poles, real and imaginary parts; not read back.
    #[serde(default)]
    pub poles: Vec<[f64; 2]>,
    /// Further results that belong to the model.
    #[serde(default)]
    pub details: serde_json::Value,
    /// Where the model comes from.
    pub provenance: P,
}

impl<P> ModelFile<P> {
    /// Describes a model with its inputs and outputs.
    ///
    /// # Errors
    /// [`youla::Error::NoConvergence`] of the poles.
    pub fn new(
        name: &str,
        model: &StateSpace<Discrete>,
        (inputs, outputs): (Vec<Channel>, Vec<Channel>),
        details: serde_json::Value,
        provenance: P,
    ) -> Result<Self> {
        Ok(ModelFile {
            name: Some(name.to_owned()),
            inputs: Some(inputs),
            outputs: Some(outputs),
            ts: model.time().ts(),
            matrices: SystemMatrices::new(model),
            poles: model.poles()?.iter().map(|p| [p.re, p.im]).collect(),
            details,
            provenance,
        })
    }

    /// The model.
    ///
    /// # Errors
    /// [`youla::Error::Shape`], [`youla::Error::NotFinite`] for matrices that do not fit together, and
    /// [`youla::Error::OutOfRange`] for a sample time that is not positive.
    pub fn system(&self) -> Result<StateSpace<Discrete>> {
        self.matrices.system(Discrete::new(self.ts)?)
    }
}
