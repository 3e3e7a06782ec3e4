//! The dialect of a text file.

use serde::{Deserialize, Serialize};

/// The separator of cells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Delimiter {
    /// From the first line: the only one of comma, semicolon and tab in it, else blanks. A line with two of them is an
    /// error.
    #[default]
    Detect,
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// One tab.
    Tab,
    /// Any number of blanks and tabs.
    Whitespace,
}

/// Whether the first line contains the names of the columns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeaderLine {
    /// Names if none of its cells is a number.
    #[default]
    Detect,
    /// Names.
    Present,
    /// Data: the columns are chosen by number and named `#1`, `#2` and so on.
    Absent,
}

/// The decimal sign of numbers; declared, never detected.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DecimalSign {
    /// `0.5`
    #[default]
    Point,
    /// `0,5`; the comma is then not a delimiter.
    Comma,
}

impl DecimalSign {
    /// Its name in settings.
    pub(super) fn key(self) -> &'static str {
        match self {
            DecimalSign::Point => "point",
            DecimalSign::Comma => "comma",
        }
    }

    pub(super) fn other(self) -> Self {
        match self {
            DecimalSign::Point => DecimalSign::Comma,
            DecimalSign::Comma => DecimalSign::Point,
        }
    }
}

/// How to read a text file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CsvOptions {
    /// The separator of cells.
    pub delimiter: Delimiter,
    /// Whether the first line contains names.
    pub header: HeaderLine,
    /// The decimal sign of all numbers, also of the time.
    pub decimal: DecimalSign,
    /// Lines that are passed over, counted from 1: notes above the names, a line of units below them. Lines that begin with `#` or `%`
    /// and blank lines always are.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub skip_lines: Vec<usize>,
}
