//! Options of single stages: factors, S, verification, frequency responses.

use serde::{Deserialize, Serialize};

/// Options of the coprime factors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FactorSettings {
    /// Weight of the inputs against the outputs in the LQR that chooses F for a controller without observer gains; both are measured
    /// in their rms on the estimation records. A larger weight gives a slower F.
    pub input_weight: f64,
    /// Samples of alpha and beta dropped at the start of each record, where the signal filter starts from an unknown
    /// state; when absent, until its slowest transient has decayed to 1e-3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle: Option<usize>,
}

impl Default for FactorSettings {
    fn default() -> Self {
        FactorSettings { input_weight: 1.0, settle: None }
    }
}

/// How a model predicts a verification record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PredictionKind {
    /// The model under the actual controller, driven by the known excitations alone. The only fair test for unstable or
    /// integrating plants.
    ClosedLoop,
    /// The model driven by the measured u, initial state estimated.
    #[default]
    OpenLoop,
}

/// Options of the verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VerificationSettings {
    /// What drives the models. When absent, `"closed-loop"` where an excitation is known and the nominal model is unstable or
    /// integrates, as its simulation from u would leave all bounds; `"open-loop"` otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prediction: Option<PredictionKind>,
    /// Samples at the start of each record that do not count in the fit (transient of unknown initial states).
    pub skip: usize,
}

/// Options of the frequency responses.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FrequencySettings {
    /// Samples per window of the non-parametric estimate (Welch, Hann, half overlapping); when absent 4096, or a fourth of the shortest
    /// record where that is less.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<usize>,
    /// Lowest frequency of the models' curves, Hz; when absent a 300th of the Nyquist frequency, or less where the recommended model is
    /// valid below it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_hz: Option<f64>,
}
