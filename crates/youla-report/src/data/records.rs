//! Records and what models make of them: signals, predictions, residuals, fits.

use serde::{Deserialize, Serialize};

use crate::numbers;
use crate::trace::{Timeline, Trace};
use youla::signal::Channel;

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
pub struct DrawnExperiment {
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
    /// Its values over time.
    pub trace: Trace,
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
    /// Measured output.
    pub measured: Trace,
    /// Predictions of the models.
    pub predictions: Vec<DrawnPrediction>,
}

/// Prediction of one output by one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawnPrediction {
    /// Key of the method.
    pub method: String,
    /// Predicted output.
    pub predicted: Trace,
    /// Measured less predicted, reduced from all samples by itself.
    pub residual: Trace,
}

/// Tests of the residuals on the verification records.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Residuals {
    /// The prediction whose residuals are tested, in words.
    pub prediction: String,
    /// Whether all are correlated with excitations from outside of the loop, and not with the input.
    pub external: bool,
    /// Steps ahead of the fits.
    pub steps: Vec<usize>,
    /// One entry per method and record.
    pub tests: Vec<DrawnResidualTest>,
}

/// Residual tests of one model on one record.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DrawnResidualTest {
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
    /// The predictor of the residual of the simulation, in words.
    #[serde(default)]
    pub predictor: String,
}

/// A correlation over lags with the band of noise.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Correlation {
    /// Values; one that does not exist is not a number here and `null` in JSON.
    #[serde(deserialize_with = "numbers::many")]
    pub values: Vec<f64>,
    /// Band of a single value at 99 %.
    pub band: f64,
}

impl Correlation {
    /// Values to four decimal places, which is what a figure shows.
    pub fn new(values: &[f64], band: f64) -> Self {
        let round = |v: f64| (1e4 * v).round() / 1e4;
        Correlation { values: values.iter().map(|v| round(*v)).collect(), band: (1e5 * band).round() / 1e5 }
    }
}
