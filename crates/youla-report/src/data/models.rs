//! Orders, poles, modes and the reduction of models.

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
    #[serde(with = "numbers")]
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
    #[serde(with = "numbers::pairs")]
    pub poles: Vec<[f64; 2]>,
    /// Those of the finite invariant zeros, where the model has as many inputs as outputs.
    #[serde(default, skip_serializing_if = "Vec::is_empty", with = "numbers::pairs")]
    pub zeros: Vec<[f64; 2]>,
}

/// A mode of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// Key of the method.
    pub method: String,
    /// Natural frequency, Hz.
    #[serde(with = "numbers::one")]
    pub hz: f64,
    /// Damping ratio; negative where the mode is unstable.
    #[serde(with = "numbers::one")]
    pub zeta: f64,
    /// Standard deviations of both, where they are known.
    #[serde(default, skip_serializing_if = "Option::is_none", with = "numbers::optional_pair")]
    pub deviation: Option<[f64; 2]>,
    /// Residue, output by output the values of all inputs, real and imaginary parts; empty where it is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty", with = "numbers::pairs")]
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
    /// Error at each order; empty where that was not computed.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A pole at z = 0 has no finite frequency: a report with it is read again.
    #[test]
    fn numbers_that_do_not_exist_are_read_again() {
        let mode = Mode {
            method: "hansen".into(),
            hz: f64::INFINITY,
            zeta: 1.0,
            deviation: Some([f64::NAN, 0.1]),
            residue: Vec::new(),
        };
        let poles = Poles { method: "hansen".into(), poles: vec![[0.0, f64::NAN]], zeros: vec![[f64::INFINITY, 0.0]] };
        let again: Mode = serde_json::from_str(&serde_json::to_string(&mode).unwrap()).unwrap();
        assert!(again.hz.is_nan() && again.zeta == 1.0 && again.deviation.unwrap()[1] == 0.1);
        let again: Poles = serde_json::from_str(&serde_json::to_string(&poles).unwrap()).unwrap();
        assert!(again.poles[0][1].is_nan() && again.zeros[0][0].is_nan());
    }
}
