//! Frequency responses of models, their confidence regions, and the non-parametric response.

use serde::{Deserialize, Serialize};

use crate::numbers;

/// Frequency responses of all models on one grid, and the measured ones on theirs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DrawnResponses {
    /// Grid of the models, Hz, rising.
    #[serde(with = "numbers::seven_digits")]
    pub hz: Vec<f64>,
    /// One entry per method, output and input.
    pub models: Vec<ModelResponse>,
    /// Non-parametric responses where the external excitation is known, per output and input.
    pub indirect: Vec<Indirect>,
    /// The plant without a model, per output and input.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<LineLevels>,
    /// Bounds of magnitudes on the grid of the models.
    pub bands: Vec<DrawnBand>,
    /// Standard deviation of the recommended response by its causes, per output and input.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub deviations: Vec<DrawnDeviation>,
    /// Singular values of models with several inputs and outputs, on the grid of the models.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub singular: Vec<SingularValue>,
}

/// Standard deviation of the response of the recommended model from one input to one output, in per cent of its magnitude.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DrawnDeviation {
    /// Output, by its place.
    pub output: usize,
    /// Input, by its place.
    pub input: usize,
    /// Frequencies, Hz.
    #[serde(with = "numbers::seven_digits")]
    pub hz: Vec<f64>,
    /// In all.
    #[serde(with = "numbers::seven_digits")]
    pub total: Vec<f64>,
    /// By cause; the squares sum to that of `total`. Causes without a share are absent.
    pub parts: Vec<DeviationPart>,
    /// Largest deviation of a band of validity, per cent.
    pub limit: f64,
    /// Bands of validity, Hz; none where the model itself is in doubt.
    pub bands: Vec<[f64; 2]>,
}

/// The share of one cause in a [`DrawnDeviation`].
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DeviationPart {
    /// The cause.
    pub cause: String,
    /// Per cent of the magnitude.
    #[serde(with = "numbers::seven_digits")]
    pub percent: Vec<f64>,
}

/// Where the values of [`LineLevels`] come from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LevelBasis {
    /// The periods of a periodic excitation.
    #[default]
    Periods,
    /// Local polynomials over windows of neighbouring frequencies.
    Windows,
    /// A table that states them.
    Stated,
}

/// The plant without a model, with the levels of noise and distortion: standard deviations in dB.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LineLevels {
    /// Output, by its place.
    pub output: usize,
    /// Input, by its place.
    pub input: usize,
    /// Where the values come from.
    pub basis: LevelBasis,
    /// Samples of a period; of the longest record where the excitation is not periodic; 0 where the response was given.
    pub period: usize,
    /// Periods that were averaged, for each estimation record.
    pub periods: Vec<usize>,
    /// Frequencies, Hz.
    #[serde(with = "numbers::seven_digits")]
    pub hz: Vec<f64>,
    /// Magnitude of the response, dB.
    #[serde(with = "numbers::seven_digits")]
    pub response_db: Vec<f64>,
    /// By noise.
    #[serde(with = "numbers::seven_digits")]
    pub noise_db: Vec<f64>,
    /// By noise and distortion; empty with one realisation.
    #[serde(with = "numbers::seven_digits")]
    pub total_db: Vec<f64>,
    /// By distortion, NaN where the noise hides it; empty with one realisation.
    #[serde(with = "numbers::seven_digits")]
    pub distortion_db: Vec<f64>,
}

/// One singular value of the response of one model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SingularValue {
    /// Key of the method.
    pub method: String,
    /// Its place, 0 for the largest.
    pub place: usize,
    /// Its values, dB.
    #[serde(with = "numbers::seven_digits")]
    pub value_db: Vec<f64>,
}

/// Bounds of the response of one model from one input to one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawnBand {
    /// Key of the method.
    pub method: String,
    /// Output, by its place.
    pub output: usize,
    /// Input, by its place.
    pub input: usize,
    /// Probability with which the bounds should hold the truth, at each frequency.
    pub level: f64,
    /// Lower bound, dB; NaN where it is magnitude zero.
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
