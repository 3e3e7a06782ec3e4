//! What is said of a run: verdict, notes, findings of the check of the data, tables of evidence.

use serde::{Deserialize, Serialize};

/// A part of the report to which a line of the verdict leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReportPart {
    /// Evidence on the recommended model.
    Recommended,
    /// Table of fits.
    Fits,
    /// Records used for estimation.
    Data,
    /// Alpha and beta.
    Signals,
    /// Singular values.
    Order,
    /// Measured against predicted.
    Verification,
    /// Tests of the residuals.
    Residuals,
    /// Frequency responses.
    Frequency,
    /// Poles and modes.
    Poles,
    /// Hankel singular values.
    Reduction,
    /// Loop certificate.
    Certificate,
    /// New controller.
    Redesign,
    /// Margins of the loops.
    Margins,
}

/// Severity, ascending.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineStatus {
    /// In order.
    Good,
    /// For information.
    Info,
    /// A caution: look at it before the result is used.
    Caution,
    /// Evidence against the model, or a defect of the data.
    Bad,
}

/// One line of the answer to "can I trust it?".
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Severity.
    pub status: LineStatus,
    /// One sentence.
    pub text: String,
    /// Where the report shows it.
    pub evidence: ReportPart,
}

/// A remark on the data or the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Note {
    /// Severity of the remark.
    pub status: LineStatus,
    /// One sentence.
    pub text: String,
}

/// One finding of the check of the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataFinding {
    /// Severity; `Bad` where results would be wrong.
    pub status: LineStatus,
    /// Which test.
    pub test: String,
    /// Name of the record.
    pub record: String,
    /// Channel, where one is meant.
    pub channel: Option<String>,
    /// First and last row of the file, where a place is known.
    pub rows: Option<[usize; 2]>,
    /// What was found.
    pub what: String,
    /// What to do; may be empty.
    pub advice: String,
    /// Further records with the same finding.
    #[serde(default)]
    pub further: usize,
}

/// A table of evidence, in words.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct EvidenceTable {
    /// Title.
    pub title: String,
    /// What it says, in a sentence above it; may be empty.
    pub text: String,
    /// Heads of the columns; the first one names the rows.
    pub columns: Vec<String>,
    /// Rows of cells; a short row ends early.
    pub rows: Vec<Vec<String>>,
    /// Caption below it.
    pub caption: String,
}

impl EvidenceTable {
    /// A table without text and caption.
    pub fn new(title: &str, columns: &[&str], rows: Vec<Vec<String>>) -> Self {
        let columns = columns.iter().map(|name| (*name).to_owned()).collect();
        EvidenceTable { title: title.to_owned(), columns, rows, ..EvidenceTable::default() }
    }
}
