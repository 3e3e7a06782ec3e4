//! Measured and simulated records: labelled, clocked samples x channels; the files they come from; spectra and
//! excitation signals.
//!
//! A record is read once, checked once and trusted afterwards: every number is finite, every channel has a name of its
//! own, and the sample time is known. Nothing is repaired on the way: a gap, a NaN or an unequal length is an error that
//! says where it is.

mod choose;
mod csv;
mod detrend;
mod excitation;
mod hdf;
mod matfile;
mod npz;
mod parquet;
mod persistency;
#[allow(clippy::module_inception)]
mod record;
#[cfg(test)]
pub(crate) mod scratch;
mod source;
mod spectrum;
mod stream;
mod survey;
mod time;
mod values;

pub(crate) use choose::unknown;
pub use choose::{ChannelRef, ChannelSpec};
pub(crate) use csv::csv_to_bytes;
pub use csv::{CsvOptions, CsvStream, DecimalSign, Delimiter, HeaderLine, csv_from_bytes, read_csv, write_csv};
pub use detrend::{Detrend, Detrended, Trend};
pub(crate) use excitation::fade;
pub use excitation::{
    Chirp, Excitation, ExcitationReport, ExcitationReportOptions, ExcitedChannel, Multisine, PowerBand, Prbs,
    RampedExcitation, SquareWaves, describe_excitation,
};
pub(crate) use matfile::mat_to_bytes;
pub use matfile::{Packing, mat_from_bytes, read_mat, write_mat};
pub use npz::{npz_from_bytes, read_npz};
pub use parquet::{parquet_from_bytes, read_parquet};
pub use persistency::{Persistency, persistency, persistency_order};
pub use record::{Record, Segments, Split};
pub use source::{Format, Source, read, read_parts, sha256};
pub use spectrum::{CrossSpectrum, ExcitedRecord, IndirectResponse, Welch, cross_spectrum, indirect_response};
pub(crate) use stream::is_npy;
pub use stream::{JoinedStreams, NpyStream, SampleStream};
pub use survey::{ColumnContent, SurveyedColumn, survey};
pub use time::{Gaps, TimeSource};
pub use values::{Value, Variable, Variables};

use crate::{Error, Result};
use std::{fs::File, io::ErrorKind, path::Path};

/// Opens a file to read; a missing file has an error of its own.
pub(crate) fn open(path: &Path) -> Result<File> {
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
