//! The recommended model with what it rests on.

use crate::Mat;
use crate::identify::likelihood::deviation::mode_estimates::ModeEstimate;
use crate::identify::likelihood::deviation::region::Region;
use crate::lti::{Discrete, StateSpace};

/// The model that the records support, with its evidence.
#[derive(Debug, Clone)]
pub struct Recommendation {
    /// From u to y in physical units, dead time as states with poles at zero.
    pub plant: StateSpace<Discrete>,
    /// Dead time of each input in samples.
    pub dead_time: Vec<usize>,
    /// States without those of the dead time.
    pub order: usize,
    /// The plants that the records do not tell from this one.
    pub region: Region,
    /// Real poles and pairs with their standard deviations, by natural frequency.
    pub modes: Vec<ModeEstimate>,
    /// Plant and noise as one innovation form.
    pub predictor: Predictor,
    /// What was tried, in the order in which it was.
    pub candidates: Vec<Candidate>,
    /// Questions to the records, each with its figure and limit.
    pub evidence: Vec<Evidence>,
}

impl Recommendation {
    /// Whether every figure is within its limit.
    pub fn trusted(&self) -> bool {
        self.evidence.iter().all(Evidence::holds)
    }

    /// The questions whose figures are beyond their limits.
    pub fn reasons(&self) -> Vec<String> {
        self.evidence.iter().filter(|e| !e.holds()).map(Evidence::to_string).collect()
    }
}

/// `x+ = A x + B u + K e`, `y = C x + D u + e`, physical units; the states of the plant come first.
#[derive(Debug, Clone)]
pub struct Predictor {
    /// A of plant and noise.
    pub a: Mat<f64>,
    /// B, zero for the states of the noise.
    pub b: Mat<f64>,
    /// C of plant and noise.
    pub c: Mat<f64>,
    /// D.
    pub d: Mat<f64>,
    /// K; `None` where no predictor exists, for example with an unstable pole that the outputs hardly see.
    pub k: Option<Mat<f64>>,
    /// Covariance of e, p x p.
    pub covariance: Mat<f64>,
}

/// A model that was tried.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Candidate {
    /// Where its start came from.
    pub origin: String,
    /// Dead time of each input in samples.
    pub dead_time: Vec<usize>,
    /// States without those of the dead time.
    pub order: usize,
    /// -2 log likelihood up to a constant.
    pub deviance: f64,
    /// Schwarz's criterion, deviance plus log N per parameter: the least is best.
    pub criterion: f64,
    /// Steps of the search.
    pub steps: usize,
}

/// Figure and limit of a question to the records.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Evidence {
    /// What was asked, in plain English.
    pub question: String,
    /// What was found.
    pub figure: f64,
    /// The largest figure that is accepted.
    pub limit: f64,
    /// By how many standard deviations the records show it beyond chance; `None` where that is no question. A figure that chance
    /// explains is accepted whatever its size.
    pub significance: Option<f64>,
}

/// Standard deviations beyond chance up to which a figure is accepted whatever its size: of the 10^4 figures of many runs none
/// exceeds it by chance.
const BEYOND_CHANCE: f64 = 5.0;

impl Evidence {
    /// A figure with the largest that is accepted.
    pub fn new(question: impl Into<String>, figure: f64, limit: f64) -> Self {
        Evidence { question: question.into(), figure, limit, significance: None }
    }

    pub(crate) fn beyond_chance(self, significance: f64) -> Self {
        Evidence { significance: Some(significance), ..self }
    }

    /// Whether the figure is within its limit, or explained by chance.
    pub fn holds(&self) -> bool {
        self.figure <= self.limit || self.significance.is_some_and(|s| s <= BEYOND_CHANCE)
    }
}

impl std::fmt::Display for Evidence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:.3} (limit {})", self.question, self.figure, self.limit)?;
        self.significance.map_or(Ok(()), |s| write!(f, ", {s:.1} standard deviations beyond chance"))
    }
}
