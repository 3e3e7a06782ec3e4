//! A text file as records.

use super::lines::Lines;
use super::options::CsvOptions;
use super::parse::{Fields, Selection};
use super::plan::Plan;
use crate::assemble::only;
use crate::choose::{ChannelRef, ChannelSpec};
use crate::error::Result;
use crate::time::{TimeSource, is_clock};
use std::io::Cursor;
use std::path::Path;
use youla::signal::Record;

/// Reads `channels`, or all columns but the time where `channels` is empty.
///
/// # Errors
/// [`crate::Error::MissingFile`], [`crate::Error::Io`], [`crate::Error::Corrupt`] for a damaged gzip file, [`crate::Error::NoData`],
/// [`crate::Error::FormatNotRead`] for zero bytes and for more than 65536 columns,
/// [`crate::Error::Delimiter`], [`crate::Error::FieldCount`], [`crate::Error::Cell`], [`youla::Error::DuplicateChannel`], [`youla::Error::UnknownChannel`],
/// and those of the sample time: [`crate::Error::SampleTimeMissing`], [`crate::Error::NonUniformTime`],
/// [`youla::Error::SampleTimeMismatch`].
///
/// ```no_run
/// use youla_io::{ChannelSpec, CsvOptions, TimeSource, read_csv};
/// let channels = [ChannelSpec::named("u"), ChannelSpec::named("y")];
/// let record = read_csv("run.csv.gz", &channels, &TimeSource::column("t".parse().unwrap()), &CsvOptions::default())?;
/// # Ok::<(), youla_io::Error>(())
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
pub(crate) fn read_csv_parts(
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
    // A damaged gzip stream gives damaged text; report the damage, not the text.
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
    time.column.iter().try_for_each(|column| fields.require_seconds(lines, column))?;
    let plan = Plan::new(lines.path(), fields.names(), channels, time)?;
    let columns = Selection::new(&fields, &plan.columns).read(&fields, lines)?;
    Ok((plan, columns))
}

/// Rows of a clock that are compared with a declared sample time.
/// Chosen, not measured.
const COMPARED: usize = 1000;

/// The first rows of the column that names itself a clock, with its name.
pub(crate) fn leading_clock(path: &Path, options: &CsvOptions) -> Result<Option<(String, Vec<f64>)>> {
    let mut lines = Lines::open(path)?;
    let fields = Fields::detect(&mut lines, options)?;
    let Some(column) = fields.names().iter().position(|name| is_clock(name)) else { return Ok(None) };
    let mut times = Vec::new();
    while times.len() < COMPARED && lines.advance()? {
        match fields.number(lines.current(), column) {
            Some(time) => times.push(time),
            None => return Ok(None),
        }
    }
    Ok(Some((fields.names()[column].clone(), times)))
}

/// All columns with their names, `#1`, `#2` and so on where the file has none; an error for one that holds more than numbers.
pub(crate) fn read_each(path: &Path, options: &CsvOptions) -> Result<Vec<(String, Result<Vec<f64>>)>> {
    columns(path, options, false)
}

fn columns(path: &Path, options: &CsvOptions, blanks: bool) -> Result<Vec<(String, Result<Vec<f64>>)>> {
    let mut lines = Lines::open(path)?;
    let fields = Fields::detect(&mut lines, options)?;
    let columns = fields.read_each(&mut lines, blanks).map_err(|error| lines.damage().unwrap_or(error))?;
    Ok(fields.names().iter().cloned().zip(columns).collect())
}

/// Name, times and values of each column of numbers of a text file; an empty cell means that the channel has no sample at the time of its
/// row. Times stay in the unit of the file.
///
/// # Errors
/// Those of [`read_csv`] but for the sample time; a column with other text is left out, but for that of the time.
pub fn read_stamped_csv(path: impl AsRef<Path>, time: &ChannelRef, options: &CsvOptions) -> Result<Vec<StampedColumn>> {
    let path = path.as_ref();
    let mut found = columns(path, options, true)?;
    let names: Vec<String> = found.iter().map(|(name, _)| name.clone()).collect();
    let times = found.remove(time.index(&path.display().to_string(), &names)?).1?;
    if let Some(row) = times.iter().position(|t| t.is_nan()) {
        let what = format!("{}: the time in row {} (counted from 1)", path.display(), row + 1);
        return Err(youla::Error::OutOfRange {
            what,
            value: f64::NAN,
            must: "a number; leave rows without a time out",
        }
        .into());
    }
    let stamped = |(name, values): (String, Result<Vec<f64>>)| {
        let there = times.iter().zip(values.ok()?).filter(|(_, v)| !v.is_nan());
        let (times, values) = there.map(|(t, v)| (*t, v)).unzip();
        Some((name, times, values))
    };
    Ok(found.into_iter().filter_map(stamped).collect())
}

/// Name, times and values of a column.
pub type StampedColumn = (String, Vec<f64>, Vec<f64>);

/// Refuses a time column in another unit than the second by the head of a text file.
pub(crate) fn require_seconds(path: &Path, column: &ChannelRef, options: &CsvOptions) -> Result<()> {
    let mut lines = Lines::open(path)?;
    Fields::detect(&mut lines, options)?.require_seconds(&mut lines, column)
}
