//! Text files: comma, semicolon, tab or blank separated, plain or gzip, with or without a line of names.
//!
//! Lines that begin with `#` or `%` and blank lines are skipped. Only the chosen columns are read as numbers; a cell
//! of them that is not a finite number is an error with its line and column. The decimal sign is the point unless a comma is
//! declared; numbers written with the other sign are refused with their line.

mod lines;
mod options;
mod parse;
mod plan;
mod read;
mod write;

pub use options::{CsvOptions, DecimalSign, Delimiter, HeaderLine};
pub use read::{StampedColumn, csv_from_bytes, read_csv, read_stamped_csv};
pub(crate) use read::{leading_clock, read_csv_parts, read_each, require_seconds};
pub(crate) use write::csv_to_bytes;
pub use write::write_csv;

#[cfg(test)]
mod tests;
