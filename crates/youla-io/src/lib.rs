//! Records and models to and from files: CSV, MATLAB, NumPy, HDF5 and Parquet in; C, Python, MATLAB and JSON out.
//!
//! A file is read once, checked once and trusted afterwards. Nothing is repaired on the way: a gap, a NaN or an unequal
//! length is an error that says where it is.

mod choose;
mod csv;
mod error;
pub mod export;
pub mod folder;
mod hdf;
mod matfile;
mod npy;
mod npz;
mod parquet;
#[cfg(test)]
pub(crate) mod scratch;
mod source;
mod survey;
mod time;
pub mod toml_file;
mod values;

pub use choose::{ChannelRef, ChannelSpec};
pub(crate) use csv::csv_to_bytes;
pub use csv::{CsvOptions, CsvStream, DecimalSign, Delimiter, HeaderLine, csv_from_bytes, read_csv, write_csv};
pub use error::{Error, Result, TextPosition};
pub(crate) use matfile::mat_to_bytes;
pub use matfile::{Packing, mat_from_bytes, read_mat, write_mat};
pub use npy::NpyStream;
pub use npy::is_npy;
pub use npz::{npz_from_bytes, read_npz};
pub use parquet::{parquet_from_bytes, read_parquet};
pub use source::{Format, Source, read, read_parts, sha256};
pub use survey::{ColumnContent, SurveyedColumn, survey};
pub use time::{Gaps, TimeSource};
pub use values::{Value, Variable, Variables};

use std::{fs::File, io::ErrorKind, path::Path};

/// Opens a file to read; a missing file has an error of its own.
pub fn open(path: &Path) -> Result<File> {
    File::open(path).map_err(|source| match source.kind() {
        ErrorKind::NotFound => Error::MissingFile { path: path.to_owned() },
        _ => Error::Io { path: path.to_owned(), source },
    })
}

/// The bytes of numbers that a file or a part of one may announce: `spare`, and for each of its own what deflate packs into one at
/// most. Other packings put more into a byte where numbers repeat, hence what is spare.
fn believable(spare: u64, bytes: u64) -> u64 {
    const UNPACKED: u64 = 1032;
    spare.saturating_add(UNPACKED.saturating_mul(bytes))
}
