//! Text files: comma, semicolon, tab or blank separated, plain or gzip, with or without a line of names.
//!
//! Lines that begin with `#` or `%` and blank lines are passed over. Only the chosen columns are read as numbers; a cell
//! of them that is not a finite number is an error with its line and column. The decimal sign is the point unless a comma is
//! declared; numbers written with the other sign are refused with their line.

use super::time::{Clock, TimeSource};
use super::{ChannelRef, ChannelSpec};
use crate::{Error, Result};
use faer::Mat;
use serde::{Deserialize, Serialize};
use std::io::Cursor;
use std::path::Path;
use youla::signal::Channel;
use youla::signal::Record;

mod lines;
mod parse;
mod stream;

use lines::Lines;
use parse::{Fields, Selection};
pub use stream::CsvStream;

/// What stands between two cells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Delimiter {
    /// Read it off the first line: the only one of comma, semicolon and tab that it holds, else blanks. A line that
    /// holds two of them is an error.
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

/// Whether the first line holds the names of the columns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HeaderLine {
    /// It does when none of its cells is a number.
    #[default]
    Detect,
    /// It does.
    Present,
    /// It does not: the columns are chosen by number and named `#1`, `#2` and so on.
    Absent,
}

/// What stands before the decimals of a number; never guessed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DecimalSign {
    /// `0.5`
    #[default]
    Point,
    /// `0,5`; the comma is then no delimiter.
    Comma,
}

impl DecimalSign {
    /// In words, as it is declared.
    fn key(self) -> &'static str {
        match self {
            DecimalSign::Point => "point",
            DecimalSign::Comma => "comma",
        }
    }

    fn other(self) -> Self {
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
    /// What stands between two cells.
    pub delimiter: Delimiter,
    /// Whether the first line holds names.
    pub header: HeaderLine,
    /// The decimal sign of all numbers, also of the time.
    pub decimal: DecimalSign,
}

/// Reads `channels`, or all columns but the time where `channels` is empty.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`], [`Error::CorruptGzip`], [`Error::NoData`],
/// [`Error::FormatNotRead`] for zero bytes and for more than 65536 columns,
/// [`Error::Delimiter`], [`Error::RaggedRow`], [`Error::Cell`], [`Error::DecimalSign`] for a number that is written with the sign that was
/// not declared, [`Error::CommaTwice`] where the comma is declared as delimiter and as decimal sign, [`youla::Error::DuplicateChannel`], [`youla::Error::UnknownChannel`],
/// and those of the sample time: [`Error::SampleTimeMissing`], [`Error::NonUniformTime`],
/// [`youla::Error::SampleTimeMismatch`].
///
/// ```no_run
/// use youla_io::{ChannelSpec, CsvOptions, TimeSource, read_csv};
/// let channels = [ChannelSpec::named("u"), ChannelSpec::named("y")];
/// let record = read_csv("run.csv.gz", &channels, &TimeSource::column("t".parse().unwrap()), &CsvOptions::default())?;
/// # Ok::<(), youla::Error>(())
/// ```
pub fn read_csv(
    path: impl AsRef<Path>,
    channels: &[ChannelSpec],
    time: &TimeSource,
    options: &CsvOptions,
) -> Result<Record> {
    only(read_csv_parts(path.as_ref(), channels, time, options)?)
}

/// The same for text, plain or gzip, that is in memory; `path` is named in errors.
///
/// # Errors
/// Those of [`read_csv`] but for the operating system's.
pub fn csv_from_bytes(
    bytes: &[u8],
    path: impl AsRef<Path>,
    channels: &[ChannelSpec],
    time: &TimeSource,
    options: &CsvOptions,
) -> Result<Record> {
    let path = path.as_ref();
    only(read_parts(Lines::over(path, Cursor::new(bytes.to_vec()))?, path, channels, time, options)?)
}

/// The record of a file for each part without gaps.
pub(super) fn read_csv_parts(
    path: &Path,
    channels: &[ChannelSpec],
    time: &TimeSource,
    options: &CsvOptions,
) -> Result<Vec<Record>> {
    read_parts(Lines::open(path)?, path, channels, time, options)
}

fn read_parts(
    mut lines: Lines,
    path: &Path,
    channels: &[ChannelSpec],
    time: &TimeSource,
    options: &CsvOptions,
) -> Result<Vec<Record>> {
    // What damage in a gzip file makes of its text is not the user's mistake.
    let (plan, columns) =
        read_columns(&mut lines, channels, time, options).map_err(|error| lines.damage().unwrap_or(error))?;
    plan.assemble(path, time, columns)
}

fn read_columns(
    lines: &mut Lines,
    channels: &[ChannelSpec],
    time: &TimeSource,
    options: &CsvOptions,
) -> Result<(Plan, Vec<Vec<f64>>)> {
    let fields = Fields::detect(lines, options)?;
    let plan = Plan::new(lines.path(), fields.names(), channels, time)?;
    let columns = Selection::new(&fields, &plan.columns).read(&fields, lines)?;
    Ok((plan, columns))
}

/// Names of all columns, `#1`, `#2` and so on where the file has none.
pub(super) fn column_names(path: &Path, options: &CsvOptions) -> Result<Vec<String>> {
    Ok(Fields::detect(&mut Lines::open(path)?, options)?.names().to_vec())
}

/// Writes the time in a column `t` and all channels; every number reads back as the same number.
///
/// Units are not written. After an error there is no file.
///
/// # Errors
/// [`youla::Error::DuplicateChannel`] where a channel is named `t`, [`Error::Io`].
pub fn write_csv(record: &Record, path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    refuse_time(record, || path.display().to_string())?;
    let written = std::fs::File::create(path).and_then(|file| write_rows(record, file));
    written.map_err(|source| {
        // Best effort: the error that led here is the one to report.
        let _ = std::fs::remove_file(path);
        Error::Io { path: path.to_owned(), source }
    })
}

/// Name of the time column that is written.
const TIME: &str = "t";

/// The bytes of such a file, behind the given comments, one a line.
///
/// # Errors
/// As [`write_csv`].
pub(crate) fn csv_to_bytes(record: &Record, comments: &[String]) -> Result<Vec<u8>> {
    refuse_time(record, || record.name().to_owned())?;
    let mut bytes: Vec<u8> = comments.iter().flat_map(|line| format!("# {line}\n").into_bytes()).collect();
    let path = Path::new(record.name()).to_owned();
    write_rows(record, &mut bytes).map_err(|source| Error::Io { path, source })?;
    Ok(bytes)
}

/// A channel must not have the name of the time.
fn refuse_time(record: &Record, what: impl FnOnce() -> String) -> Result<()> {
    match record.channels().iter().any(|c| c.name == TIME) {
        true => Err(Error::Method(youla::Error::DuplicateChannel { what: what(), name: TIME.to_owned() })),
        false => Ok(()),
    }
}

fn write_rows(record: &Record, to: impl std::io::Write) -> std::io::Result<()> {
    let mut writer = ::csv::Writer::from_writer(to);
    writer.write_record([TIME].into_iter().chain(record.channels().iter().map(|c| c.name.as_str())))?;
    let mut cell = String::new();
    for k in 0..record.samples() {
        for x in std::iter::once(record.time_at(k)).chain(record.data().row(k).iter().copied()) {
            use std::fmt::Write;
            cell.clear();
            write!(cell, "{x:?}").map_err(std::io::Error::other)?;
            writer.write_field(&cell)?;
        }
        writer.write_record(None::<&[u8]>)?;
    }
    writer.flush()
}

/// Which columns of the file become what.
struct Plan {
    channels: Vec<Channel>,
    /// Indices of the channels and, last, of the time column.
    columns: Vec<usize>,
    timed: bool,
}

impl Plan {
    fn new(path: &Path, names: &[String], specs: &[ChannelSpec], time: &TimeSource) -> Result<Plan> {
        let what = path.display().to_string();
        let index = |reference: &ChannelRef| reference.index(&what, names);
        let clock = time.column.as_ref().map(index).transpose()?;
        let mut plan = Plan { channels: Vec::new(), columns: Vec::new(), timed: clock.is_some() };
        for spec in specs {
            plan.channels.push(Channel::new(&spec.name, &spec.unit));
            plan.columns.push(index(&spec.source())?);
        }
        if specs.is_empty() {
            plan.columns = (0..names.len()).filter(|&j| Some(j) != clock).collect();
            plan.channels = plan.columns.iter().map(|&j| Channel::new(&names[j], "")).collect();
        }
        if plan.channels.is_empty() {
            return Err(Error::NoData { path: path.to_owned(), problem: "there is no column besides the time" });
        }
        plan.columns.extend(clock);
        Ok(plan)
    }

    fn assemble(self, path: &Path, time: &TimeSource, mut columns: Vec<Vec<f64>>) -> Result<Vec<Record>> {
        let what = path.display().to_string();
        let times = if self.timed { columns.pop() } else { None };
        let clock = time.resolve(&what, times.as_deref())?;
        assemble(&what, self.channels, &columns, clock)
    }
}

/// The record of a file that must have no gaps.
pub(super) fn only(mut parts: Vec<Record>) -> Result<Record> {
    if let [first, second, ..] = &parts[..] {
        let (what, row, ts) = (first.name().to_owned(), first.samples() + 1, first.time().ts());
        return Err(Error::NonUniformTime { what, row, dt: second.start() - first.time_at(first.samples() - 1), ts });
    }
    Ok(parts.remove(0))
}

/// The records, one for each part without gaps, of columns of equal length.
pub(super) fn assemble(what: &str, channels: Vec<Channel>, columns: &[Vec<f64>], clock: Clock) -> Result<Vec<Record>> {
    let samples = columns.first().map_or(0, Vec::len);
    for (channel, column) in channels.iter().zip(columns) {
        if column.len() != samples {
            let (what, channel, found) = (what.to_owned(), channel.name.clone(), column.len());
            return Err(Error::UnequalLength { what, channel, found, expected: samples });
        }
    }
    let ends = clock.parts.iter().skip(1).map(|part| part.0).chain([samples]);
    let part = |(&(from, start), to): (&(usize, f64), usize)| {
        let mut data = Mat::zeros(to - from, columns.len());
        for (j, column) in columns.iter().enumerate() {
            data.col_as_slice_mut(j).copy_from_slice(&column[from..to]);
        }
        Ok(Record::new(what, channels.clone(), data, clock.time)?.starting_at(start)?)
    };
    clock.parts.iter().zip(ends).map(part).collect()
}

#[cfg(test)]
mod tests;
