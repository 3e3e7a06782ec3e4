//! A record as text.

use crate::error::{Error, Result};
use std::path::Path;
use youla::signal::Record;

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
