//! The data lines of a text file with their line numbers, through gzip for a compressed file.

use crate::error::{CorruptAt, Error, Result};
use crate::open::open;
use flate2::bufread::MultiGzDecoder;
use std::collections::HashSet;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
const BUFFER: usize = 1 << 17;
/// Bytes that are unpacked behind an error to see whether the file is damaged: seconds.
const MOST_UNPACKED: u64 = 1 << 30;
/// Longest line, bytes: 64 for each of the 65536 columns that a file may have.
const LONGEST_LINE: u64 = 4 << 20;

/// Reads line by line, so that a file that unpacks to more than the memory is met by its first bad line.
pub(super) struct Lines {
    path: PathBuf,
    reader: Box<dyn BufRead + Send>,
    gzip: bool,
    line: Vec<u8>,
    number: usize,
    /// The next call of [`Lines::advance`] returns the current line again.
    held: bool,
    /// Numbers of lines to pass over.
    skip: HashSet<usize>,
    /// The first lines that were passed over, without their mark: one of them may state units.
    passed: Vec<Vec<u8>>,
}

/// Lines that are kept of those that were passed over; units stand near the names.
const MOST_PASSED: usize = 16;

/// First bytes of logs of machines, which the Python package reads.
const LOGGERS: [(&[u8], &str); 6] = [
    (b"ULog\x01", "a ULog of PX4"),
    (b"H Product:Blackbox", "a Betaflight blackbox"),
    (b"\xa3\x95", "a log of ArduPilot"),
    (b"WPILOG", "a data log of WPILib"),
    (b"MDF  ", "an ASAM MDF file"),
    (b"TDSm", "a TDMS file of LabVIEW"),
];
const OF_LOGGERS: &str = "read it in Python by youla.Channels.read(path), or export it as text and bring its channels to one clock by \
                          `youla synchronise`";

impl Lines {
    pub(super) fn open(path: &Path) -> Result<Lines> {
        Self::over(path, BufReader::with_capacity(BUFFER, open(path)?))
    }

    /// The lines of a file or of bytes in memory; `path` is named in errors.
    pub(super) fn over(path: &Path, mut file: impl BufRead + Send + 'static) -> Result<Lines> {
        let start = file.fill_buf().map_err(|source| Error::Io { path: path.to_owned(), source })?;
        if start.is_empty() {
            return Err(Error::NoData { path: path.to_owned(), problem: "the file is empty (0 bytes)" });
        }
        if let Some((_, found)) = LOGGERS.iter().find(|(magic, _)| start.starts_with(magic)) {
            return Err(Error::FormatNotRead { path: path.to_owned(), found, remedy: OF_LOGGERS });
        }
        if start.starts_with(b"PK\x03\x04") {
            let (found, remedy) = ("a zip archive or an Excel workbook", "give the log in it as text");
            return Err(Error::FormatNotRead { path: path.to_owned(), found, remedy });
        }
        let gzip = start.starts_with(&GZIP_MAGIC);
        Ok(Lines {
            path: path.to_owned(),
            reader: unpacked(file, gzip),
            gzip,
            line: Vec::new(),
            number: 0,
            held: false,
            skip: HashSet::new(),
            passed: Vec::new(),
        })
    }

    /// Passes over these lines, counted from 1.
    pub(super) fn skip(&mut self, lines: &[usize]) {
        self.skip = lines.iter().copied().collect();
    }

    /// The first lines that were passed over.
    pub(super) fn passed(&self) -> &[Vec<u8>] {
        &self.passed
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The error of the rest of a gzip file, if it cannot be unpacked to its end or its checksum is wrong.
    pub(super) fn damage(&mut self) -> Option<Error> {
        let line = self.number;
        let rest = if self.gzip {
            std::io::copy(&mut (&mut self.reader).take(MOST_UNPACKED), &mut std::io::sink())
        } else {
            Ok(0)
        };
        rest.err().map(|source| read_error(&self.path, self.gzip, line, source))
    }

    /// Number of the current line, counted from 1.
    pub(super) fn number(&self) -> usize {
        self.number
    }

    /// The current line without its end; a tab at its end may close an empty cell and stays.
    pub(super) fn current(&self) -> &[u8] {
        let line = self.line.strip_suffix(b"\n").unwrap_or(&self.line);
        line.strip_suffix(b"\r").unwrap_or(line)
    }

    /// Hands out the current line once more at the next [`Lines::advance`].
    pub(super) fn hold(&mut self) {
        self.held = true;
    }

    /// Goes to the next line that is neither blank nor a comment; false at the end.
    pub(super) fn advance(&mut self) -> Result<bool> {
        if std::mem::take(&mut self.held) {
            return Ok(true);
        }
        loop {
            self.line.clear();
            let read = (&mut self.reader).take(LONGEST_LINE + 1).read_until(b'\n', &mut self.line);
            let read = read.map_err(|source| read_error(&self.path, self.gzip, self.number, source))?;
            if read == 0 {
                return Ok(false);
            }
            if read as u64 > LONGEST_LINE {
                let (found, remedy) = ("a line of more than 4 MB", "give text with one row of numbers a line");
                return Err(Error::FormatNotRead { path: self.path.clone(), found, remedy });
            }
            self.number += 1;
            if self.number == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
                self.line.drain(..3);
            }
            let text = self.line.trim_ascii();
            // A first line `sep=;` states the delimiter to spreadsheets; the line of names has it too.
            let of_spreadsheet = || (self.number == 1 && text.len() == 5).then(|| text.strip_prefix(b"sep=")).flatten();
            let note = text.strip_prefix(b"#").or_else(|| text.strip_prefix(b"%")).or_else(of_spreadsheet);
            if note.is_none() && !text.is_empty() && !self.skip.contains(&self.number) {
                return Ok(true);
            }
            if self.passed.len() < MOST_PASSED {
                self.passed.push(note.unwrap_or(text).to_vec());
            }
        }
    }
}

fn unpacked(file: impl BufRead + Send + 'static, gzip: bool) -> Box<dyn BufRead + Send> {
    if gzip { Box::new(BufReader::with_capacity(BUFFER, MultiGzDecoder::new(file))) } else { Box::new(file) }
}

fn read_error(path: &Path, gzip: bool, line: usize, source: std::io::Error) -> Error {
    let damaged = matches!(source.kind(), ErrorKind::InvalidInput | ErrorKind::InvalidData | ErrorKind::UnexpectedEof);
    if gzip && damaged {
        let expected = format!("an undamaged gzip file up to its end ({source})");
        Error::Corrupt { path: path.to_owned(), at: CorruptAt::Line(line), expected }
    } else {
        Error::Io { path: path.to_owned(), source }
    }
}
