//! What a check found.

use serde::{Deserialize, Serialize};
use youla_loop::check::{Finding, Severity, Test};

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

    /// Findings of the same test, severity, channel and cause in several records as one: the first of them, with the number of further
    /// records. In the order of the findings; two findings of one record are never one.
    pub(crate) fn grouped(&self) -> Vec<(&Finding, usize)> {
        let mut groups: Vec<Vec<&Finding>> = Vec::new();
        for finding in &self.findings {
            // The names of the numbers say what corrects the log.
            fn kind(f: &Finding) -> (Test, Severity, Option<&str>, Vec<&String>) {
                let causes = f.numbers.keys().filter(|_| f.test == Test::Controller && f.severity > Severity::Note);
                (f.test, f.severity, f.channel.as_deref(), causes.collect())
            }
            let joins = |group: &&mut Vec<&Finding>| {
                kind(group[0]) == kind(finding) && group.iter().all(|known| known.record != finding.record)
            };
            match groups.iter_mut().find(joins) {
                Some(group) => group.push(finding),
                None => groups.push(vec![finding]),
            }
        }
        groups.into_iter().map(|group| (group[0], group.len() - 1)).collect()
    }

    /// The findings of a severity, grouped, with what is to be said of those like them: at most `most`. Where there are more, those of
    /// one test are gathered.
    pub fn alike(&self, severity: Severity, most: usize) -> Vec<(&Finding, String)> {
        let of: Vec<(&Finding, usize)> = self.grouped().into_iter().filter(|(f, _)| f.severity == severity).collect();
        if of.len() <= most {
            return of.into_iter().map(|(f, more)| (f, further(more))).collect();
        }
        let mut gathered: Vec<(&Finding, usize)> = Vec::new();
        for (finding, more) in of {
            match gathered.iter_mut().find(|(first, _)| first.test == finding.test) {
                Some((_, count)) => *count += more + 1,
                None => gathered.push((finding, more)),
            }
        }
        let words = |count| match count {
            0 => String::new(),
            1 => " 1 more like it (--json lists all).".to_owned(),
            n => format!(" {n} more like it (--json lists all)."),
        };
        gathered.into_iter().take(most).map(|(f, count)| (f, words(count))).collect()
    }

    /// The finding on the declared controller in the record where it explains least; `None` where none was compared.
    pub fn controller(&self) -> Option<&Finding> {
        let compared =
            self.findings.iter().filter(|f| f.test == Test::Controller && f.numbers.contains_key("residual"));
        let residual = |f: &Finding| f.numbers.get("residual").copied().unwrap_or(0.0);
        compared.max_by(|a, b| residual(a).total_cmp(&residual(b)))
    }

    /// The findings that are more than notes, grouped, as plain text.
    pub(crate) fn sentences(&self) -> Vec<String> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Two notes of one test in each of two records: two groups of two records each.
    #[test]
    fn a_group_holds_one_finding_of_each_record() {
        let note = |record: &str, what: &str| Finding {
            test: Test::Excitation,
            severity: Severity::Note,
            record: record.into(),
            channel: Some("r".into()),
            rows: None,
            what: what.into(),
            numbers: BTreeMap::new(),
            advice: String::new(),
        };
        let findings = vec![note("a", "weak"), note("a", "empty"), note("b", "weak"), note("b", "empty")];
        let check = DataCheck { records: Vec::new(), findings };
        let groups: Vec<(&str, usize)> = check.grouped().iter().map(|(f, more)| (f.what.as_str(), *more)).collect();
        assert_eq!(groups, [("weak", 1), ("empty", 1)]);
    }

    /// 28 outputs with a note each, and the controller: two lines.
    #[test]
    fn many_notes_are_gathered() {
        let note = |test: Test, channel: &str, numbers: &[(&str, f64)]| Finding {
            test,
            severity: Severity::Note,
            record: "log".into(),
            channel: Some(channel.into()),
            rows: None,
            what: "it is so".into(),
            numbers: numbers.iter().map(|(key, value)| ((*key).to_owned(), *value)).collect::<BTreeMap<_, _>>(),
            advice: String::new(),
        };
        let mut findings: Vec<Finding> = (1..=28).map(|k| note(Test::Noise, &format!("y{k}"), &[])).collect();
        findings.push(note(Test::Controller, "u", &[("residual", 1e-6)]));
        let check = DataCheck { records: Vec::new(), findings };
        let alike = check.alike(Severity::Note, 10);
        assert_eq!(alike.len(), 2);
        assert_eq!(
            (alike[0].0.channel.as_deref(), alike[0].1.as_str()),
            (Some("y1"), " 27 more like it (--json lists all).")
        );
        assert_eq!(check.alike(Severity::Note, 40).len(), 29);
        assert_eq!(check.controller().map(|f| f.test), Some(Test::Controller));
    }
}
