//! Flags for the form of text files, as in `[data] csv` of run.toml.

use clap::Args as ClapArgs;
use youla_io::{CsvOptions, DecimalSign, Delimiter, HeaderLine};

/// How text files are written.
#[derive(Debug, ClapArgs)]
pub(crate) struct Dialect {
    /// Separator of the cells of text files: comma, semicolon, tab or whitespace; read from the first line where it is unambiguous.
    #[arg(long, value_name = "NAME", value_parser = delimiter)]
    delimiter: Option<Delimiter>,
    /// Decimal sign of text files: point (default) or comma. Never guessed.
    #[arg(long, value_name = "NAME", value_parser = decimal)]
    decimal: Option<DecimalSign>,
    /// Lines of text files that are passed over, counted from 1, separated by commas: notes, a line of units.
    #[arg(long, value_name = "LINES", value_delimiter = ',')]
    skip_lines: Vec<usize>,
}

impl Dialect {
    /// As options of the library.
    pub(crate) fn options(&self) -> CsvOptions {
        CsvOptions {
            delimiter: self.delimiter.unwrap_or_default(),
            header: HeaderLine::default(),
            decimal: self.decimal.unwrap_or_default(),
            skip_lines: self.skip_lines.clone(),
        }
    }

    /// Whether anything was given.
    pub(crate) fn is_given(&self) -> bool {
        self.delimiter.is_some() || self.decimal.is_some() || !self.skip_lines.is_empty()
    }
}

fn delimiter(name: &str) -> Result<Delimiter, String> {
    serde_json::from_value(name.into()).map_err(|e| e.to_string())
}

fn decimal(name: &str) -> Result<DecimalSign, String> {
    serde_json::from_value(name.into()).map_err(|e| e.to_string())
}
