//! Opening and reading whole files, with errors that name the file.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Largest text that is read as a whole, bytes: a hundred times the largest report.
const LARGEST_TEXT: u64 = 256 << 20;

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
/// As [`open`]; [`Error::Io`] for bytes that are no text; [`Error::FormatNotRead`] above 256 MB.
pub fn read_text(path: &Path) -> Result<String> {
    let mut text = String::new();
    let io = |source| Error::Io { path: path.to_owned(), source };
    open(path)?.take(LARGEST_TEXT + 1).read_to_string(&mut text).map_err(io)?;
    if text.len() as u64 > LARGEST_TEXT {
        let (found, remedy) = ("a text of settings or results of more than 256 MB", "give the file that was meant");
        return Err(Error::FormatNotRead { path: path.to_owned(), found, remedy });
    }
    Ok(text)
}

/// The bytes of a file.
///
/// # Errors
/// As [`open`].
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    match open(path)?.read_to_end(&mut bytes) {
        Ok(_) => Ok(bytes),
        Err(source) => Err(Error::Io { path: path.to_owned(), source }),
    }
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
                bytes(Path::new(path)).map(|_| ()),
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
}
