//! One description of a recorded file for the library, configuration files and the program.

use crate::assemble::only;
use crate::choose::{ChannelRef, ChannelSpec};
use crate::csv::{CsvOptions, leading_clock, read_csv_parts, require_seconds};
use crate::error::{Error, Result};
use crate::matfile::read_mat;
use crate::npz::{self, read_npz};
use crate::open::open;
use crate::time::{TimeSource, is_clock, require_agreement};
use hmac_sha256::Hash;
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::path::{Path, PathBuf};
use youla::signal::Record;

/// The format of a file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// By the first bytes of the file (MATLAB, HDF5, zip, NumPy), else text.
    #[default]
    Detect,
    /// Text, see [`crate::read_csv`].
    Csv,
    /// MATLAB version 5, see [`read_mat`].
    Mat,
    /// NumPy archive or array, see [`read_npz`].
    Npz,
}

/// A file, its clock and the channels to take from it.
///
/// ```
/// let source: youla_io::Source = toml::from_str(
///     r#"
///     path = "cycle1.mat"
///     time = { ts = 5e-4 }
///     channels = [
///         { name = "u", from = "Data.signals.u", unit = "V" },
///         { name = "y", from = "Data.signals.y", unit = "rad" },
///     ]
///     "#,
/// )?;
/// assert_eq!(source.channels[1].unit, "rad");
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// Its format.
    #[serde(default)]
    pub format: Format,
    /// Time column, sample time or both.
    #[serde(default)]
    pub time: TimeSource,
    /// The channels of the record; for text files, all columns where there are none.
    #[serde(default)]
    pub channels: Vec<ChannelSpec>,
    /// How to read a text file; unused for other formats.
    #[serde(default)]
    pub csv: CsvOptions,
}

/// Reads a record as described.
///
/// # Errors
/// Those of [`crate::read_csv`], [`read_mat`], [`read_npz`] and [`crate::Variables::record`].
pub fn read(source: &Source) -> Result<Record> {
    only(read_parts(source)?)
}

/// Reads the rows of a record whose sample time is not known, or is found in its channels: one second stands for it, whatever `source.time` says.
///
/// # Errors
/// As [`read`] but for those of the sample time.
pub fn read_rows(source: &Source) -> Result<Record> {
    only(parts_at(source, &TimeSource::ts(1.0), None)?)
}

/// Reads a record as described, cut where its time column has gaps if [`crate::Gaps::Split`] says so: together the records
/// hold all rows of the file in order.
///
/// # Errors
/// As [`read`]; [`Error::Clock`] for a clock in the file that is not named and contradicts the declared sample time.
pub fn read_parts(source: &Source) -> Result<Vec<Record>> {
    let declared = source.time.ts.filter(|_| source.time.column.is_none());
    parts_at(source, &source.time, declared)
}

/// With `declared`, a clock in the file that is no channel must agree with that sample time.
fn parts_at(source: &Source, time: &TimeSource, declared: Option<f64>) -> Result<Vec<Record>> {
    let what = source.path.display().to_string();
    let unused = |column: &str| source.channels.iter().all(|channel| channel.source().to_string() != column);
    let variables = match resolve(source)? {
        Format::Mat => read_mat(&source.path)?,
        Format::Npz => read_npz(&source.path)?,
        Format::Csv | Format::Detect => {
            if let Some(ts) = declared
                && let Some((column, times)) = leading_clock(&source.path, &source.csv)?
                && unused(&column)
            {
                require_agreement(&what, &column, &times, ts)?;
            }
            return read_csv_parts(&source.path, &source.channels, time, &source.csv);
        }
    };
    if let Some(ts) = declared {
        let last = |path: &str| is_clock(path.rsplit('.').next().unwrap_or(path));
        for clock in variables.leaves().iter().filter(|path| last(path) && unused(path)) {
            // What is no column of numbers is no clock.
            if let Ok(times) = variables.column(clock) {
                require_agreement(&what, clock, &times, ts)?;
            }
        }
    }
    variables.record_parts(&source.channels, time)
}

/// Refuses a time column in another unit than the second, by its name or a line of units in the file, before anything else is read.
///
/// # Errors
/// [`Error::TimeUnit`]; those of the reader for the head of a text file.
pub fn check_unit(source: &Source, column: &ChannelRef) -> Result<()> {
    TimeSource::column(column.clone()).check_unit(&source.path.display().to_string())?;
    match resolve(source)? {
        Format::Csv | Format::Detect => require_seconds(&source.path, column, &source.csv),
        Format::Mat | Format::Npz => Ok(()),
    }
}

/// SHA-256 of the bytes of a file in hexadecimal digits, by which a result names its input.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`].
pub fn sha256(path: impl AsRef<Path>) -> Result<String> {
    let path = path.as_ref();
    let mut file = open(path)?;
    let mut hash = Hash::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()),
            Ok(read) => hash.update(&buffer[..read]),
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(source) => return Err(Error::Io { path: path.to_owned(), source }),
        }
    }
}

/// SHA-256 of the values of columns in memory, each as its eight bytes from the lowest, as [`sha256`] names a file.
pub fn sha256_of<'a>(columns: impl Iterator<Item = &'a [f64]>) -> String {
    let mut hash = Hash::new();
    for piece in columns.flat_map(|column| column.chunks(1 << 10)) {
        hash.update(piece.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

pub(super) fn resolve(source: &Source) -> Result<Format> {
    if source.format != Format::Detect {
        return Ok(source.format);
    }
    let mut start = Vec::new();
    let read = open(&source.path)?.take(8).read_to_end(&mut start);
    read.map_err(|e| Error::Io { path: source.path.clone(), source: e })?;
    Ok(match &start[..] {
        [b'P', b'K', 3, 4, ..] => Format::Npz,
        start if start.starts_with(npz::MAGIC) => Format::Npz,
        start if start.starts_with(b"PAR1") => {
            let remedy = "save the data as CSV or NPZ, or read it by the Python package";
            return Err(Error::FormatNotRead { path: source.path.clone(), found: "a Parquet file", remedy });
        }
        [0xd0, 0xcf, 0x11, 0xe0, ..] => {
            let remedy = "save the sheet with the log as CSV";
            return Err(Error::FormatNotRead { path: source.path.clone(), found: "an Excel workbook (.xls)", remedy });
        }
        start if start.starts_with(b"MATLAB") || start.starts_with(b"\x89HDF") => Format::Mat,
        _ if source.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mat")) => Format::Mat,
        _ => Format::Csv,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scratch::scratch;
    use crate::{Packing, Value, Variable, write_mat};

    fn source(path: &Path, channels: &str) -> Source {
        toml::from_str(&format!("path = {path:?}\ntime = {{ ts = 0.5 }}\nchannels = {channels}")).unwrap()
    }

    #[test]
    fn formats_are_found_by_content() {
        let text = scratch("data");
        std::fs::write(text.path(), "1 2\n3 4\n").unwrap();
        let by_number = source(text.path(), r##"[{ name = "y", from = 2 }, { name = "u", from = "#1" }]"##);
        assert_eq!(by_number.channels[1].from, Some(ChannelRef::Column(1)));
        assert_eq!(read(&by_number).unwrap().column("y").unwrap(), [2.0, 4.0]);

        let matlab = scratch("data");
        let x = Value::Real { dims: vec![2, 2], data: vec![1.0, 2.0, 3.0, 4.0] };
        write_mat(matlab.path(), &[Variable { name: "x".into(), value: x }], Packing::Zlib).unwrap();
        let by_path = source(matlab.path(), r#"[{ name = "y", from = "x(:,2)" }]"#);
        assert_eq!(read(&by_path).unwrap().column("y").unwrap(), [3.0, 4.0]);
        let wrong = read(&source(matlab.path(), r#"[{ name = "z" }]"#)).unwrap_err();
        assert!(
            matches!(wrong, Error::Method(youla::Error::UnknownChannel { ref known, .. }) if known == &["x"]),
            "{wrong}"
        );
    }

    #[test]
    fn a_misspelt_option_is_refused() {
        let error = toml::from_str::<Source>("path = \"x\"\ntime = { tz = 1.0 }").unwrap_err().to_string();
        assert!(error.contains("unknown field `tz`"), "{error}");
    }

    #[test]
    fn sha256_of_the_published_example() {
        // FIPS 180-2, appendix B.1: "abc".
        let file = scratch("txt");
        std::fs::write(file.path(), "abc").unwrap();
        let digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(file.path()).unwrap(), digest);
    }
}
