//! The recommended model in summary.json, in the run folder and in the report.

use crate::method::Method;
use crate::stages::validate::residue_at;
use crate::summary::entries::{ModeEntry, RealPoleEntry, apart, finite, pairs};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use youla::identify::likelihood::{Evidence, ModeEstimate, Predictor, Recommendation, RegionParts, TestOutcome};
use youla::lti::{Continuous, StateSpace};
use youla::{Mat, MatRef};
use youla_io::SystemMatrices;

/// The model's JSON in the run folder.
pub(crate) const FILE: &str = "4-identify/recommended.json";

/// Level of the intervals and bands that are stated, and its quantile of the normal distribution.
const LEVEL: (f64, f64) = (0.95, 1.959_963_984_540_054);

/// The recommended model in summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecommendedEntry {
    /// Key of the method; its fits, margins and residuals are under `methods`.
    pub method: String,
    /// Whether every figure of the evidence is within its limit.
    pub trusted: bool,
    /// Why the model is not trusted; empty where it is.
    pub reasons: Vec<String>,
    /// Whether the description of the loop agrees with the log, whatever the model is worth: the stated controller explains the logged inputs.
    /// Absent where none was stated or nothing could be asked.
    #[serde(default)]
    pub description: Option<bool>,
    /// The model's JSON, relative to the run folder.
    pub file: String,
    /// Number of states without those of the dead time.
    pub order: usize,
    /// Dead time of each input, samples.
    pub dead_time: Vec<usize>,
    /// Oscillating modes with 95 % intervals.
    pub modes: Vec<ModeEntry>,
    /// Real poles with 95 % intervals.
    pub real_poles: Vec<RealPoleEntry>,
    /// Standard deviations of the frequency response.
    pub response_deviation: DeviationEntry,
    /// Bands in Hz in which the standard deviation of every entry is at most a tenth of it.
    pub bands: Vec<[f64; 2]>,
    /// The same for each entry, `[output][input]`.
    pub entry_bands: Vec<Vec<Vec<[f64; 2]>>>,
    /// The part of the margin of the loop that the 95 % region takes; absent for an open loop.
    pub loop_ratio: Option<f64>,
    /// Where it does so, Hz.
    pub loop_ratio_hz: Option<f64>,
    /// What causes the deviations of the response.
    pub parts: PartsEntry,
    /// The tests of the verdict.
    pub tests: Vec<TestEntry>,
    /// The figures of the tests with their limits.
    pub evidence: Vec<EvidenceFigure>,
}

/// Standard deviations of the frequency response by their causes, `[frequency][output][input]`, physical units; the squares sum to those of
/// `response_deviation`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PartsEntry {
    /// Noise of the records.
    pub noise: Vec<Vec<Vec<Option<f64>>>>,
    /// Models of other structure that the records do not tell from this one.
    pub choice: Vec<Vec<Vec<Option<f64>>>>,
    /// Differences between records and parts of records beyond their noise.
    pub variation: Vec<Vec<Vec<Option<f64>>>>,
    /// What the excitation causes and the model does not explain.
    pub distortion: Vec<Vec<Vec<Option<f64>>>>,
}

impl From<&RegionParts> for PartsEntry {
    fn from(parts: &RegionParts) -> Self {
        let all = |part: &[Mat<f64>]| part.iter().map(|at| rows(at.as_ref())).collect();
        PartsEntry {
            noise: all(&parts.noise),
            choice: all(&parts.choice),
            variation: all(&parts.variation),
            distortion: all(&parts.distortion),
        }
    }
}

/// A test of the verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TestEntry {
    /// What was asked.
    pub question: String,
    /// `passed`, `failed` or `not-tested`.
    pub outcome: String,
    /// Whether the model is trusted only where the test is passed.
    pub required: bool,
    /// What was found.
    pub figure: Option<f64>,
    /// The largest figure that is accepted.
    pub limit: f64,
    /// By how many standard deviations the records show it beyond chance.
    pub deviations: Option<f64>,
    /// Where it was found, Hz.
    pub hz: Option<[f64; 2]>,
    /// What lies behind the figure, or why nothing was tested.
    pub note: String,
}

impl From<&Evidence> for TestEntry {
    fn from(e: &Evidence) -> Self {
        let outcome = match e.outcome {
            TestOutcome::Passed => "passed",
            TestOutcome::Failed => "failed",
            TestOutcome::NotTested => "not-tested",
        };
        TestEntry {
            question: e.question.clone(),
            outcome: outcome.into(),
            required: e.required,
            figure: finite(e.figure),
            limit: e.limit,
            deviations: e.significance.and_then(finite),
            hz: e.hz,
            note: e.note.clone(),
        }
    }
}

/// Standard deviations of the frequency response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeviationEntry {
    /// Frequencies, Hz.
    pub hz: Vec<f64>,
    /// Root mean square of the complex error, `[frequency][output][input]`, physical units.
    pub absolute: Vec<Vec<Vec<Option<f64>>>>,
}

/// A question to the records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EvidenceFigure {
    /// What was asked.
    pub question: String,
    /// What was found.
    pub figure: Option<f64>,
    /// The largest figure that is accepted.
    pub limit: f64,
    /// Whether the figure is within the limit.
    pub holds: bool,
}

impl From<&Evidence> for EvidenceFigure {
    fn from(e: &Evidence) -> Self {
        EvidenceFigure { question: e.question.clone(), figure: finite(e.figure), limit: e.limit, holds: e.holds() }
    }
}

impl From<&Recommendation> for RecommendedEntry {
    fn from(found: &Recommendation) -> Self {
        let deviation = &found.region;
        let (modes, real_poles) = shown(found);
        RecommendedEntry {
            method: Method::Likelihood.key().into(),
            trusted: found.trusted(),
            reasons: found.reasons(),
            description: found.description(),
            file: FILE.into(),
            order: found.order,
            dead_time: found.dead_time.clone(),
            modes,
            real_poles,
            response_deviation: DeviationEntry {
                hz: deviation.hz.clone(),
                absolute: deviation.absolute.iter().map(|at| rows(at.as_ref())).collect(),
            },
            bands: found.bands.clone(),
            entry_bands: found.entry_bands.clone(),
            loop_ratio: found.loop_ratio.as_ref().and_then(|r| finite(r.largest)),
            loop_ratio_hz: found.loop_ratio.as_ref().map(|r| r.largest_hz),
            parts: PartsEntry::from(&deviation.parts),
            tests: found.evidence.iter().map(TestEntry::from).collect(),
            evidence: found.evidence.iter().map(EvidenceFigure::from).collect(),
        }
    }
}

/// The oscillating modes that the response shows, with 95 % intervals.
pub fn shown_modes(found: &Recommendation) -> Vec<ModeEntry> {
    shown(found).0
}

/// The modes and real poles that the response shows, with 95 % intervals.
pub(crate) fn shown(found: &Recommendation) -> (Vec<ModeEntry>, Vec<RealPoleEntry>) {
    let visible = found.plant.visible_modes().ok();
    let mode = |m: &ModeEstimate| {
        let residue = match &visible {
            None => Vec::new(),
            Some(visible) => pairs(residue_at(visible, m.mode.pole)?),
        };
        let interval =
            |value: f64, deviation: f64| Some([value - LEVEL.1 * deviation, value + LEVEL.1 * deviation].map(finite));
        let entry = ModeEntry {
            hz_deviation: finite(m.hz_deviation),
            zeta_deviation: finite(m.zeta_deviation),
            hz_interval: interval(m.mode.hz, m.hz_deviation),
            zeta_interval: interval(m.mode.zeta, m.zeta_deviation),
            residue,
            ..ModeEntry::from(&m.mode)
        };
        Some((m.mode.pole, entry))
    };
    apart(found.modes.iter().filter_map(mode))
}

fn rows(m: MatRef<'_, f64>) -> Vec<Vec<Option<f64>>> {
    (0..m.nrows()).map(|i| (0..m.ncols()).map(|j| finite(m[(i, j)])).collect()).collect()
}

/// `details` of the model's file: the same model in continuous time, as a predictor, and what was tried.
#[derive(Serialize)]
pub(crate) struct RecommendedDetails<'a> {
    order: usize,
    dead_time: &'a [usize],
    /// In continuous time with the input held between samples; absent where the model has no logarithm.
    #[serde(skip_serializing_if = "Option::is_none")]
    continuous: Option<SystemMatrices>,
    predictor: PredictorEntry,
    modes: Vec<ModeEntry>,
    real_poles: Vec<RealPoleEntry>,
    candidates: &'a [youla::identify::likelihood::Candidate],
    evidence: Vec<EvidenceFigure>,
}

/// `x+ = A x + B u + K e`, `y = C x + D u + e`, e white with the stated covariance.
#[derive(Serialize)]
struct PredictorEntry {
    a: Vec<Vec<Option<f64>>>,
    b: Vec<Vec<Option<f64>>>,
    c: Vec<Vec<Option<f64>>>,
    d: Vec<Vec<Option<f64>>>,
    /// `null` where no predictor exists.
    k: Option<Vec<Vec<Option<f64>>>>,
    covariance: Vec<Vec<Option<f64>>>,
}

impl From<&Predictor> for PredictorEntry {
    fn from(p: &Predictor) -> Self {
        let all = |m: &Mat<f64>| rows(m.as_ref());
        PredictorEntry {
            a: all(&p.a),
            b: all(&p.b),
            c: all(&p.c),
            d: all(&p.d),
            k: p.k.as_ref().map(all),
            covariance: all(&p.covariance),
        }
    }
}

impl<'a> RecommendedDetails<'a> {
    pub(crate) fn new(found: &'a Recommendation) -> Self {
        let (modes, real_poles) = shown(found);
        RecommendedDetails {
            order: found.order,
            dead_time: &found.dead_time,
            continuous: continuous(found).map(|system| SystemMatrices::new(&system)),
            predictor: PredictorEntry::from(&found.predictor),
            modes,
            real_poles,
            candidates: &found.candidates,
            evidence: found.evidence.iter().map(EvidenceFigure::from).collect(),
        }
    }
}

/// Dead time is a state at z = 0, which has no logarithm.
fn continuous(found: &Recommendation) -> Option<StateSpace<Continuous>> {
    found.plant.inverse_zoh().ok()
}
