//! The seeds of the fuzz targets, written by `fuzz/seeds.py`: synthetic, small.

use std::path::Path;

/// Those of a reader, in the order of their names.
pub(crate) fn of(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/youla-io/tests/seeds").join(name);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.into_iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// One of them.
pub(crate) fn file(name: &str, file: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/youla-io/tests/seeds").join(name);
    std::fs::read(folder.join(file)).unwrap()
}
