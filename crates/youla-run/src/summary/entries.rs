//! Small parts that several artefacts and summary.json share: models' poles and modes, intervals, reasons.
//!
//! A number that does not exist (NaN, infinite) is `null` in JSON, and `None` where it is read again.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use youla::c64;
use youla::identify::likelihood::Interval;
use youla::lti::Mode;
use youla::validate::BandCertificate;
use youla_greybox::ModeBand;

/// Real and imaginary part.
pub(crate) fn pair(pole: c64) -> [f64; 2] {
    [pole.re, pole.im]
}

/// Real and imaginary parts.
pub(crate) fn pairs(poles: &[c64]) -> Vec<[f64; 2]> {
    poles.iter().copied().map(pair).collect()
}

/// A number, `None` where it does not exist.
pub(crate) fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

/// Numbers, `None` where one does not exist.
pub(crate) fn finite_all(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().map(|x| finite(*x)).collect()
}

/// Fit (26) in percent, per verification record and output.
pub type Fits = BTreeMap<String, Vec<Option<f64>>>;

/// An oscillating mode, a pair of poles; deviations and intervals where they are known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModeEntry {
    /// Natural frequency, Hz.
    pub hz: Option<f64>,
    /// Damping ratio; negative where the mode is unstable.
    pub zeta: Option<f64>,
    /// Standard deviation of the frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hz_deviation: Option<f64>,
    /// Standard deviation of the damping ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zeta_deviation: Option<f64>,
    /// Interval of the frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hz_interval: Option<[Option<f64>; 2]>,
    /// Interval of the damping ratio.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zeta_interval: Option<[Option<f64>; 2]>,
    /// Residue, output by output the values of all inputs, `[re, im]`; empty where it is not known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub residue: Vec<[f64; 2]>,
}

impl From<&Mode> for ModeEntry {
    fn from(mode: &Mode) -> Self {
        ModeEntry {
            hz: finite(mode.hz),
            zeta: finite(mode.zeta),
            hz_deviation: None,
            zeta_deviation: None,
            hz_interval: None,
            zeta_interval: None,
            residue: Vec::new(),
        }
    }
}

impl From<&ModeBand> for ModeEntry {
    fn from(band: &ModeBand) -> Self {
        // `Some(NaN)` is written as null, so that the key is there.
        ModeEntry {
            hz_deviation: Some(band.hz_deviation),
            zeta_deviation: Some(band.zeta_deviation),
            hz_interval: Some(band.hz.map(finite)),
            zeta_interval: Some(band.zeta.map(finite)),
            ..ModeEntry::from(&band.mode)
        }
    }
}

/// A real pole: a time constant, an integrator or, beyond 1, a growth; deviation and interval where they are known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RealPoleEntry {
    /// The pole in z.
    pub z: f64,
    /// Corner frequency `|ln z| / (2 pi ts)`, Hz.
    pub hz: Option<f64>,
    /// Standard deviation of the frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hz_deviation: Option<f64>,
    /// Interval of the frequency, Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hz_interval: Option<[Option<f64>; 2]>,
    /// Residue, as of a mode.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub residue: Vec<[f64; 2]>,
}

/// Oscillating modes, and real poles apart from them: these have no damping ratio.
pub(crate) fn apart(all: impl Iterator<Item = (c64, ModeEntry)>) -> (Vec<ModeEntry>, Vec<RealPoleEntry>) {
    let (mut modes, mut real) = (Vec::new(), Vec::new());
    for (pole, mode) in all {
        if pole.im != 0.0 {
            modes.push(mode);
            continue;
        }
        let ModeEntry { hz, hz_deviation, hz_interval, residue, .. } = mode;
        real.push(RealPoleEntry { z: pole.re, hz, hz_deviation, hz_interval, residue });
    }
    (modes, real)
}

/// A figure with its interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct IntervalEntry {
    /// Of the estimate.
    pub value: Option<f64>,
    /// Standard deviation.
    pub deviation: Option<f64>,
    /// Bounds at the level of the uncertainty.
    pub bounds: [Option<f64>; 2],
}

impl From<&Interval> for IntervalEntry {
    fn from(interval: &Interval) -> Self {
        IntervalEntry {
            value: finite(interval.value),
            deviation: finite(interval.deviation),
            bounds: interval.bounds.map(finite),
        }
    }
}

/// A controller on the models within the confidence region of S.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BandEntry {
    /// Level of region and interval.
    pub level: f64,
    /// Models that were drawn but are impossible, and not tested.
    pub impossible: usize,
    /// Models that were tested.
    pub models: usize,
    /// Those of them within the region.
    pub within: usize,
    /// Models whose loop is unstable, anywhere.
    pub unstable: usize,
    /// Those of them within the region.
    pub unstable_within: usize,
    /// Largest magnitude of a closed-loop pole over the models within the region.
    pub worst_within: Option<f64>,
    /// Largest magnitude of a closed-loop pole of the estimate, with its interval.
    pub radius: IntervalEntry,
    /// Whether the controller stabilises every model within the region, and the estimate.
    pub holds: bool,
}

impl From<&BandCertificate> for BandEntry {
    fn from(band: &BandCertificate) -> Self {
        BandEntry {
            level: band.level,
            impossible: band.impossible,
            models: band.models,
            within: band.within,
            unstable: band.unstable,
            unstable_within: band.unstable_within,
            worst_within: finite(band.worst_within),
            radius: IntervalEntry::from(&band.radius),
            holds: band.holds(),
        }
    }
}

/// Why something that was asked for is not there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Refused {
    /// The reason.
    pub refused: String,
}

/// A value, or `{"refused": "<reason>"}`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum OrRefused<T> {
    /// The reason why there is none.
    Refused(Refused),
    /// The value.
    Value(T),
}

impl<T> OrRefused<T> {
    /// From a result.
    pub(crate) fn new<E: std::fmt::Display>(outcome: Result<T, E>) -> Self {
        match outcome {
            Ok(value) => OrRefused::Value(value),
            Err(reason) => OrRefused::Refused(Refused { refused: reason.to_string() }),
        }
    }

    /// The value.
    pub fn value(&self) -> Option<&T> {
        match self {
            OrRefused::Value(value) => Some(value),
            OrRefused::Refused(_) => None,
        }
    }
}
