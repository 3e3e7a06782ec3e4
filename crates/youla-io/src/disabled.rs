//! In place of a format whose feature is off: the file is refused with the name of the feature.

use crate::error::{Error, Result};
use crate::values::Variables;
use std::path::Path;

#[cfg(not(feature = "parquet"))]
pub(crate) mod parquet {
    use super::{Path, Result, Variables, refuse};

    const FOUND: &str = "a Parquet file";
    const REMEDY: &str = "build youla-io with the feature `parquet`, or save the data as CSV or NPZ";

    /// Refuses: this build has no Parquet reader (feature `parquet`).
    ///
    /// # Errors
    /// [`crate::Error::FormatNotRead`], always.
    pub fn read_parquet(path: impl AsRef<Path>) -> Result<Variables> {
        refuse(path.as_ref(), FOUND, REMEDY)
    }

    /// Refuses as [`read_parquet`] does.
    ///
    /// # Errors
    /// [`crate::Error::FormatNotRead`], always.
    pub fn parquet_from_bytes(_bytes: &[u8], path: impl AsRef<Path>) -> Result<Variables> {
        refuse(path.as_ref(), FOUND, REMEDY)
    }

    pub(crate) fn read_columns(path: &Path, _references: &[crate::choose::ChannelRef]) -> Result<Variables> {
        refuse(path, FOUND, REMEDY)
    }
}

#[cfg(not(feature = "mat73"))]
pub(crate) mod hdf {
    use super::{Path, Result, Variables, refuse};

    pub(crate) fn hdf_from_bytes(_bytes: &[u8], path: &Path) -> Result<Variables> {
        let remedy = "build youla-io with the feature `mat73`, or save the data with the option -v7";
        refuse(path, "a MATLAB file of version 7.3 (HDF5)", remedy)
    }
}

fn refuse(path: &Path, found: &'static str, remedy: &'static str) -> Result<Variables> {
    Err(Error::FormatNotRead { path: path.to_owned(), found, remedy })
}
