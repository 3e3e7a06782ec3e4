//! Parquet files: flat columns of numbers, as pandas, polars and data loggers write them.
//!
//! Source: Apache Parquet format, version 2. A file contains groups of rows, each with a chunk of every column, each of pages; the
//! footer lists their positions. Numbers of any width become `f64`; a column of timestamps becomes seconds from its first row, because nanoseconds
//! since 1970 do not fit into a `f64`; an empty cell becomes NaN, which a record rejects. For the choice of an own reader see decision 0016.

mod decode;
mod footer;
mod packing;
mod pages;
#[cfg(test)]
mod tests;
mod thrift;
mod thrift_writer;
mod write;

pub use write::{ColumnValues, ParquetWriter};

use crate::choose::ChannelRef;
use crate::error::{CorruptAt, Error, Result};
use crate::limits::declared_limit;
use crate::open::open;
use crate::values::{Value, Variable, Variables};
use footer::Footer;
use pages::Cells;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::Path;

/// The last bytes of a file.
const MAGIC: &[u8] = b"PAR1";
/// Bytes of numbers that any file or page may declare: runs of equal values need almost no bytes.
const BASE: u64 = 1 << 26;
/// Bytes of the largest footer that is read.
const LARGEST_FOOTER: u64 = 1 << 24;

/// Reads all columns of a Parquet file.
///
/// Columns of text, dates, decimals and lists become [`Value::Unsupported`], empty cells NaN.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`], [`Error::Corrupt`] for a damaged file, one that declares more than it can contain, and one
/// with an unsupported compression.
///
/// ```no_run
/// use youla_io::{ChannelSpec, TimeSource, read_parquet};
/// let record = read_parquet("run.parquet")?.record(&["u", "y"].map(ChannelSpec::named), &TimeSource::ts(1e-3))?;
/// # Ok::<(), youla_io::Error>(())
/// ```
pub fn read_parquet(path: impl AsRef<Path>) -> Result<Variables> {
    let path = path.as_ref();
    variables(open(path)?, path, |_, _| true)
}

/// The columns of a Parquet file that is in memory; `path` is named in errors.
///
/// # Errors
/// Those of [`read_parquet`] but for the operating system's.
pub fn parquet_from_bytes(bytes: &[u8], path: impl AsRef<Path>) -> Result<Variables> {
    variables(Cursor::new(bytes), path.as_ref(), |_, _| true)
}

/// As [`read_parquet`], but only the columns that are referred to are read: a logger writes hundreds.
pub(super) fn read_columns(path: &Path, references: &[ChannelRef]) -> Result<Variables> {
    let wanted = |name: &str, number: usize| {
        references.iter().any(|r| matches!(r, ChannelRef::Column(n) if *n == number) || r.to_string() == name)
    };
    variables(open(path)?, path, wanted)
}

/// What was expected instead.
type Fault = String;

fn variables(file: impl Read + Seek, path: &Path, wanted: impl Fn(&str, usize) -> bool) -> Result<Variables> {
    match columns(file, wanted) {
        Ok(columns) => Ok(Variables::new(path, columns)),
        Err(expected) => Err(Error::Corrupt { path: path.to_owned(), at: CorruptAt::Byte(0), expected }),
    }
}

fn columns(mut file: impl Read + Seek, wanted: impl Fn(&str, usize) -> bool) -> Result<Vec<Variable>, Fault> {
    let size = file.seek(SeekFrom::End(0)).map_err(unreadable)?;
    let footer = footer(&mut file, size)?;
    let chosen: Vec<bool> = footer.columns.iter().enumerate().map(|(k, c)| wanted(&c.name, k + 1)).collect();
    let rows = rows(&footer, size, chosen.iter().filter(|chosen| **chosen).count())?;
    let column = |(k, about): (usize, &footer::Column)| {
        let value = match about.content {
            Err(class) => Value::Unsupported { class: class.into() },
            Ok(_) if !chosen[k] => Value::Unsupported { class: "a column that was not requested".into() },
            Ok(number) => {
                let mut cells = Cells::new(about, number, rows);
                for group in &footer.groups {
                    let chunk = &group.chunks[k];
                    let bytes = part(&mut file, chunk.start, chunk.length, size)?;
                    let read = cells.take(&bytes, chunk.packing, group.rows as usize);
                    read.map_err(|fault| format!("{fault} (column {:?})", about.name))?;
                }
                Value::Real { dims: vec![rows, 1], data: cells.data }
            }
        };
        Ok(Variable { name: about.name.clone(), value })
    };
    footer.columns.iter().enumerate().map(column).collect()
}

fn unreadable(error: std::io::Error) -> Fault {
    format!("a readable Parquet file ({error})")
}

/// Bytes of a file of `size`.
fn part(file: &mut (impl Read + Seek), start: u64, length: u64, size: u64) -> Result<Vec<u8>, Fault> {
    if start.checked_add(length).is_none_or(|end| end > size) {
        return Err("columns that are part of the file".into());
    }
    let mut bytes = vec![0; length as usize];
    file.seek(SeekFrom::Start(start)).and_then(|_| file.read_exact(&mut bytes)).map_err(unreadable)?;
    Ok(bytes)
}

/// The end of a file: the footer, its length in four bytes, and four letters.
fn footer(file: &mut (impl Read + Seek), size: u64) -> Result<Footer, Fault> {
    let end = part(file, size.saturating_sub(8), size.min(8), size)?;
    let length =
        end.strip_suffix(MAGIC).and_then(|length| Some(u64::from(u32::from_le_bytes(length.try_into().ok()?))));
    let length = length.ok_or("a Parquet file that is whole and not encrypted, which ends in PAR1")?;
    if length > LARGEST_FOOTER {
        return Err(format!("a footer of at most {LARGEST_FOOTER} bytes"));
    }
    let start = (size - 8).checked_sub(length).ok_or("a footer that is part of the file")?;
    Footer::parse(&part(file, start, length, size)?)
}

/// The rows of a file of `size` bytes; more than could fill `columns` within the limit are rejected.
fn rows(footer: &Footer, size: u64, columns: usize) -> Result<usize, Fault> {
    let most = declared_limit(BASE, size) / (8 * columns.max(1) as u64);
    let rows = footer.groups.iter().fold(0_u64, |rows, group| rows.saturating_add(group.rows));
    if rows > most {
        return Err(format!("fewer than {rows} rows in {size} bytes"));
    }
    Ok(rows as usize)
}
