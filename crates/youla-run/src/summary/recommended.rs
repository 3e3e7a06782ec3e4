//! The recommended model in summary.json, in the run folder and in the report.

use crate::method::Method;
use crate::page::choices;
use crate::result::Identification;
use crate::stages::responses::bounds_db;
use crate::stages::validate::residue_at;
use crate::summary::entries::{ModeEntry, finite};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use youla::identify::likelihood::{Evidence, ModeEstimate, Predictor, Recommendation, ResponseError};
use youla::lti::{Continuous, FrequencyResponse, StateSpace};
use youla::{Mat, MatRef, c64};
use youla_io::SystemMatrices;
use youla_report::data as draw;

/// The model's JSON in the run folder.
pub(crate) const FILE: &str = "4-identify/recommended.json";

/// Level of the intervals and bands that are stated, and its quantile of the normal distribution.
const LEVEL: (f64, f64) = (0.95, 1.959_963_984_540_054);

/// 95 % quantile of chi-square with two degrees of freedom, for the region of a complex number.
const ELLIPSE: f64 = 5.991_464_547_107_979;

/// The recommended model in summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecommendedEntry {
    /// Key of the method; its fits, margins and residuals are under `methods`.
    pub method: String,
    /// Whether every figure of the evidence is within its limit.
    pub trusted: bool,
    /// Why the model is not trusted; empty where it is.
    pub reasons: Vec<String>,
    /// The model's JSON, relative to the run folder.
    pub file: String,
    /// Number of states without those of the dead time.
    pub order: usize,
    /// Dead time of each input, samples.
    pub dead_time: Vec<usize>,
    /// Modes with 95 % intervals.
    pub modes: Vec<ModeEntry>,
    /// Standard deviations of the frequency response.
    pub response_deviation: DeviationEntry,
    /// Questions to the records, each with its figure and limit.
    pub evidence: Vec<EvidenceFigure>,
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
        let deviation = &found.response_deviation;
        RecommendedEntry {
            method: Method::Likelihood.key().into(),
            trusted: found.trusted(),
            reasons: found.reasons(),
            file: FILE.into(),
            order: found.order,
            dead_time: found.dead_time.clone(),
            modes: shown_modes(found),
            response_deviation: DeviationEntry {
                hz: deviation.hz.clone(),
                absolute: deviation.absolute.iter().map(|at| rows(at.as_ref())).collect(),
            },
            evidence: found.evidence.iter().map(EvidenceFigure::from).collect(),
        }
    }
}

/// The modes that the response shows, with 95 % intervals.
pub fn shown_modes(found: &Recommendation) -> Vec<ModeEntry> {
    let visible = found.plant.visible_modes().ok();
    let shown = |m: &&ModeEstimate| visible.as_ref().is_none_or(|v| residue_at(v, m.mode.pole).is_some());
    found.modes.iter().filter(shown).map(mode).collect()
}

fn mode(m: &ModeEstimate) -> ModeEntry {
    let interval =
        |value: f64, deviation: f64| Some([value - LEVEL.1 * deviation, value + LEVEL.1 * deviation].map(finite));
    ModeEntry {
        hz_deviation: finite(m.hz_deviation),
        zeta_deviation: finite(m.zeta_deviation),
        hz_interval: interval(m.mode.hz, m.hz_deviation),
        zeta_interval: interval(m.mode.zeta, m.zeta_deviation),
        ..ModeEntry::from(&m.mode)
    }
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
        RecommendedDetails {
            order: found.order,
            dead_time: &found.dead_time,
            continuous: continuous(found).map(|system| SystemMatrices::new(&system)),
            predictor: PredictorEntry::from(&found.predictor),
            modes: shown_modes(found),
            candidates: &found.candidates,
            evidence: found.evidence.iter().map(EvidenceFigure::from).collect(),
        }
    }
}

/// Dead time is a state at z = 0, which has no logarithm.
fn continuous(found: &Recommendation) -> Option<StateSpace<Continuous>> {
    found.plant.inverse_zoh().ok()
}

/// The line on the recommended model, then one line for each question that its evidence fails.
pub(crate) fn verdict_lines(found: &Identification) -> Vec<draw::Verdict> {
    let line = |status, text: String| draw::Verdict { status, text, evidence: draw::ReportPart::Recommended };
    let model = match &found.recommended {
        Ok(model) => model,
        Err(reason) => {
            return vec![line(draw::Status::Bad, format!("No model is recommended: {reason}."))];
        }
    };
    let delays = &model.dead_time;
    let dead_time = match delays.iter().any(|d| *d > 0) {
        true if delays[..] == [1] => " and a dead time of 1 sample".to_owned(),
        true => format!(
            " and a dead time of {} samples",
            delays.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
        ),
        false => String::new(),
    };
    let what = format!("The recommended model has order {}{dead_time}", model.order);
    let (all, failed) = (model.evidence.len(), model.evidence.iter().filter(|e| !e.holds()).count());
    let mut lines = Vec::new();
    if model.trusted() {
        let text = format!("Trusted: all {all} tests of the recommended model are passed. {what}.");
        lines.push(line(draw::Status::Good, text));
    } else {
        lines.push(line(
            draw::Status::Bad,
            format!("Not trusted: {failed} of {all} tests of the recommended model failed. {what}."),
        ));
    }
    lines.extend(model.evidence.iter().filter(|e| !e.holds()).map(|e| line(draw::Status::Bad, sentence(e))));
    lines
}

fn sentence(e: &Evidence) -> String {
    format!("{}: {}, limit {}.", e.question, figure(e.figure), e.limit)
}

/// Three decimals, or a power of ten where these are too many digits.
fn figure(value: f64) -> String {
    match value {
        v if !v.is_finite() => "not finite".into(),
        v if v.abs() >= 1e5 => format!("{v:.1e}"),
        v => format!("{v:.3}"),
    }
}

/// Evidence and candidates as tables of the report.
pub(crate) fn tables(found: &Identification) -> Vec<draw::EvidenceTable> {
    let Ok(model) = &found.recommended else { return Vec::new() };
    let evidence = |e: &Evidence| {
        let held = if e.holds() { "yes" } else { "no" };
        vec![e.question.clone(), figure(e.figure), format!("{}", e.limit), held.to_owned()]
    };
    let least = model.candidates.iter().map(|c| c.criterion).fold(f64::INFINITY, f64::min);
    let mut candidates: Vec<_> = model.candidates.iter().collect();
    candidates.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
    candidates.truncate(MOST_CANDIDATES);
    let candidate = |c: &&youla::identify::likelihood::Candidate| {
        let delays: Vec<String> = c.dead_time.iter().map(usize::to_string).collect();
        vec![c.order.to_string(), delays.join(", "), format!("{:.1}", c.criterion - least), c.origin.clone()]
    };
    vec![
        draw::EvidenceTable {
            title: "Evidence on the recommended model".into(),
            text: "The model is trusted where it passes every test: each figure is at most its limit.".into(),
            columns: ["Test", "Figure", "Limit", "Passed"].map(String::from).to_vec(),
            rows: model.evidence.iter().map(evidence).collect(),
            caption: String::new(),
        },
        choices::table(found, model),
        draw::EvidenceTable {
            title: "Candidates".into(),
            text: "Order and dead time are those with the least criterion; dead times that the criterion does not separate are \
                   decided by the least gain near the Nyquist frequency."
                .into(),
            columns: ["Order", "Dead time, samples", "Criterion above the least", "Start"].map(String::from).to_vec(),
            rows: candidates.iter().map(candidate).collect(),
            caption: "Schwarz's criterion: -2 log likelihood + log(samples) per parameter. A difference of 10 is strong evidence."
                .into(),
        },
    ]
}

/// Rows of the table of candidates.
const MOST_CANDIDATES: usize = 12;

/// The 95 % region of the response from an input to an output, with the errors at its frequencies.
pub(crate) fn band(
    errors: &[ResponseError],
    response: &FrequencyResponse,
    (output, input): (usize, usize),
) -> draw::Band {
    let half = |g: &c64, error: &ResponseError| LEVEL.1 * error.of_magnitude(*g, (output, input));
    let bounds = response
        .entry(output, input)
        .into_iter()
        .zip(errors)
        .map(|(g, e)| [g.norm() - half(&g, e), g.norm() + half(&g, e)]);
    let (low_db, high_db) = bounds_db(bounds);
    draw::Band {
        method: Method::Likelihood.key().into(),
        output,
        input,
        level: LEVEL.0,
        low_db,
        high_db,
        region: errors.iter().flat_map(|e| e.covariance((output, input)).map(|v| ELLIPSE * v)).collect(),
    }
}
