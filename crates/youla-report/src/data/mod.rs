//! What a report shows, as plain data: every struct here is drawn as it is, none is computed with.
//!
//! Parts that a run does not have stay empty and their figures are left out. Methods are named by a key, listed once in
//! [`ReportData::methods`] in the order in which they are drawn; outputs and inputs by their place in the channel lists.
//!
//! | file | holds |
//! |---|---|
//! | `verdict` | verdict, notes, findings, tables of evidence |
//! | `records` | signals, predictions, residuals, fits |
//! | `models` | orders, poles, modes, reduction |
//! | `frequency` | frequency responses with their confidence regions |
//! | `physical` | parameters of a physical structure |
//! | `loops` | certificates, margins, redesign |

mod frequency;
mod loops;
mod models;
mod physical;
mod records;
mod verdict;

pub use frequency::*;
pub use loops::*;
pub use models::*;
pub use physical::*;
pub use records::*;
pub use verdict::*;

use serde::{Deserialize, Serialize};
use youla::signal::Channel;

/// Everything in one report.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportData {
    /// Title, for example the machine.
    pub title: String,
    /// Summary, in one sentence.
    pub summary: String,
    /// Program and version.
    pub program: String,
    /// Name of the run.
    pub run: String,
    /// Options of the run as TOML.
    pub settings: String,
    /// Files that were read.
    pub sources: Vec<SourceFile>,
    /// Input channels of the plant.
    pub inputs: Vec<Channel>,
    /// Output channels of the plant.
    pub outputs: Vec<Channel>,
    /// Seconds between samples; absent where the models are in continuous time.
    pub sample_time: Option<f64>,
    /// Models that are compared, in the order in which they are listed and drawn.
    pub methods: Vec<DrawnMethod>,
    /// Tables of a comparison of runs, shown first and in place of the verdict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overview: Vec<EvidenceTable>,
    /// The answer to "can I trust it?", in five lines.
    pub verdict: Vec<Verdict>,
    /// What else was found, in lines of the same kind.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further: Vec<Verdict>,
    /// What the user should know besides.
    pub notes: Vec<Note>,
    /// Fits on verification data.
    pub fits: Vec<Fit>,
    /// Findings of the check of the data, the most serious first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<DataFinding>,
    /// Records used for estimation.
    pub experiments: Vec<DrawnExperiment>,
    /// How orders were chosen.
    pub orders: Vec<OrderChoice>,
    /// Measured against predicted.
    pub verification: Vec<Verification>,
    /// Tests of the residuals on the verification records.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
    /// Frequency responses.
    pub frequency: Option<DrawnResponses>,
    /// Poles of each model.
    pub poles: Vec<Poles>,
    /// Modes of each model.
    pub modes: Vec<DrawnMode>,
    /// What is left out of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unlisted: Vec<UnlistedModes>,
    /// Parameters of a physical structure, estimated and derived ones; empty without one.
    #[serde(default)]
    pub parameters: Vec<PhysicalParameter>,
    /// Their intervals and correlations, and the structures that were compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub physical: Option<PhysicalEstimate>,
    /// Hankel singular values of the reduction.
    pub reduction: Option<DrawnReduction>,
    /// Loop certificate of each model.
    pub certificates: Vec<Certificate>,
    /// Further evidence on the loop, below the certificates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loop_tables: Vec<EvidenceTable>,
    /// Evidence on the recommended model, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recommended: Vec<EvidenceTable>,
    /// A new controller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub redesign: Option<DrawnRedesign>,
    /// Margins of each model in its loop, and distances between models.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub margins: Vec<LoopMargins>,
    /// In which units channels are compared, in one sentence; empty without margins.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub margins_caption: String,
    /// Relative residual of the Bezout identity of the factors.
    pub bezout_residual: Option<f64>,
    /// Duration of each stage.
    pub stages: Vec<StageTime>,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SourceFile {
    /// Path as the user gave it.
    pub path: String,
    /// What it was used for, for example "estimation".
    pub purpose: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// What a model is in the comparison. It decides colour and marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MethodRole {
    /// The model that the run recommends.
    Recommended,
    /// The model known before.
    Nominal,
    /// Prediction error from the nominal model.
    Pem,
    /// Prediction error from several starts.
    PemMultiStart,
    /// Identified from u and y directly.
    Direct,
    /// Identified by the Hansen scheme.
    Hansen,
    /// The Hansen model after reduction.
    HansenReduced,
    /// Prediction error from the projection of the Hansen model.
    HansenPem,
    /// Any further method; colours are taken from the rest of the palette.
    Other,
}

/// A model that is compared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawnMethod {
    /// Key by which the other structs name it.
    pub key: String,
    /// Name that figures and tables show.
    pub label: String,
    /// Its role.
    pub role: MethodRole,
}

impl DrawnMethod {
    /// A method under any key and label.
    pub fn new(key: impl Into<String>, label: impl Into<String>, role: MethodRole) -> Self {
        DrawnMethod { key: key.into(), label: label.into(), role }
    }

    /// `nominal`: the model known before.
    pub fn nominal() -> Self {
        Self::new("nominal", "nominal G(0)", MethodRole::Nominal)
    }

    /// `pem`: grey-box prediction error, started at the nominal model.
    pub fn pem() -> Self {
        Self::new("pem", "PEM", MethodRole::Pem)
    }

    /// `pem_multi_start`: the same from several starts.
    pub fn pem_multi_start() -> Self {
        Self::new("pem_multi_start", "PEM, several starts", MethodRole::PemMultiStart)
    }

    /// `direct`: N4SID on u and y.
    pub fn direct() -> Self {
        Self::new("direct", "direct N4SID", MethodRole::Direct)
    }

    /// `hansen`: the model of the Hansen scheme, full order.
    pub fn hansen() -> Self {
        Self::new("hansen", "Hansen G(S)", MethodRole::Hansen)
    }

    /// `hansen_reduced`: the same after reduction.
    pub fn hansen_reduced() -> Self {
        Self::new("hansen_reduced", "Hansen reduced G_red(S)", MethodRole::HansenReduced)
    }

    /// `hansen_pem`: prediction error, started at the projection of the Hansen model.
    pub fn hansen_pem() -> Self {
        Self::new("hansen_pem", "PEM from Hansen", MethodRole::HansenPem)
    }
}

/// Duration of one stage of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageTime {
    /// Its name.
    pub name: String,
    /// Seconds.
    pub seconds: f64,
}
