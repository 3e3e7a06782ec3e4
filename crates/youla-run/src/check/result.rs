//! What a check found.

use serde::{Deserialize, Serialize};
use youla_loop::check::{Finding, Severity};

/// A record that was checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CheckedRecord {
    /// Name in findings.
    pub record: String,
    /// Its file, as given.
    pub file: String,
    /// First and last row of the file, counted from 1, that the tests beside that of the clock looked at.
    pub rows: [usize; 2],
    /// Sample time, seconds.
    pub sample_time: f64,
}

/// What a check found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataCheck {
    /// What was checked.
    pub records: Vec<CheckedRecord>,
    /// Findings, the most serious first.
    pub findings: Vec<Finding>,
}

impl DataCheck {
    /// Number of findings of a severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|f| f.severity == severity).count()
    }

    /// Findings of the same test, severity and channel in several records as one: the first of them, with the number of further
    /// ones. In the order of the findings.
    pub fn grouped(&self) -> Vec<(&Finding, usize)> {
        let mut groups: Vec<(&Finding, usize)> = Vec::new();
        for finding in &self.findings {
            let same = |g: &&mut (&Finding, usize)| {
                let first = g.0;
                let one_record = first.record == finding.record;
                (first.test, first.severity, &first.channel) == (finding.test, finding.severity, &finding.channel)
                    && !one_record
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.1 += 1,
                None => groups.push((finding, 0)),
            }
        }
        groups
    }

    /// The findings that are more than notes, grouped, as plain text.
    pub fn sentences(&self) -> Vec<String> {
        let worth = self.grouped().into_iter().filter(|(f, _)| f.severity > Severity::Note);
        worth.map(|(f, more)| format!("data, {}{}", f.sentence(), further(more))).collect()
    }

    /// As `1-record/check.json` and summary.json hold it.
    pub fn entry(&self) -> DataCheckEntry {
        DataCheckEntry {
            records: self.records.clone(),
            findings: self.findings.clone(),
            defects: self.count(Severity::Defect),
            cautions: self.count(Severity::Caution),
            notes: self.count(Severity::Note),
        }
    }
}

/// The check of the data in `1-record/check.json` and summary.json.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct DataCheckEntry {
    /// What was checked.
    pub records: Vec<CheckedRecord>,
    /// Findings, the most serious first.
    pub findings: Vec<Finding>,
    /// Number of defects.
    pub defects: usize,
    /// Number of cautions.
    pub cautions: usize,
    /// Number of notes.
    pub notes: usize,
}

/// In how many more records a finding was made, in words.
pub fn further(records: usize) -> String {
    match records {
        0 => String::new(),
        1 => " The same in 1 more record.".into(),
        n => format!(" The same in {n} more records."),
    }
}
