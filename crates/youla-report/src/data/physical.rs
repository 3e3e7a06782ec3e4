//! Parameters of a physical structure.

use serde::{Deserialize, Serialize};

/// A parameter or derived quantity of a physical structure, in report, summary and artefact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
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

/// Intervals, correlations and comparison of structures.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PhysicalEstimate {
    /// Probability with which an interval should hold the truth; absent where there are none.
    pub level: Option<f64>,
    /// Whether the intervals are valid, in one sentence.
    pub verdict: String,
    /// Names of the parameters that were estimated.
    pub names: Vec<String>,
    /// Their correlations, row by row; empty where they are not known.
    pub correlations: Vec<Vec<f64>>,
    /// The structures that were compared, the declared one first; empty where only that was estimated.
    pub structures: Vec<PhysicalStructure>,
}

/// One of several physical structures.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
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
