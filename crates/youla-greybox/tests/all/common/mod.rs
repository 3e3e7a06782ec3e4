//! What the integration tests share.

use std::path::PathBuf;

/// A file or folder of the measured data: below `YOULA_DATA`, else below `../shared/data` beside the repository.
pub(crate) fn data(name: &str) -> PathBuf {
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    let path = std::env::var_os("YOULA_DATA").map_or_else(beside, PathBuf::from).join(name);
    assert!(path.exists(), "{} does not exist; set YOULA_DATA to the folder of the measured data", path.display());
    path
}
