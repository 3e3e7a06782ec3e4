//! Options of single stages: factors, S, diagrams, verification, frequency responses.

use serde::{Deserialize, Serialize};
use youla::identify::innovation_form::{DeviationOptions, Structure};
use youla::identify::subspace::stabilisation::StabilisationOptions;
use youla_greybox::refine::RefineOptions;

/// How the factors of an arbitrary controller are built (`CoprimeFactors::stacked` or `shifted_to`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Construction {
    /// Right factors of plant and controller stacked, then inverted.
    #[default]
    Stacked,
    /// Observer-based factors of the plant, shifted by Q.
    Shifted,
}

/// Options of the coprime factors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FactorSettings {
    /// For controllers that are not given as observer gains.
    pub construction: Construction,
    /// Weight of the inputs against the outputs in the LQR that chooses F; both are measured in their rms on the
    /// estimation records.
    pub input_weight: f64,
    /// Covariance of the output noise against that of the inputs in the Kalman predictor that chooses L (shifted
    /// construction only), both in rms of the estimation records.
    pub output_noise: f64,
    /// Samples of alpha and beta dropped at the start of each record, where the signal filter starts from an unknown
    /// state; when absent, until its slowest transient has decayed to 1e-3.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle: Option<usize>,
}

impl Default for FactorSettings {
    fn default() -> Self {
        FactorSettings { construction: Construction::default(), input_weight: 1.0, output_noise: 1.0, settle: None }
    }
}

/// Options of the stabilisation diagrams.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StabilisationSettings {
    /// Largest order; when absent, twice the order of the model and at least 20, as far as the horizon allows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_order: Option<usize>,
    /// When poles of different orders count as the same.
    pub criteria: StabilisationOptions,
}

/// How a model predicts a verification record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Prediction {
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
    /// What drives the models.
    pub prediction: Prediction,
    /// Samples at the start of each record that do not count in the fit (transient of unknown initial states).
    pub skip: usize,
}

/// Options of the frequency responses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FrequencySettings {
    /// Samples per window of the non-parametric estimate (Welch, Hann).
    pub window: usize,
    /// Overlap of windows, as a part of a window.
    pub overlap: f64,
    /// Lowest frequency of the models' curves, Hz; a 300th of the Nyquist frequency when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_hz: Option<f64>,
    /// Number of frequencies of the models' curves, spaced logarithmically up to Nyquist.
    pub points: usize,
}

impl Default for FrequencySettings {
    fn default() -> Self {
        FrequencySettings { window: 4096, overlap: 0.5, from_hz: None, points: 400 }
    }
}

/// What is known of S before it is identified.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DeviationSettings {
    /// How the noise of beta is modelled.
    pub structure: Structure,
    /// Largest number of refits in the innovation form, at least 1.
    pub iterations: usize,
    /// Relative change of K_s below which it has settled.
    pub tolerance: f64,
    /// How S is refined by the prediction-error method afterwards; not at all when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refine: Option<RefineOptions>,
}

impl Default for DeviationSettings {
    fn default() -> Self {
        let DeviationOptions { structure, iterations, tolerance } = DeviationOptions::default();
        DeviationSettings { structure, iterations, tolerance, refine: None }
    }
}

impl DeviationSettings {
    /// The options of the identification of S.
    pub fn options(&self) -> DeviationOptions {
        DeviationOptions { structure: self.structure, iterations: self.iterations, tolerance: self.tolerance }
    }
}
