//! A finding: test, severity, location, numbers, advice.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Severity, ascending.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// A property of the data, for information.
    Note,
    /// Identification is possible, with reduced accuracy or with options that suit the data.
    Caution,
    /// Identification would give wrong results.
    Defect,
}

impl Severity {
    /// The word in reports and JSON.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Note => "note",
            Severity::Caution => "caution",
            Severity::Defect => "defect",
        }
    }
}

/// Share of the input up to which a change of the controller explains the log; the default of `CheckOptions::controller_caution`.
const EXPLAINS: f64 = 0.01;

/// A test of the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Test {
    /// Time steps: irregular, missing, repeated, of another size than declared ([`super::timing()`]).
    Timing,
    /// Saturation at a limit ([`super::clipping()`]).
    Clipping,
    /// A constant stretch of a channel ([`super::stuck()`]).
    Stuck,
    /// Resolution of a channel ([`super::quantisation()`]).
    Quantisation,
    /// A slow trend not explained by the input ([`super::drift()`]).
    Drift,
    /// Single-sample outliers ([`super::outliers()`]).
    Outliers,
    /// Dead time, and channels shifted against each other ([`super::delay()`]).
    Delay,
    /// Rank, crest and band of the excitation ([`super::excitation()`]).
    Excitation,
    /// Signal-to-noise ratio of the outputs ([`super::noise()`]).
    Noise,
    /// Narrow lines in the outputs ([`youla::signal::spectral_lines`]).
    Lines,
    /// Whether the input depends on the output ([`super::feedback()`]).
    Feedback,
    /// Whether the declared controller reproduces the logged input ([`super::controller()`]).
    Controller,
}

impl Test {
    /// Key in JSON and in the documentation.
    pub fn key(self) -> &'static str {
        match self {
            Test::Timing => "timing",
            Test::Clipping => "clipping",
            Test::Stuck => "stuck",
            Test::Quantisation => "quantisation",
            Test::Drift => "drift",
            Test::Outliers => "outliers",
            Test::Delay => "delay",
            Test::Excitation => "excitation",
            Test::Noise => "noise",
            Test::Lines => "lines",
            Test::Feedback => "feedback",
            Test::Controller => "controller",
        }
    }
}

/// One result of a check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Finding {
    /// The test.
    pub test: Test,
    /// The severity.
    pub severity: Severity,
    /// Name of the record.
    pub record: String,
    /// The channel; absent for a finding on the whole record.
    pub channel: Option<String>,
    /// First and last row in the file, counted from 1; absent for a finding on the whole record.
    pub rows: Option<[usize; 2]>,
    /// The finding, one sentence without its full stop.
    pub what: String,
    /// Figures by name, documented for each test; only finite ones.
    pub numbers: BTreeMap<String, f64>,
    /// The remedy, one sentence without its full stop; may be empty.
    pub advice: String,
}

impl Finding {
    /// Whether it names a change of the stated controller, or of the roles, units and signs of its channels, that explains the log. A limit of
    /// the input and a drift of the outputs are no such change.
    pub fn shows_another_controller(&self) -> bool {
        let has = |key: &str| self.numbers.contains_key(key);
        let explains = self.numbers.get("residual_after").is_some_and(|left| *left <= EXPLAINS);
        self.test == Test::Controller && explains && !has("saturation") && !has("trend")
    }

    pub(super) fn new(test: Test, severity: Severity, record: &str, what: String) -> Self {
        let (record, advice) = (record.to_owned(), String::new());
        Finding { test, severity, record, channel: None, rows: None, what, numbers: BTreeMap::new(), advice }
    }

    pub(super) fn channel(mut self, name: &str) -> Self {
        self.channel = Some(name.to_owned());
        self
    }

    pub(super) fn rows(mut self, first: usize, last: usize) -> Self {
        self.rows = Some([first, last]);
        self
    }

    pub(super) fn number(mut self, name: &str, value: f64) -> Self {
        if value.is_finite() {
            self.numbers.insert(name.to_owned(), value);
        }
        self
    }

    pub(super) fn advice(mut self, advice: &str) -> Self {
        advice.clone_into(&mut self.advice);
        self
    }

    /// The finding as plain text: record, location, finding, remedy.
    pub fn sentence(&self) -> String {
        let rows = match self.rows {
            Some([first, last]) if first == last => format!(", row {first}"),
            Some([first, last]) => format!(", rows {first} to {last}"),
            None => String::new(),
        };
        let channel = self.channel.as_ref().map_or(String::new(), |name| format!(", {name}"));
        let advice = if self.advice.is_empty() { String::new() } else { format!(" {}.", self.advice) };
        format!("{}{channel}{rows}: {}.{advice}", self.record, self.what)
    }
}

/// Sorts by severity, descending, then by test; the order of the records is kept.
pub fn by_severity(findings: &mut [Finding]) {
    findings.sort_by(|a, b| b.severity.cmp(&a.severity).then(a.test.cmp(&b.test)));
}

/// A number with a few significant digits.
pub(super) fn few(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e5).contains(&size) {
        let decimals = (2 - size.max(1e-12).log10().floor() as i32).clamp(0, 6) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.2e}")
    }
}

/// A value with its unit.
pub(super) fn with_unit(value: f64, unit: &str) -> String {
    if unit.is_empty() { few(value) } else { format!("{} {unit}", few(value)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_a_sentence() {
        let finding = Finding::new(Test::Stuck, Severity::Defect, "log", "it is constant".into())
            .channel("y")
            .rows(3, 9)
            .number("samples", 7.0)
            .number("nothing", f64::NAN)
            .advice("Leave it out");
        assert_eq!(finding.sentence(), "log, y, rows 3 to 9: it is constant. Leave it out.");
        assert_eq!(finding.numbers.len(), 1);
        assert_eq!([few(0.0), few(1234.56), few(0.012345), few(2.5e-7)], ["0", "1235", "0.0123", "2.50e-7"]);
    }
}
