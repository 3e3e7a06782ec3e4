//! Opening and reading whole files, with errors that name the file.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Largest text that is read as a whole, bytes: a hundred times the largest report.
const LARGEST_TEXT: u64 = 256 << 20;
/// Largest file of records that is read as a whole, bytes: 125 million numbers. Chosen, not measured.
const LARGEST_RECORD: u64 = 1 << 30;

/// Opens a file to read. Pipes and devices are refused before they are opened: a pipe without a writer would block for ever, a device
/// has no end, and files are read more than once.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`], [`Error::FormatNotRead`] for a pipe, a socket or a device.
pub fn open(path: &Path) -> Result<File> {
    let failed = |source: std::io::Error| match source.kind() {
        ErrorKind::NotFound => Error::MissingFile { path: path.to_owned() },
        _ => Error::Io { path: path.to_owned(), source },
    };
    let kind = std::fs::metadata(path).map_err(failed)?.file_type();
    if !kind.is_file() && !kind.is_dir() {
        let (found, remedy) = ("a pipe, a socket or a device", "write it to a file first and give the file");
        return Err(Error::FormatNotRead { path: path.to_owned(), found, remedy });
    }
    File::open(path).map_err(failed)
}

/// The text of a file of settings or results.
///
/// # Errors
/// As [`read_bytes`]; [`Error::Io`] for bytes that are no text.
pub fn read_text(path: &Path) -> Result<String> {
    let invalid = |e| Error::Io { path: path.to_owned(), source: std::io::Error::new(ErrorKind::InvalidData, e) };
    String::from_utf8(read_bytes(path)?).map_err(invalid)
}

/// The bytes of a file of settings, results or a model.
///
/// # Errors
/// As [`open`]; [`Error::Io`]; [`Error::FormatNotRead`] above 256 MB.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    whole(path, LARGEST_TEXT, "a file of settings, results or a model of more than 256 MB")
}

/// The bytes of a file of records.
pub(crate) fn record_bytes(path: &Path) -> Result<Vec<u8>> {
    whole(path, LARGEST_RECORD, "a MATLAB file of more than 1 GB")
}

/// The bytes of a regular file of at most so many; `found` says what a larger one is.
pub(crate) fn whole(path: &Path, largest: u64, found: &'static str) -> Result<Vec<u8>> {
    let io = |source| Error::Io { path: path.to_owned(), source };
    let too_large = || Error::FormatNotRead {
        path: path.to_owned(),
        found,
        remedy: "give the file that was meant, or only what is needed of it",
    };
    let file = open(path)?;
    // Before memory is taken: a sparse file takes no room on the disk.
    if file.metadata().map_err(io)?.len() > largest {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    file.take(largest + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > largest { Err(too_large()) } else { Ok(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `/dev/zero` has no end, `/dev/null` is no record either.
    #[cfg(unix)]
    #[test]
    fn devices_are_refused() {
        for path in ["/dev/zero", "/dev/null"] {
            let refused = [
                open(Path::new(path)).map(|_| ()),
                read_text(Path::new(path)).map(|_| ()),
                record_bytes(Path::new(path)).map(|_| ()),
            ];
            for refused in refused {
                assert!(matches!(refused, Err(Error::FormatNotRead { .. })), "{refused:?}");
            }
        }
    }

    #[test]
    fn a_missing_file_is_named() {
        assert!(matches!(read_text(Path::new("no-such-file")), Err(Error::MissingFile { .. })));
    }

    /// Six gigabytes that take no room on the disk were read until the memory ended.
    #[test]
    fn files_above_the_limit_are_refused_before_memory_is_taken() {
        let file = crate::scratch::scratch("mat");
        File::create(file.path()).unwrap().set_len(6 << 30).unwrap();
        let refused = [
            read_text(file.path()).map(|_| ()),
            read_bytes(file.path()).map(|_| ()),
            record_bytes(file.path()).map(|_| ()),
        ];
        assert!(refused.iter().all(|r| matches!(r, Err(Error::FormatNotRead { .. }))), "{refused:?}");
    }
}
