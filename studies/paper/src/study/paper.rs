//! Everything that was found.

use super::experiments::Experiments;
use super::method::StudyMethod;
use super::row::StudyRow;
use super::settings::PaperSettings;
use serde::{Deserialize, Serialize};
use youla_twin::rig::RigParameters;

/// The results of the whole paper, from which the report is drawn.
#[derive(Debug, Clone)]
pub struct Paper {
    /// What was chosen.
    pub settings: PaperSettings,
    /// The rig.
    pub rig: RigParameters,
    /// Rows of Figs 4 and 5.
    pub study: Vec<StudyRow>,
    /// Rows of the crossover map.
    pub crossover: Vec<StudyRow>,
    /// Table 1 and Figs 6 to 10.
    pub experiments: Experiments,
    /// What took how long.
    pub timing: PaperTiming,
}

/// Where the time went. Not part of the results: it differs from run to run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperTiming {
    /// Threads.
    pub threads: usize,
    /// Wall seconds per stage, of this call.
    pub stages: Vec<(String, f64)>,
    /// Loops of study and map that were computed in this call.
    pub loops: usize,
    /// Mean processor milliseconds of a loop for design and simulation.
    pub loop_ms: f64,
    /// Mean processor milliseconds per method, identification and verification.
    pub method_ms: Vec<(StudyMethod, f64)>,
}
