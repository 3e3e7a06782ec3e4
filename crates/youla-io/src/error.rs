//! The errors of reading and writing files.

use std::path::PathBuf;
use youla::error::{Seconds, short};

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of reading or writing a file, with its evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The method rejected its input, or a computation failed.
    #[error(transparent)]
    Method(#[from] youla::Error),
    /// A part of a larger task failed.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `[controller]`.
        part: String,
        /// What failed.
        source: Box<Error>,
    },
    /// A settings file cannot be used.
    #[error("{}{}: {problem}", path.display(), position(*at))]
    Settings {
        /// The settings file.
        path: PathBuf,
        /// Position in the text; `None` for the file as a whole.
        at: Option<TextPosition>,
        /// What is wrong, and the nearest known key for a misspelt one.
        problem: String,
    },
    /// The output folder exists and is not empty.
    #[error("{} exists already and is not empty; choose another output folder or remove it", path.display())]
    OutputExists {
        /// The folder.
        path: PathBuf,
    },
    /// Another run writes the same folder.
    #[error("{} is being written by another run, in {}; wait for it or choose another --out, and remove that folder if no run is left", path.display(), partial.display())]
    BeingWritten {
        /// The folder.
        path: PathBuf,
        /// Where the other run writes.
        partial: PathBuf,
    },
    /// The output folder is not a run that may be replaced.
    #[error("{} is not replaced: {problem}; choose another place, or move what is there", path.display())]
    NotReplaced {
        /// The folder.
        path: PathBuf,
        /// Why it is not, with the file.
        problem: String,
    },
    /// Results cannot be written to the place that was chosen.
    #[error("{}: results cannot be written there ({source}); choose another place by --out", path.display())]
    Unwritable {
        /// The folder or file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The output file exists.
    #[error("{} exists already; choose another file, or replace it with --force", path.display())]
    FileExists {
        /// The file.
        path: PathBuf,
    },
    /// A result cannot be written as JSON.
    #[error("the result cannot be written as JSON: {source}")]
    Json {
        /// The reason.
        source: serde_json::Error,
    },
    /// A file or folder contains no model that can be read or exported.
    #[error("{}: {problem}", path.display())]
    NotAModel {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// A table holds no frequency response.
    #[error("{}: {problem}", path.display())]
    NotAResponse {
        /// The file.
        path: PathBuf,
        /// What is missing.
        problem: String,
    },
    /// The operating system failed to read or write a file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file does not exist.
    #[error("{}: no such file", path.display())]
    MissingFile {
        /// The file.
        path: PathBuf,
    },
    /// A file contains no samples.
    #[error("{}: {problem}", path.display())]
    NoData {
        /// The file.
        path: PathBuf,
        /// What is missing, for example "the file is empty (0 bytes)".
        problem: &'static str,
    },
    /// A cell of a text file is not a finite number.
    #[error("{}, line {line}, column {}: {text:?} is not a finite number{}", path.display(), short(column), cell_remedy(text, *decimal))]
    Cell {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Name of the column, or `#` and its number.
        column: String,
        /// Content of the cell, at most 40 characters.
        text: String,
        /// The decimal sign, `point` or `comma`, with which the cell is a number although the other sign is declared.
        decimal: Option<&'static str>,
    },
    /// A line of a text file has more or fewer fields than the first one.
    #[error("{}, line {line}: {found} fields, but the first line has {expected}; {}", path.display(), lines_to_skip(*line))]
    FieldCount {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Fields on this line.
        found: usize,
        /// Fields on the first line.
        expected: usize,
    },
    /// The delimiter of a text file is ambiguous.
    #[error("{}: the delimiter is ambiguous: {problem}", path.display())]
    Delimiter {
        /// The file.
        path: PathBuf,
        /// The conflict, with the line where there is one, and the setting that resolves it.
        problem: String,
    },
    /// A file is damaged, truncated or not of the format that its first bytes state.
    #[error("{}, {at}: expected {expected}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Where the damage was found.
        at: CorruptAt,
        /// What an undamaged file has there.
        expected: String,
    },
    /// A file has a format that is not supported, or whose feature is off.
    #[error("{}: {found} cannot be read; {remedy}", path.display())]
    FormatNotRead {
        /// The file.
        path: PathBuf,
        /// The format that was found.
        found: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// The channels of one record have different lengths.
    #[error("{what}: channel {:?} has {found} samples, the channels before it have {expected}", short(channel))]
    UnequalLength {
        /// The record or file.
        what: String,
        /// The channel.
        channel: String,
        /// Its samples.
        found: usize,
        /// Samples of the other channels.
        expected: usize,
    },
    /// A variable of a file has the wrong type or size, or cannot be written.
    #[error("{}: {} is {}, but must be {must}", path.display(), short(name), short(found))]
    WrongVariable {
        /// The file.
        path: PathBuf,
        /// The variable as it was requested.
        name: String,
        /// What it is.
        found: String,
        /// What it must be.
        must: &'static str,
    },
    /// The steps of the time column are not uniform.
    #[error(
        "{what}: time is not uniform: row {row} (counted from 1) comes {} s after the one before, the sample time is {} s; {}",
        Seconds(*dt), Seconds(*ts), step_remedy(*dt, *ts)
    )]
    NonUniformTime {
        /// The record or file.
        what: String,
        /// First row, counted from 1, whose distance from the row before differs from the sample time.
        row: usize,
        /// That distance in seconds.
        dt: f64,
        /// The sample time in seconds.
        ts: f64,
    },
    /// The time column does not rise.
    #[error("{what}: the time does not rise from row to row: {problem}")]
    NotRising {
        /// The record or file.
        what: String,
        /// How the rows lie, and what to do.
        problem: String,
    },
    /// The name of the time column, or a line of units, states another unit than the second.
    #[error(
        "{what}: the time column {:?} is in {unit} by its {by}, but times are read in seconds; leave it out and state the sample time in seconds (sample_time in [data], --sample-time), or make seconds of it: time_column = \"seconds\" and, in [data.computed], seconds = \"'{}' {to_seconds}\"",
        short(column),
        short(column)
    )]
    TimeUnit {
        /// The record or file.
        what: String,
        /// The name of the column, or `#` and its number.
        column: String,
        /// The unit.
        unit: &'static str,
        /// What states it: its name or a line of units.
        by: &'static str,
        /// How seconds are made of it, such as `/ 1e3`.
        to_seconds: &'static str,
    },
    /// Channels with their own time stamps cannot be brought to the clock of the controller.
    #[error("{what}: {problem}")]
    Clock {
        /// The log.
        what: String,
        /// The channel, what is wrong with it, and the remedy.
        problem: String,
    },
    /// Neither a sample time nor a time column is declared.
    #[error(
        "{what}: the sample time is not known; state it in seconds (--sample-time, or sample_time in [data]) or name the column of the time (--time, or time_column)"
    )]
    SampleTimeMissing {
        /// The record or file.
        what: String,
    },
}

youla::error_context! {
    sources: Method;
    numerical: Json;
    bad_input: Settings OutputExists BeingWritten NotReplaced Unwritable FileExists NotAModel NotAResponse Io MissingFile NoData Cell FieldCount
        Delimiter Corrupt
        FormatNotRead UnequalLength WrongVariable NonUniformTime NotRising TimeUnit Clock SampleTimeMissing;
}

/// Where a damaged file was found to be damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CorruptAt {
    /// Byte, counted from 0.
    Byte(u64),
    /// After this line, counted from 1, the last one that could be decompressed.
    Line(usize),
}

impl std::fmt::Display for CorruptAt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            CorruptAt::Byte(offset) => write!(f, "byte {offset}"),
            CorruptAt::Line(line) => write!(f, "after line {line}"),
        }
    }
}

/// A position in a text file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextPosition {
    /// Line, counted from 1.
    pub line: usize,
    /// Column, counted from 1.
    pub column: usize,
}

impl TextPosition {
    /// The position of byte `offset` of a text; columns count characters. An offset outside of the text, or inside of a
    /// character, gives the end.
    pub fn of(text: &str, offset: usize) -> Self {
        let before = text.get(..offset).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        TextPosition { line, column: before.rsplit('\n').next().unwrap_or_default().chars().count() + 1 }
    }
}

/// `:line:column` where they are known.
fn position(at: Option<TextPosition>) -> String {
    at.map_or(String::new(), |p| format!(":{}:{}", p.line, p.column))
}

/// What to do about a step of the time column.
fn step_remedy(dt: f64, ts: f64) -> &'static str {
    if (dt - ts).abs() < 0.5 * ts {
        "no row is lost, the stamps vary: state the sample time in place of the time column where the machine keeps it (sample_time in [data], \
         --sample-time), or bring the log to one clock by `youla synchronise`"
    } else if dt > 0.0 {
        "gaps = \"split\" in [data] cuts the record there, `segments` of the file choose rows"
    } else {
        "remove the rows that were logged twice, and sort the others"
    }
}

/// Lines up to which those before one with other fields may be notes above the names.
const LONGEST_NOTES: usize = 6;

/// The setting that passes over the lines that are no data: notes above the names, or the line itself.
fn lines_to_skip(line: usize) -> String {
    let itself = format!("a line that is no row, as the last one of a log that was cut, by --skip-lines {line}");
    if !(2..=LONGEST_NOTES).contains(&line) {
        return format!("pass over {itself} (skip_lines in [data] csv)");
    }
    let notes: Vec<String> = (1..line).map(|k| k.to_string()).collect();
    format!("pass over notes above the names by --skip-lines {} (skip_lines in [data] csv), {itself}", notes.join(","))
}

/// The setting that makes a cell with the other decimal sign a number.
fn cell_remedy(text: &str, decimal: Option<&str>) -> String {
    let missing = ["", "nan", "na", "null", "none", "-"].contains(&text.trim().to_ascii_lowercase().as_str());
    if missing && decimal.is_none() {
        return "; leave rows without a value out of the file, and gaps = \"split\" in [data] cuts the record there (with a \
                time_column), or, where each channel has rows of its own, bring them to one clock by `youla synchronise`; every row is \
                read, also those that `segments`, `skip` and `take` do not use"
            .into();
    }
    let remedy =
        |sign| format!(" with the declared decimal sign; set decimal = \"{sign}\" if the whole file uses the {sign}");
    match decimal {
        Some(sign) => remedy(sign),
        None if text.contains(':') => "; a date with a time is read as 2026-03-01T10:00:00.000 or 01.03.2026 10:00:00.000; of another stamp, leave the column out and state \
                                       the sample time (sample_time in [data], --sample-time)"
            .into(),
        None if text.chars().all(|c| c.is_ascii_digit() || "+-.,' \u{a0}".contains(c)) => {
            "; write numbers without separators of thousands, as 1234.5".into()
        }
        None if text.chars().any(char::is_alphabetic) => {
            "; a line of units or notes is passed over where skip_lines in [data] csv (--skip-lines) names it; a row of a fault is left out \
             of the file, and gaps = \"split\" in [data] cuts the record there"
                .into()
        }
        None => String::new(),
    }
}
