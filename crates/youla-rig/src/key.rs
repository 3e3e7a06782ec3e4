//! The file of a key.

use crate::{Error, Result};
use std::fs::{File, OpenOptions};
use std::io::{Error as IoError, ErrorKind, Read, Write};
use std::path::Path;
use youla_link::Key;

const BYTES: usize = 32;
/// No key is longer, whatever the file holds.
const MOST: u64 = 4096;

/// Reads a key: 64 hexadecimal digits, with white space around and between them.
///
/// # Errors
/// [`Error::Key`].
pub fn read_key(path: &Path) -> Result<Key> {
    let refused = |problem: String| Error::Key { path: path.to_owned(), problem };
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(MOST).read_to_string(&mut text));
    read.map_err(|e| refused(e.to_string()))?;
    let digits: Option<Vec<u8>> =
        text.chars().filter(|c| !c.is_whitespace()).map(|c| Some(c.to_digit(16)? as u8)).collect();
    let digits = digits.ok_or_else(|| refused("it holds other characters than hexadecimal digits".into()))?;
    let mut bytes = [0; BYTES];
    if digits.len() != 2 * BYTES {
        return Err(refused(format!("it has {} digits", digits.len())));
    }
    for (byte, pair) in bytes.iter_mut().zip(digits.chunks_exact(2)) {
        *byte = pair.iter().fold(0, |byte, digit| 16 * byte + digit);
    }
    Ok(Key::new(&bytes))
}

/// Makes a file with a new key from the random numbers of the operating system, for its owner only.
///
/// # Errors
/// [`Error::File`], also where there is such a file already.
pub fn write_key(path: &Path) -> Result<()> {
    let failed = |source| Error::File { path: path.to_owned(), source };
    let mut bytes = [0; BYTES];
    getrandom::fill(&mut bytes).map_err(|e| failed(IoError::other(e.to_string())))?;
    let text: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).map_err(|e| match e.kind() {
        ErrorKind::AlreadyExists => failed(IoError::new(
            e.kind(),
            "there is such a file already, which may be a key in use; choose another name",
        )),
        _ => failed(e),
    })?;
    writeln!(file, "{text}").map_err(failed)
}
