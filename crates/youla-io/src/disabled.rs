//! In place of the reader of HDF5 files where its feature is off: the file is refused with the name of the feature.

use crate::error::{Error, Result};
use crate::values::Variables;
use std::path::Path;

pub(crate) mod hdf {
    use super::{Error, Path, Result, Variables};

    pub(crate) fn hdf_from_bytes(_bytes: &[u8], path: &Path) -> Result<Variables> {
        let remedy = "build youla-io with the feature `mat73`, or save the data with the option -v7";
        Err(Error::FormatNotRead { path: path.to_owned(), found: "a MATLAB file of version 7.3 (HDF5)", remedy })
    }
}
