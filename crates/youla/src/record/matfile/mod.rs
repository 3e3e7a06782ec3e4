//! MATLAB files of version 5 (`save -v6` and `save -v7`): reader and writer.
//!
//! Source: The MathWorks, "MAT-File Format", the chapter on level 5. A file is a header of 128 bytes and a sequence of
//! data elements, each a tag (type, size) and its bytes; a variable is an element of elements; with `-v7` each variable
//! is packed by zlib. Sizes are believed only as far as there are bytes to fill them.

mod bytes;
mod path;
mod read;
mod value;
mod write;

pub use read::read_mat;
pub use value::{MatFile, Value, Variable};
pub use write::{Packing, write_mat};

use super::csv::assemble;
use super::{ChannelRef, ChannelSpec, Record, TimeSource};
use crate::units::Channel;
use crate::{Error, Result};
use std::path::Path;

/// Reads a record whose channels are vectors of a MATLAB file, chosen by paths such as `Data.signals.u`.
///
/// With `channels` empty, an error lists what the file holds.
///
/// # Errors
/// Those of [`read_mat`] and [`MatFile::column`]; [`Error::UnequalLength`], and those of the sample time:
/// [`Error::SampleTimeMissing`], [`Error::NonUniformTime`], [`Error::SampleTimeMismatch`].
///
/// ```no_run
/// use youla::record::{ChannelRef, ChannelSpec, TimeSource, read_mat_record};
/// let channels = ["u", "y"].map(|n| ChannelSpec::from(n, ChannelRef::Name(format!("Data.signals.{n}")), ""));
/// let record = read_mat_record("cycle1.mat", &channels, &TimeSource::ts(5e-4))?;
/// # Ok::<(), youla::Error>(())
/// ```
pub fn read_mat_record(path: impl AsRef<Path>, channels: &[ChannelSpec], time: &TimeSource) -> Result<Record> {
    let file = read_mat(path)?;
    if channels.is_empty() {
        return Err(file.unknown(""));
    }
    let read = |reference: &ChannelRef| file.column(&reference.to_string());
    let columns = channels.iter().map(|spec| read(&spec.source())).collect::<Result<Vec<_>>>()?;
    let times = time.column.as_ref().map(read).transpose()?;
    let what = file.path().display().to_string();
    if let Some(times) = times.as_ref().filter(|times| times.len() != columns[0].len()) {
        let (found, expected) = (times.len(), columns[0].len());
        return Err(Error::UnequalLength { what, channel: "the time".into(), found, expected });
    }
    let clock = time.resolve(&what, times.as_deref())?;
    let channels = channels.iter().map(|spec| Channel::new(&spec.name, &spec.unit)).collect();
    assemble(&what, channels, &columns, clock)
}

/// Class of an array, as the flags element states it.
mod class {
    pub(super) const CELL: u8 = 1;
    pub(super) const STRUCT: u8 = 2;
    pub(super) const OBJECT: u8 = 3;
    pub(super) const CHAR: u8 = 4;
    pub(super) const SPARSE: u8 = 5;
    pub(super) const DOUBLE: u8 = 6;
    pub(super) const UINT64: u8 = 15;
    pub(super) const FUNCTION: u8 = 16;
    pub(super) const OPAQUE: u8 = 17;
    pub(super) const COMPLEX: u32 = 0x0800;
}

/// Type of a data element, as its tag states it.
mod kind {
    pub(super) const INT8: u32 = 1;
    pub(super) const UINT8: u32 = 2;
    pub(super) const INT16: u32 = 3;
    pub(super) const UINT16: u32 = 4;
    pub(super) const INT32: u32 = 5;
    pub(super) const UINT32: u32 = 6;
    pub(super) const SINGLE: u32 = 7;
    pub(super) const DOUBLE: u32 = 9;
    pub(super) const INT64: u32 = 12;
    pub(super) const UINT64: u32 = 13;
    pub(super) const MATRIX: u32 = 14;
    pub(super) const COMPRESSED: u32 = 15;
    pub(super) const UTF8: u32 = 16;
    pub(super) const UTF16: u32 = 17;
}

const HEADER: usize = 128;

#[cfg(test)]
mod tests;
