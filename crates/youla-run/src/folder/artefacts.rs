//! Models as artefacts, and the provenance that every artefact states.

use crate::records::SourceFile;
use crate::settings::RunSettings;
use serde::{Deserialize, Serialize};

/// Version of the layout of all artefacts; that of summary.json is `schema` of [`crate::Summary`].
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
pub type RunModelFile<O = RunSettings> = youla_io::ModelFile<Provenance<O>>;
