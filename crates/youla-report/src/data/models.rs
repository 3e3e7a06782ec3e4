//! Orders, poles, modes and the reduction of models.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::numbers;

/// Singular values from which an order was chosen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderChoice {
    /// Key of the method.
    pub method: String,
    /// What was identified, for example "S from alpha to beta".
    pub label: String,
    /// Singular values, falling.
    #[serde(deserialize_with = "numbers::many")]
    pub values: Vec<f64>,
    /// The order that was taken.
    pub chosen: usize,
}

/// Poles and zeros of one model, in z or, without a sample time, in rad/s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Poles {
    /// Key of the method.
    pub method: String,
    /// Real and imaginary parts.
    #[serde(deserialize_with = "numbers::pairs")]
    pub poles: Vec<[f64; 2]>,
    /// Those of the finite invariant zeros, where the model has as many inputs as outputs.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "numbers::pairs")]
    pub zeros: Vec<[f64; 2]>,
}

/// A mode of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DrawnMode {
    /// Key of the method.
    pub method: String,
    /// Natural frequency, Hz.
    #[serde(deserialize_with = "numbers::one")]
    pub hz: f64,
    /// Damping ratio; negative where the mode is unstable.
    #[serde(deserialize_with = "numbers::one")]
    pub zeta: f64,
    /// Standard deviations of both, where they are known.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "numbers::optional_pair")]
    pub deviation: Option<[f64; 2]>,
    /// Residue, output by output the values of all inputs, real and imaginary parts; empty where it is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "numbers::pairs")]
    pub residue: Vec<[f64; 2]>,
}

/// Poles of one model that are left out of its modes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct UnlistedModes {
    /// Key of the method.
    pub method: String,
    /// Modes that zeros of the model cancel.
    pub cancelled: usize,
    /// Modes at or above the Nyquist frequency.
    pub above_nyquist: usize,
}

/// Hankel singular values of a model that was reduced, and the error at each order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DrawnReduction {
    /// What was reduced and how, for example "G(S) by balanced truncation".
    pub label: String,
    /// Hankel singular values, falling.
    #[serde(deserialize_with = "numbers::many")]
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
    /// Error at each order; empty where that was not computed.
    #[serde(default)]
    pub orders: Vec<ReductionOrder>,
    /// The outcome, in a sentence.
    #[serde(default)]
    pub sentence: String,
}

/// One order of a reduction.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReductionOrder {
    /// States of the reduced model, those with the kept poles included.
    pub order: usize,
    /// Bound of the error: in the H-infinity norm, for normalised coprime factors in the gap metric; absent where there is none.
    pub error_bound: Option<f64>,
    /// Largest singular value of the error over frequency, in output units per input unit.
    pub open_loop_error: Option<f64>,
    /// The same over that of the full model.
    pub open_loop_relative: Option<f64>,
    /// Relative error of the closed loop from alpha to y.
    pub closed_loop_relative: Option<f64>,
    /// Whether the controller stabilises the reduced model.
    pub stabilised_by_controller: bool,
    /// Closed-loop pole nearest to or farthest beyond the boundary of stability.
    pub worst_closed_loop_pole: Option<[f64; 2]>,
    /// Why there is no model of this order.
    pub failure: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pole at z = 0 has no finite frequency: a report with it is read again.
    #[test]
    fn numbers_that_do_not_exist_are_read_again() {
        let mode = DrawnMode {
            method: "hansen".into(),
            hz: f64::INFINITY,
            zeta: 1.0,
            deviation: Some([f64::NAN, 0.1]),
            residue: Vec::new(),
        };
        let poles = Poles { method: "hansen".into(), poles: vec![[0.0, f64::NAN]], zeros: vec![[f64::INFINITY, 0.0]] };
        let again: DrawnMode = serde_json::from_str(&serde_json::to_string(&mode).unwrap()).unwrap();
        assert!(again.hz.is_nan() && again.zeta == 1.0 && again.deviation.unwrap()[1] == 0.1);
        let again: Poles = serde_json::from_str(&serde_json::to_string(&poles).unwrap()).unwrap();
        assert!(again.poles[0][1].is_nan() && again.zeros[0][0].is_nan());
    }
}
