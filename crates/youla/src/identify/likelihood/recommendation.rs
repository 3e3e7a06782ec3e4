//! The recommended model with what it rests on.

use crate::Mat;
use crate::identify::likelihood::deviation::mode_estimates::ModeEstimate;
use crate::identify::likelihood::deviation::region::Region;
use crate::identify::verdict::limits::{BEYOND_CHANCE, NEAR_THE_LIMIT};
use crate::identify::verdict::loop_ratio::LoopRatio;
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
    /// Tests, each with its figure and limit.
    pub evidence: Vec<Evidence>,
    /// What the region takes of the margin of the loop that ran; `None` for an open loop, and where the controller is not known.
    pub loop_ratio: Option<LoopRatio>,
    /// Bands in Hz in which the standard deviation of an entry is at most a tenth of it, output by output and input by input.
    pub entry_bands: Vec<Vec<Vec<[f64; 2]>>>,
    /// Bands in Hz in which this holds for every entry.
    pub bands: Vec<[f64; 2]>,
}

impl Recommendation {
    /// Whether every required test is passed.
    pub fn trusted(&self) -> bool {
        self.evidence.iter().all(Evidence::holds)
    }

    /// Whether the excitation contradicts it where it does not contradict another model of the same records as much.
    pub(super) fn is_contradicted_beside(&self, other: &Self) -> bool {
        let shown = |of: &Self| of.evidence.iter().find(|e| e.question.ends_with("(indirect response)"))?.significance;
        shown(self).is_some_and(|here| here > BEYOND_CHANCE && here > 2.0 * shown(other).unwrap_or(0.0))
    }

    /// How many required tests are not passed.
    pub(super) fn failures(&self) -> usize {
        self.evidence.iter().filter(|e| !e.holds()).count()
    }

    /// What the model is good for, in a sentence or two.
    pub fn sentence(&self) -> String {
        let failed = self.failures();
        let required = self.evidence.iter().filter(|e| e.required).count();
        let first = match (failed, &self.loop_ratio) {
            (0, Some(r)) => format!(
                "Trusted for this loop: the uncertainty of the model leaves {} of the margin at {} Hz",
                share(1.0 - r.largest),
                figure(r.largest_hz)
            ),
            (0, None) => "Trusted".to_owned(),
            (1, _) if self.description() == Some(false) => format!(
                "Not trusted for this loop: the stated controller disagrees with the log, the model passes its {} other tests",
                required - 1
            ),
            (n, _) => format!("Not trusted: the recommended model does not pass {n} of the {required} required tests"),
        };
        let bands: Vec<String> =
            self.bands.iter().map(|[low, high]| format!("{} to {} Hz", figure(*low), figure(*high))).collect();
        let entries = || self.entry_bands.iter().flatten();
        let own = entries().filter(|bands| !bands.is_empty()).count();
        match bands.len() {
            0 if own > 0 && (failed == 0 || !self.in_doubt()) => format!(
                "{first}. No band is valid to 10 % in all {} entries, {own} of them have bands of their own.",
                entries().count()
            ),
            0 => format!("{first}. No band is valid to 10 %."),
            _ if failed == 0 => format!("{first}. Valid to 10 % from {}.", bands.join(", ")),
            _ if self.in_doubt() => {
                format!("{first}. The failed tests are of the model itself: no band of frequencies is stated.")
            }
            _ => format!("{first}. Its response is within 10 % from {}.", bands.join(", ")),
        }
    }

    /// Whether the description of the loop agrees with the log, whatever the model is worth: the stated controller explains the logged inputs.
    /// `None` where no controller was stated or nothing could be asked.
    pub fn description(&self) -> Option<bool> {
        let asked = |e: &&Evidence| e.question.ends_with(OF_DESCRIPTION) && e.outcome != TestOutcome::NotTested;
        self.evidence.iter().filter(asked).map(Evidence::holds).reduce(|all, one| all && one)
    }

    /// Whether a failed test is about the model, so that its own region is no evidence; those of region and controller are about the loop.
    pub fn in_doubt(&self) -> bool {
        let of_loop = |e: &Evidence| OF_LOOP.iter().any(|name| e.question.ends_with(name));
        self.evidence.iter().any(|e| !e.holds() && !of_loop(e))
    }

    /// The required tests that are not passed.
    pub fn reasons(&self) -> Vec<String> {
        self.evidence.iter().filter(|e| !e.holds()).map(Evidence::to_string).collect()
    }
}

/// Names of the tests of what the region and the stated controller mean for the loop, at the ends of their questions.
const OF_LOOP: [&str; 2] = ["(region)", OF_DESCRIPTION];
/// Name of the tests of the description of the loop.
const OF_DESCRIPTION: &str = "(controller)";

/// A share in percent, never rounded up to all.
fn share(part: f64) -> String {
    if (0.995..1.0).contains(&part) { "more than 99 %".into() } else { format!("{:.0} %", 100.0 * part) }
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
    /// Schwarz's criterion, deviance plus log N per parameter: of candidates for as many samples the least is best.
    pub criterion: f64,
    /// Samples, or lines of a measured response, for which it was found: of a long record the first ones see a part.
    pub samples: usize,
    /// Steps of the search.
    pub steps: usize,
    /// Whether the feedback stabilises it, as far as one is known that explains the records; others come before it whatever its criterion.
    pub stabilised: bool,
}

/// What a test of the verdict says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum TestOutcome {
    /// The figure is within its limit, or chance explains it.
    Passed,
    /// It is not.
    Failed,
    /// The records cannot answer; `note` says why.
    NotTested,
}

/// A test of the verdict: figure and limit of a question to the records.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Evidence {
    /// What was asked, in plain English.
    pub question: String,
    /// What was found; NaN where it was not tested.
    pub figure: f64,
    /// The largest figure that is accepted.
    pub limit: f64,
    /// By how many standard deviations the records show it beyond chance; `None` where that is no question. A figure that chance
    /// explains is accepted whatever its size.
    pub significance: Option<f64>,
    /// Passed, failed or not tested.
    pub outcome: TestOutcome,
    /// Whether a model is trusted only where this test is passed; other tests name an imperfection with its size.
    pub required: bool,
    /// Where the figure was found, Hz.
    pub hz: Option<[f64; 2]>,
    /// What lies behind the figure, or why nothing was tested; empty where there is nothing to say.
    pub note: String,
}

/// Limits beyond which the size of a figure says nothing more.
const FAR: f64 = 1e3;

impl Evidence {
    /// A required test: a figure with the largest that is accepted.
    pub fn new(question: impl Into<String>, figure: f64, limit: f64) -> Self {
        let outcome = if figure <= limit { TestOutcome::Passed } else { TestOutcome::Failed };
        let (question, note) = (question.into(), String::new());
        Evidence { question, figure, limit, significance: None, outcome, required: true, hz: None, note }
    }

    /// A required test that the records cannot answer.
    pub(crate) fn untested(question: impl Into<String>, limit: f64, why: impl Into<String>) -> Self {
        let open = Evidence::new(question, f64::NAN, limit);
        Evidence { outcome: TestOutcome::NotTested, note: why.into(), ..open }
    }

    pub(crate) fn beyond_chance(self, significance: f64) -> Self {
        let passed = self.outcome == TestOutcome::Passed || significance <= BEYOND_CHANCE;
        let outcome = if passed { TestOutcome::Passed } else { TestOutcome::Failed };
        Evidence { significance: Some(significance), outcome, ..self }
    }

    /// Passed too where the figure, an estimate that is so many of its standard deviations from zero, exceeds its limit by hardly more than its
    /// deviation: the records do not show then that it is beyond it.
    pub(crate) fn unless_near_the_limit(self, significance: f64) -> Self {
        let over = significance * (1.0 - self.limit / self.figure);
        if self.outcome == TestOutcome::Passed || over > NEAR_THE_LIMIT {
            return self;
        }
        let note = format!("{}; above the limit by {} standard deviations, which is chance", self.note, figure(over));
        self.by_chance(note)
    }

    /// Passed, though the figure exceeds its limit: the note says why the records do not show it.
    pub(crate) fn by_chance(self, note: String) -> Self {
        Evidence { outcome: TestOutcome::Passed, note, ..self }
    }

    /// The size of an imperfection, which decides nothing by itself: its consequence is in the region of the model.
    #[must_use]
    pub(crate) fn reported(self) -> Self {
        Evidence { required: false, ..self }
    }

    /// Where the figure was found; no place where it is zero.
    #[must_use]
    pub(crate) fn at(self, hz: [f64; 2]) -> Self {
        Evidence { hz: (self.figure != 0.0).then_some(hz), ..self }
    }

    /// With its remedy, where it is not passed.
    #[must_use]
    pub(crate) fn remedy(self, remedy: &str) -> Self {
        if self.outcome == TestOutcome::Passed { self } else { self.noted(remedy) }
    }

    /// With a remark on the figure.
    #[must_use]
    pub fn noted(self, note: impl Into<String>) -> Self {
        Evidence { note: note.into(), ..self }
    }

    /// The figure as text: its distance from the limit where it rounds to the limit without being it, and no size beyond a thousand limits.
    pub fn value(&self) -> String {
        if self.limit > 0.0 && self.figure > FAR * self.limit {
            return format!("above {}", figure(FAR * self.limit));
        }
        let (rounded, over) = (figure(self.figure), self.figure - self.limit);
        let alike = over != 0.0 && rounded.parse() == Ok(self.limit);
        let sign = if over < 0.0 { "-" } else { "+" };
        if alike { format!("{} {sign} {:.1e}", self.limit, over.abs()) } else { rounded }
    }

    /// Whether the test is passed, or is not required.
    pub fn holds(&self) -> bool {
        !self.required || self.outcome == TestOutcome::Passed
    }
}

impl std::fmt::Display for Evidence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.outcome == TestOutcome::NotTested {
            return write!(f, "{}: not tested, {}", self.question, self.note);
        }
        write!(f, "{} {} (limit {})", self.question, self.value(), self.limit)?;
        if let Some([low, high]) = self.hz {
            match low == high {
                true => write!(f, " at {} Hz", figure(low))?,
                false => write!(f, " from {} to {} Hz", figure(low), figure(high))?,
            }
        }
        self.significance.map_or(Ok(()), |s| write!(f, ", {} standard deviations beyond chance", figure(s)))?;
        if self.note.is_empty() { Ok(()) } else { write!(f, "; {}", self.note) }
    }
}

/// Three significant digits; a power of ten from six digits on.
pub fn figure(value: f64) -> String {
    match value.abs() {
        v if !v.is_finite() => "not finite".into(),
        v if v < 1e5 && v.fract() == 0.0 => format!("{value:.0}"),
        v if v >= 1e5 || v > 0.0 && v < 1e-4 => format!("{value:.1e}"),
        v if v > 0.0 && v < 1e-2 => format!("{value:.5}"),
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        v if v >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.056 with a deviation of 0.009 is no proof of more than 0.05; 0.137 with 0.014 is one, and so is 0.056 with 0.001.
    #[test]
    fn a_size_fails_where_the_records_show_it_beyond_its_limit() {
        let of = |figure: f64, deviation: f64| {
            let significance = figure / deviation;
            let test = Evidence::new("size", figure, 0.05).beyond_chance(significance).noted("friction");
            test.unless_near_the_limit(significance)
        };
        assert!(of(0.056, 0.009).holds() && !of(0.137, 0.014).holds() && !of(0.056, 0.001).holds());
        assert_eq!(of(0.056, 0.009).note, "friction; above the limit by 0.667 standard deviations, which is chance");
        assert!(of(0.04, 0.001).holds() && of(0.04, 0.001).note == "friction");
    }
}
