//! Models as artefacts, and the provenance that every artefact states.

use super::entries::pairs;
use super::records::SourceFile;
use super::settings::RunSettings;
use crate::Result;
use serde::{Deserialize, Serialize};
use youla::lti::{Discrete, StateSpace};
use youla::signal::Channel;
use youla::{Mat, MatRef};

/// Version of the layout of all artefacts; that of summary.json is [`crate::SUMMARY_SCHEMA`].
pub const SCHEMA: u32 = 1;

/// Where an artefact comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance<O = RunSettings> {
    /// Version of the layout.
    pub schema: u32,
    /// Program and version.
    pub program: String,
    /// Seed of simulated data.
    pub seed: Option<u64>,
    /// Files that were read, with their SHA-256.
    pub sources: Vec<SourceFile>,
    /// All options of the run.
    pub options: O,
}

/// A discrete-time model as an artefact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelFile<O = RunSettings> {
    /// What the model is.
    pub name: String,
    /// Channels of its inputs.
    pub inputs: Vec<Channel>,
    /// Channels of its outputs.
    pub outputs: Vec<Channel>,
    /// Sample time, seconds.
    pub ts: f64,
    /// A by rows.
    pub a: Vec<Vec<f64>>,
    /// B by rows.
    pub b: Vec<Vec<f64>>,
    /// C by rows.
    pub c: Vec<Vec<f64>>,
    /// D by rows.
    pub d: Vec<Vec<f64>>,
    /// Poles, real and imaginary parts.
    pub poles: Vec<[f64; 2]>,
    /// Further results that belong to the model.
    pub details: serde_json::Value,
    /// Where it comes from.
    pub provenance: Provenance<O>,
}

impl<O> ModelFile<O> {
    /// Describes a model with its inputs and outputs.
    ///
    /// # Errors
    /// [`youla::Error::NoConvergence`] of the poles.
    pub fn new(
        name: &str,
        model: &StateSpace<Discrete>,
        (inputs, outputs): (Vec<Channel>, Vec<Channel>),
        details: serde_json::Value,
        provenance: Provenance<O>,
    ) -> Result<Self> {
        let rows = |m: MatRef<'_, f64>| (0..m.nrows()).map(|i| m.row(i).iter().copied().collect()).collect();
        Ok(ModelFile {
            name: name.to_owned(),
            inputs,
            outputs,
            ts: model.time().ts(),
            a: rows(model.a()),
            b: rows(model.b()),
            c: rows(model.c()),
            d: rows(model.d()),
            poles: pairs(&model.poles()?),
            details,
            provenance,
        })
    }

    /// The model itself.
    ///
    /// # Errors
    /// Shapes that do not fit, as in a file that was changed by hand.
    pub fn system(&self) -> Result<StateSpace<Discrete>> {
        let (n, m) = (self.a.len(), self.inputs.len());
        let matrix = |rows: &[Vec<f64>], columns: usize| {
            Mat::from_fn(rows.len(), columns, |i, j| rows[i].get(j).copied().unwrap_or(f64::NAN))
        };
        Ok(StateSpace::new(
            matrix(&self.a, n),
            matrix(&self.b, m),
            matrix(&self.c, n),
            matrix(&self.d, m),
            Discrete::new(self.ts)?,
        )?)
    }
}
