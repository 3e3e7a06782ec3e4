//! What a report shows, as plain data: every struct here is drawn as it is, none is computed with.
//!
//! Parts that a run does not have stay empty and their figures are left out. Methods are named by a key, listed once in
//! [`ReportData::methods`] in the order in which they are drawn; outputs and inputs by their place in the channel lists.

use serde::{Deserialize, Serialize};

use super::figure::Figure;
use super::numbers;
use super::trace::{Timeline, Trace};
use youla::signal::Channel;

/// Everything in one report.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportData {
    /// Title, for example the machine.
    pub title: String,
    /// What was done, in one sentence.
    pub summary: String,
    /// Program and version.
    pub program: String,
    /// Name of the run.
    pub run: String,
    /// Options of the run as TOML.
    pub settings: String,
    /// Files that were read.
    pub sources: Vec<Source>,
    /// Input channels of the plant.
    pub inputs: Vec<Channel>,
    /// Output channels of the plant.
    pub outputs: Vec<Channel>,
    /// Seconds between samples; absent where the models are in continuous time.
    pub sample_time: Option<f64>,
    /// Models that are compared, in the order in which they are listed and drawn.
    pub methods: Vec<Method>,
    /// Tables that stand first, in place of the verdict: what a comparison of runs says.
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
    /// What is wrong with the data, the most serious first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<DataFinding>,
    /// Records used for estimation.
    pub experiments: Vec<Experiment>,
    /// How orders were chosen.
    pub orders: Vec<OrderChoice>,
    /// Poles over orders.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stabilisation: Vec<Stabilisation>,
    /// Measured against predicted.
    pub verification: Vec<Verification>,
    /// What is left of the verification records.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residuals: Option<Residuals>,
    /// Frequency responses.
    pub frequency: Option<FrequencyResponse>,
    /// Poles of each model.
    pub poles: Vec<Poles>,
    /// Modes of each model.
    pub modes: Vec<Mode>,
    /// Parameters of a physical structure, estimated and derived ones; empty without one.
    #[serde(default)]
    pub parameters: Vec<PhysicalParameter>,
    /// What stands beside them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub physical: Option<PhysicalEstimate>,
    /// Hankel singular values of the reduction.
    pub reduction: Option<Reduction>,
    /// Loop certificate of each model.
    pub certificates: Vec<Certificate>,
    /// Further evidence on the loop, below the certificates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub loop_tables: Vec<EvidenceTable>,
    /// A new controller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub redesign: Option<Redesign>,
    /// Margins of each model in its loop, and distances between models.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub margins: Vec<LoopMargins>,
    /// In which units channels are compared, in one sentence; empty without margins.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub margins_caption: String,
    /// Relative residual of the Bezout identity of the factors.
    pub bezout_residual: Option<f64>,
    /// Duration of each stage.
    pub stages: Vec<Stage>,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Source {
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
pub enum Role {
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
pub struct Method {
    /// Key by which the other structs name it.
    pub key: String,
    /// Name that figures and tables show.
    pub label: String,
    /// Its role.
    pub role: Role,
}

impl Method {
    /// A method under any key and label.
    pub fn new(key: impl Into<String>, label: impl Into<String>, role: Role) -> Self {
        Method { key: key.into(), label: label.into(), role }
    }

    /// `nominal`: the model known before.
    pub fn nominal() -> Self {
        Self::new("nominal", "nominal G(0)", Role::Nominal)
    }

    /// `pem`: grey-box prediction error, started at the nominal model.
    pub fn pem() -> Self {
        Self::new("pem", "PEM", Role::Pem)
    }

    /// `pem_multi_start`: the same from several starts.
    pub fn pem_multi_start() -> Self {
        Self::new("pem_multi_start", "PEM, several starts", Role::PemMultiStart)
    }

    /// `direct`: N4SID on u and y.
    pub fn direct() -> Self {
        Self::new("direct", "direct N4SID", Role::Direct)
    }

    /// `hansen`: the model of the Hansen scheme, full order.
    pub fn hansen() -> Self {
        Self::new("hansen", "Hansen G(S)", Role::Hansen)
    }

    /// `hansen_reduced`: the same after reduction.
    pub fn hansen_reduced() -> Self {
        Self::new("hansen_reduced", "Hansen reduced G_red(S)", Role::HansenReduced)
    }

    /// `hansen_pem`: prediction error, started at the projection of the Hansen model.
    pub fn hansen_pem() -> Self {
        Self::new("hansen_pem", "PEM from Hansen", Role::HansenPem)
    }
}

/// A part of the report to which a line of the verdict leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Evidence {
    /// Table of fits.
    Fits,
    /// Records used for estimation.
    Data,
    /// Alpha and beta.
    Signals,
    /// Singular values.
    Order,
    /// Stabilisation diagram.
    Stabilisation,
    /// Measured against predicted.
    Verification,
    /// Tests of the residuals.
    Residuals,
    /// Frequency responses.
    Frequency,
    /// Poles and modes.
    Poles,
    /// Hankel singular values.
    Reduction,
    /// Loop certificate.
    Certificate,
    /// New controller.
    Redesign,
    /// Margins of the loops.
    Margins,
}

/// How a finding is to be taken, from the lightest to the gravest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// In order.
    Good,
    /// Said for completeness.
    Info,
    /// To be looked at.
    Caution,
    /// Speaks against the model.
    Bad,
}

/// One line of the answer to "can I trust it?".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Whether it speaks for or against the model.
    pub status: Status,
    /// One sentence.
    pub text: String,
    /// Where the report shows it.
    pub evidence: Evidence,
}

/// A remark on the data or the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Note {
    /// SubspaceMethod of the remark.
    pub status: Status,
    /// One sentence.
    pub text: String,
}

/// One finding of the check of the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataFinding {
    /// Its weight: `Bad` where results would be wrong.
    pub status: Status,
    /// Which test.
    pub test: String,
    /// Name of the record.
    pub record: String,
    /// Channel, where one is meant.
    pub channel: Option<String>,
    /// First and last row of the file, where a place is known.
    pub rows: Option<[usize; 2]>,
    /// What was found.
    pub what: String,
    /// What to do; may be empty.
    pub advice: String,
    /// Further records with the same finding.
    #[serde(default)]
    pub further: usize,
}

/// Fit of one model to one output of one record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Name of the record.
    pub record: String,
    /// Output, by its place.
    pub output: usize,
    /// Key of the method.
    pub method: String,
    /// NRMSE fit of eq. (26), percent; absent where the prediction diverged.
    pub fit: Option<f64>,
}

/// What a signal of an experiment is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SignalKind {
    /// Plant input u.
    Input,
    /// Plant output y.
    Output,
    /// External excitation.
    Excitation,
    /// Input alpha of S.
    Alpha,
    /// Output beta of S.
    Beta,
}

/// One record used for estimation, with the signals derived from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    /// Name of the record.
    pub name: String,
    /// Time axis of all its signals.
    pub clock: Timeline,
    /// The signals, in the order in which they are drawn.
    pub signals: Vec<Signal>,
}

/// One signal of an experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// What it is.
    pub kind: SignalKind,
    /// Its name and unit.
    pub channel: Channel,
    /// Its course.
    pub trace: Trace,
}

/// Singular values from which an order was chosen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderChoice {
    /// Key of the method.
    pub method: String,
    /// What was identified, for example "S from alpha to beta".
    pub label: String,
    /// Singular values, falling.
    #[serde(with = "numbers")]
    pub values: Vec<f64>,
    /// The order that was taken.
    pub chosen: usize,
}

/// A parameter or derived quantity of a physical structure, in report, summary and artefact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhysicalParameter {
    /// Name.
    pub name: String,
    /// Unit, empty where none is declared.
    pub unit: String,
    /// Estimate.
    pub value: f64,
    /// Standard deviation, where it is known.
    pub deviation: Option<f64>,
    /// Interval at the level of [`PhysicalEstimate`], where it is known.
    #[serde(default)]
    pub interval: Option<[f64; 2]>,
    /// The bound at which it ended.
    pub at_bound: Option<f64>,
    /// Whether it follows from the others.
    pub derived: bool,
}

/// What stands beside the parameters of a physical structure.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PhysicalEstimate {
    /// Probability with which an interval should hold the truth; absent where there are none.
    pub level: Option<f64>,
    /// Whether the intervals can be believed, in one sentence.
    pub verdict: String,
    /// Names of the parameters that were estimated.
    pub names: Vec<String>,
    /// Their correlations, row by row; empty where they are not known.
    pub correlations: Vec<Vec<f64>>,
    /// The structures that were compared, the declared one first; empty where only that was estimated.
    pub structures: Vec<PhysicalStructure>,
}

/// One of several physical structures.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PhysicalStructure {
    /// Name.
    pub name: String,
    /// Parameters and estimated initial states.
    pub unknowns: Option<usize>,
    /// Fit of the estimation records per output, percent.
    pub fit: Vec<f64>,
    /// Akaike's criterion, less the smallest.
    pub aic: Option<f64>,
    /// Schwarz's criterion, less the smallest.
    pub bic: Option<f64>,
    /// Likelihood ratio against the declared structure, where one of the two holds the other.
    pub statistic: Option<f64>,
    /// Its degrees of freedom.
    pub degrees_of_freedom: Option<usize>,
    /// Probability of a larger one where the smaller structure is true.
    pub p_value: Option<f64>,
    /// Why there is no estimate.
    pub failure: Option<String>,
}

/// The stabilisation diagram of one method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stabilisation {
    /// Key of the method.
    pub method: String,
    /// What was identified, for example "S from alpha to beta".
    pub label: String,
    /// The orders, rising.
    pub orders: Vec<usize>,
    /// The order of the model.
    pub chosen: usize,
    /// The poles by order.
    pub poles: Vec<StabilisationPole>,
    /// Clusters by frequency.
    pub clusters: Vec<StabilisationCluster>,
}

/// One pole of a stabilisation diagram.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StabilisationPole {
    /// Order of its model.
    pub order: usize,
    /// Natural frequency, Hz.
    pub hz: f64,
    /// Damping ratio.
    pub zeta: f64,
    /// Standard deviation of the frequency, Hz, where it is known.
    pub hz_deviation: Option<f64>,
    /// Standard deviation of the damping ratio, where it is known.
    pub zeta_deviation: Option<f64>,
    /// Whether the pole is stable.
    pub stable: bool,
    /// What the next lower order says of it.
    pub standing: PoleStability,
    /// Its cluster, by its place.
    pub cluster: Option<usize>,
}

/// What the next lower order says of a pole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoleStability {
    /// It has none of this frequency.
    New,
    /// It has one of this frequency, with another damping ratio or mode shape.
    Frequency,
    /// It has one of this frequency, damping ratio and mode shape.
    Stable,
}

/// Poles of many orders that are close to each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StabilisationCluster {
    /// Median of the natural frequencies, Hz.
    pub hz: f64,
    /// Median of the damping ratios.
    pub zeta: f64,
    /// Half the distance of the quartiles of the frequencies, Hz.
    pub hz_spread: f64,
    /// Half the distance of the quartiles of the damping ratios.
    pub zeta_spread: f64,
    /// Median of the standard deviations of the frequencies, Hz, where they are known.
    pub hz_deviation: Option<f64>,
    /// Median of the standard deviations of the damping ratios, where they are known.
    pub zeta_deviation: Option<f64>,
    /// Number of orders at which it appears.
    pub orders: usize,
    /// Number of orders at which it is settled.
    pub settled: usize,
    /// Mode shape: magnitude and phase in degrees of each output.
    pub shape: Vec<[f64; 2]>,
}

/// Measured against predicted on one record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// Name of the record.
    pub record: String,
    /// How the prediction was made, for example "simulated from the measured input".
    pub prediction: String,
    /// Time axis of all its curves.
    pub clock: Timeline,
    /// One entry per output that was compared.
    pub outputs: Vec<VerifiedOutput>,
}

/// One output of a verification record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerifiedOutput {
    /// Output, by its place.
    pub output: usize,
    /// What the machine did.
    pub measured: Trace,
    /// What the models say.
    pub predictions: Vec<Prediction>,
}

/// What one model says of one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Key of the method.
    pub method: String,
    /// Predicted output.
    pub predicted: Trace,
    /// Measured less predicted, reduced from all samples by itself.
    pub residual: Trace,
}

/// What the models leave of the verification records.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    /// What the measured outputs are held against, in words.
    pub prediction: String,
    /// Whether all are correlated with excitations from outside of the loop, and not with the input.
    pub external: bool,
    /// Steps ahead of the fits.
    pub steps: Vec<usize>,
    /// One entry per method and record.
    pub tests: Vec<ResidualTest>,
}

/// What one model leaves of one record.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ResidualTest {
    /// Name of the record.
    pub record: String,
    /// Key of the method.
    pub method: String,
    /// Names of what the residual is correlated with.
    pub excitations: Vec<String>,
    /// Whether it does not depend on their past; absent where they are not from outside.
    pub independent: Option<bool>,
    /// Auto-correlation per output, at the lags from 0 on.
    pub auto: Vec<Correlation>,
    /// Correlation with each excitation, outputs first: at the lags around 0.
    pub cross: Vec<Correlation>,
    /// Fits in percent, per number of steps and last for the simulation, per output.
    pub k_step_fits: Vec<Vec<Option<f64>>>,
    /// What foresees the residual of the simulation in them, in words.
    #[serde(default)]
    pub predictor: String,
}

/// A correlation over lags with the band of noise.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Correlation {
    /// Values.
    pub values: Vec<f64>,
    /// Band of a single value at 99 %.
    pub band: f64,
}

impl Correlation {
    /// Values to four decimal places, which is what a figure shows.
    pub fn new(values: &[f64], band: f64) -> Self {
        let round = |v: f64| if v.is_finite() { (1e4 * v).round() / 1e4 } else { 0.0 };
        Correlation { values: values.iter().map(|v| round(*v)).collect(), band: (1e5 * band).round() / 1e5 }
    }
}

/// Frequency responses of all models on one grid, and the measured ones on theirs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FrequencyResponse {
    /// Grid of the models, Hz, rising.
    #[serde(with = "numbers::seven_digits")]
    pub hz: Vec<f64>,
    /// One entry per method, output and input.
    pub models: Vec<ModelResponse>,
    /// Non-parametric responses where the external excitation is known, per output and input.
    pub indirect: Vec<Indirect>,
    /// Bounds of magnitudes on the grid of the models.
    pub bands: Vec<Band>,
    /// Singular values of models with several inputs and outputs, on the grid of the models.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub singular: Vec<SingularValue>,
}

/// One singular value of the response of one model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SingularValue {
    /// Key of the method.
    pub method: String,
    /// Its place, 0 for the largest.
    pub place: usize,
    /// Its course, dB.
    #[serde(with = "numbers::seven_digits")]
    pub value_db: Vec<f64>,
    /// Probability with which the bounds should hold the truth, at each frequency; absent without bounds.
    pub level: Option<f64>,
    /// Lower bound, dB; empty without bounds.
    #[serde(with = "numbers::seven_digits")]
    pub low_db: Vec<f64>,
    /// Upper bound, dB.
    #[serde(with = "numbers::seven_digits")]
    pub high_db: Vec<f64>,
}

/// Bounds of the response of one model from one input to one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Key of the method.
    pub method: String,
    /// Output, by its place.
    pub output: usize,
    /// Input, by its place.
    pub input: usize,
    /// Probability with which the bounds should hold the truth, at each frequency.
    pub level: f64,
    /// Lower bound, dB.
    #[serde(with = "numbers::seven_digits")]
    pub low_db: Vec<f64>,
    /// Upper bound, dB.
    #[serde(with = "numbers::seven_digits")]
    pub high_db: Vec<f64>,
    /// Region of the complex value: per frequency the entries rr, ri, ii of V in `d' V^-1 d <= 1`, d the real and imaginary
    /// part of the distance from the response.
    #[serde(default, with = "numbers::seven_digits", skip_serializing_if = "Vec::is_empty")]
    pub region: Vec<f64>,
}

/// Response of one model from one input to one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelResponse {
    /// Key of the method.
    pub method: String,
    /// Output, by its place.
    pub output: usize,
    /// Input, by its place.
    pub input: usize,
    /// Magnitude in dB.
    #[serde(with = "numbers::seven_digits")]
    pub magnitude_db: Vec<f64>,
    /// Phase in degrees, on any branch.
    #[serde(with = "numbers::seven_digits")]
    pub phase_deg: Vec<f64>,
}

/// Indirect non-parametric response from one input to one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Indirect {
    /// Output, by its place.
    pub output: usize,
    /// Input, by its place.
    pub input: usize,
    /// Its own grid, Hz, rising.
    #[serde(with = "numbers::seven_digits")]
    pub hz: Vec<f64>,
    /// Magnitude in dB.
    #[serde(with = "numbers::seven_digits")]
    pub magnitude_db: Vec<f64>,
    /// Phase in degrees, on any branch.
    #[serde(with = "numbers::seven_digits")]
    pub phase_deg: Vec<f64>,
    /// Coherence with the excitation, 0 to 1.
    #[serde(with = "numbers::seven_digits")]
    pub coherence: Vec<f64>,
}

/// Poles and zeros of one model, in z or, without a sample time, in rad/s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Poles {
    /// Key of the method.
    pub method: String,
    /// Real and imaginary parts.
    pub poles: Vec<[f64; 2]>,
    /// Those of the finite invariant zeros, where the model has as many inputs as outputs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zeros: Vec<[f64; 2]>,
}

/// A mode of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// Key of the method.
    pub method: String,
    /// Natural frequency, Hz.
    pub hz: f64,
    /// Damping ratio; negative where the mode is unstable.
    pub zeta: f64,
    /// Standard deviations of both, where they are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deviation: Option<[f64; 2]>,
}

/// Hankel singular values of a model that was reduced, and what each order costs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Reduction {
    /// What was reduced and how, for example "G(S) by balanced truncation".
    pub label: String,
    /// Hankel singular values, falling.
    #[serde(with = "numbers")]
    pub hankel: Vec<f64>,
    /// Order that was kept.
    pub chosen: usize,
    /// States among them whose poles were kept as they are; they have no Hankel singular value.
    #[serde(default)]
    pub kept: usize,
    /// Bound of the error in the H-infinity norm, in the units of the model, or in the gap metric.
    pub bound: Option<f64>,
    /// Whether the bound is one of the gap.
    #[serde(default)]
    pub bound_is_gap: bool,
    /// Largest gain of the model over frequency, where it is finite.
    #[serde(default)]
    pub plant_norm: Option<f64>,
    /// What every order costs; empty where that was not computed.
    #[serde(default)]
    pub orders: Vec<ReductionOrder>,
    /// The outcome, in a sentence.
    #[serde(default)]
    pub sentence: String,
}

/// One order of a reduction.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReductionOrder {
    /// The order.
    pub order: usize,
    /// A-priori bound of the error.
    pub bound: Option<f64>,
    /// Largest gain of the error over frequency.
    pub open_loop: Option<f64>,
    /// The same over that of the model.
    pub open_loop_relative: Option<f64>,
    /// Error of the closed loop from alpha to y over the closed loop.
    pub closed_loop_relative: Option<f64>,
    /// Whether the controller stabilises the model of this order.
    pub stabilised: bool,
    /// Closed-loop pole nearest to or farthest beyond the boundary of stability.
    pub worst_pole: Option<[f64; 2]>,
    /// Why there is no model of this order.
    pub failure: Option<String>,
}

/// What can be said of one model in the loop with the actual controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Key of the method.
    pub method: String,
    /// Order of the model.
    pub order: usize,
    /// Order of S where the model came from one.
    pub s_order: Option<usize>,
    /// Whether S is stable.
    pub s_stable: Option<bool>,
    /// Whether the controller of the log stabilises the model.
    pub stabilised_by_controller: Option<bool>,
    /// Closed-loop pole nearest to or farthest beyond the boundary of stability.
    pub worst_closed_loop_pole: Option<[f64; 2]>,
}

/// A new controller: its loop beside the present one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Redesign {
    /// The loops that the figure compares.
    pub loops: Vec<Method>,
    /// Their responses.
    pub figure: Figure,
    /// Modes, and the weights that were tried.
    pub tables: Vec<EvidenceTable>,
}

/// A table of evidence, in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvidenceTable {
    /// Title.
    pub title: String,
    /// What it says, in a sentence above it; may be empty.
    pub text: String,
    /// Heads of the columns; the first one names the rows.
    pub columns: Vec<String>,
    /// Rows of cells; a short row ends early.
    pub rows: Vec<Vec<String>>,
    /// What stands below it.
    pub caption: String,
}

/// What the loop of one model with the actual controller can bear, and how far the model is from others.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LoopMargins {
    /// Key of the method.
    pub method: String,
    /// Why there are no margins: the loop is unstable, or not well posed.
    pub refusal: Option<String>,
    /// Peak of the output sensitivity, all outputs at once.
    pub peak_sensitivity: Option<f64>,
    /// Zone of ISO 14839-3 by the worst output, one at a time: A to D.
    pub zone: Option<String>,
    /// Highest factor below 1 on the gain of one channel at which the loop is no longer stable; absent where no factor is too low.
    pub lowest_gain: Option<f64>,
    /// Lowest factor above 1 at which it is no longer stable; absent where no factor is too high.
    pub highest_gain: Option<f64>,
    /// Smallest phase margin of one channel, degrees.
    pub phase_deg: Option<f64>,
    /// Smallest delay margin of one channel, milliseconds.
    pub delay_ms: Option<f64>,
    /// Balanced disk margin of all inputs or all outputs at once, the smaller one.
    pub disk: Option<f64>,
    /// Change of phase that it allows, degrees.
    pub disk_phase_deg: Option<f64>,
    /// Normalised coprime margin b(G, K) in scaled channels; 0 where the loop is unstable.
    pub coprime: Option<f64>,
    /// nu-gap to the nominal model, in scaled channels.
    pub gap_to_nominal: Option<f64>,
    /// nu-gap to G(S), in scaled channels.
    pub gap_to_hansen: Option<f64>,
}

/// Duration of one stage of the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// Seconds.
    pub seconds: f64,
}
