//! Files for the tests of this module.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A file name of its own, removed at the end of the test.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

pub(crate) fn scratch(extension: &str) -> Scratch {
    static NEXT: AtomicUsize = AtomicUsize::new(0);
    let number = NEXT.fetch_add(1, Ordering::Relaxed);
    Scratch(std::env::temp_dir().join(format!("youla-{}-{number}.{extension}", std::process::id())))
}

/// The folder of measured data: `YOULA_DATA`, or `../shared/data` beside the workspace.
pub(crate) fn data_folder() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("YOULA_DATA").map_or_else(beside, PathBuf::from);
    assert!(folder.is_dir(), "the measured data are not at {}", folder.display());
    folder
}
