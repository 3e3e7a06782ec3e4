//! Everything that can go wrong with files of records and models, with the evidence.

use std::path::PathBuf;
use youla::ErrorKind;
use youla::error::Seconds;

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong, with the evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The method refused its input or its computation.
    #[error(transparent)]
    Method(#[from] youla::Error),
    /// Something failed in a part of a larger task.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `[controller]`.
        part: String,
        /// What failed.
        source: Box<Error>,
    },
    /// run.toml cannot be used.
    #[error("{}{}: {problem}", path.display(), position(*at))]
    Settings {
        /// Path of run.toml.
        path: PathBuf,
        /// Where, `None` where the file as a whole is meant.
        at: Option<TextPosition>,
        /// What is wrong, and the nearest known key for a misspelt one.
        problem: String,
    },
    /// The output folder holds something already.
    #[error("{} exists already and is not empty; choose another output folder or remove it", path.display())]
    OutputExists {
        /// The folder.
        path: PathBuf,
    },
    /// A file is there already.
    #[error("{} exists already; choose another file, or replace it with --force", path.display())]
    FileExists {
        /// The file.
        path: PathBuf,
    },
    /// A result cannot be written as JSON.
    #[error("the result cannot be written as JSON: {source}")]
    Json {
        /// The reason.
        source: serde_json::Error,
    },
    /// A file or folder holds no model that could be read or exported.
    #[error("{}: {problem}", path.display())]
    NotAModel {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The operating system refused to read or write a file.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// There is no such file.
    #[error("{}: no such file", path.display())]
    MissingFile {
        /// The file.
        path: PathBuf,
    },
    /// A file holds no samples.
    #[error("{}: {problem}", path.display())]
    NoData {
        /// The file.
        path: PathBuf,
        /// What is missing, for example "the file is empty (0 bytes)".
        problem: &'static str,
    },
    /// A cell of a text file is not a finite number.
    #[error("{}, line {line}, column {column}: {text:?} is not a finite number", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Name of the column, or `#` and its number.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A number of a text file is written with another decimal sign than the one that was declared.
    #[error(
        "{}, line {line}, column {column}: {text:?} has a decimal {found}, but the decimal sign is a {declared}; declare \
         decimal = \"{found}\" if all numbers of the file are written so",
        path.display()
    )]
    DecimalSign {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Name of the column, or `#` and its number.
        column: String,
        /// What stands there.
        text: String,
        /// The decimal sign that was declared, or the point by default.
        declared: &'static str,
        /// The decimal sign that the number has.
        found: &'static str,
    },
    /// The comma is declared both as delimiter and as decimal sign.
    #[error("{}: the comma cannot be both the delimiter and the decimal sign; declare another delimiter", path.display())]
    CommaTwice {
        /// The file.
        path: PathBuf,
    },
    /// A line of a text file has more or fewer fields than the first one.
    #[error("{}, line {line}: {found} fields, but the first line has {expected}", path.display())]
    RaggedRow {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// Fields on this line.
        found: usize,
        /// Fields on the first line.
        expected: usize,
    },
    /// The delimiter of a text file does not follow from its first line.
    #[error("{}, line {line}: the delimiter is not clear, the line holds {found}; state the delimiter", path.display())]
    Delimiter {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1 with comments and blank lines.
        line: usize,
        /// The candidates that were found, in words.
        found: String,
    },
    /// A file is damaged, cut off or not of the format it claims.
    #[error("{}, byte {offset}: expected {expected}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Position in the file, counted from 0.
        offset: u64,
        /// What should stand there.
        expected: String,
    },
    /// A gzip file is damaged or cut off.
    #[error("{}: the gzip file is damaged or cut off after line {line}: {source}", path.display())]
    CorruptGzip {
        /// The file.
        path: PathBuf,
        /// Last line, counted from 1, that could be unpacked.
        line: usize,
        /// What the decoder says.
        source: std::io::Error,
    },
    /// A file is of a format that this library does not read.
    #[error("{}: {found}, which is not read; {remedy}", path.display())]
    FormatNotRead {
        /// The file.
        path: PathBuf,
        /// The format that was found.
        found: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
    /// The channels of one record have different lengths.
    #[error("{what}: channel {channel:?} has {found} samples, the channels before it have {expected}")]
    UnequalLength {
        /// The record or file.
        what: String,
        /// The channel.
        channel: String,
        /// Its samples.
        found: usize,
        /// Samples of the other channels.
        expected: usize,
    },
    /// A variable of a file is not of the kind that is needed, or cannot be written.
    #[error("{}: {name} is {found}, but must be {must}", path.display())]
    WrongVariable {
        /// The file.
        path: PathBuf,
        /// The variable as it was asked for.
        name: String,
        /// What it is.
        found: String,
        /// What it must be.
        must: &'static str,
    },
    /// The time column is not uniform.
    #[error(
        "{what}: time is not uniform: row {row} (counted from 1) comes {} s after the one before, the sample time is {} s",
        Seconds(*dt), Seconds(*ts)
    )]
    NonUniformTime {
        /// The record or file.
        what: String,
        /// First row, counted from 1, whose distance from the row before is wrong.
        row: usize,
        /// That distance in seconds.
        dt: f64,
        /// The sample time in seconds.
        ts: f64,
    },
    /// Neither a sample time nor a time column was given.
    #[error("{what}: the sample time is not known; state it in seconds or name the time column")]
    SampleTimeMissing {
        /// The record or file.
        what: String,
    },
}

/// A stream of samples from a file gives the errors of the method.
impl From<Error> for youla::Error {
    fn from(error: Error) -> Self {
        match error {
            Error::Method(error) => error,
            error => youla::Error::Stream(Box::new(error)),
        }
    }
}

impl Error {
    /// The same error, said of a part of a larger task.
    pub fn within(self, part: impl Into<String>) -> Self {
        Error::Within { part: part.into(), source: Box::new(self) }
    }

    /// Whether the input is at fault or the computation is impossible on it.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Error::Method(source) => source.kind(),
            Error::Within { source, .. } => source.kind(),
            Error::Settings { .. }
            | Error::OutputExists { .. }
            | Error::FileExists { .. }
            | Error::NotAModel { .. }
            | Error::Io { .. }
            | Error::MissingFile { .. }
            | Error::NoData { .. }
            | Error::Cell { .. }
            | Error::DecimalSign { .. }
            | Error::CommaTwice { .. }
            | Error::RaggedRow { .. }
            | Error::Delimiter { .. }
            | Error::Corrupt { .. }
            | Error::CorruptGzip { .. }
            | Error::FormatNotRead { .. }
            | Error::UnequalLength { .. }
            | Error::WrongVariable { .. }
            | Error::NonUniformTime { .. }
            | Error::SampleTimeMissing { .. } => ErrorKind::BadInput,
            Error::Json { .. } => ErrorKind::Numerical,
        }
    }
}

/// A place in a text file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextPosition {
    /// Line, counted from 1.
    pub line: usize,
    /// Column, counted from 1.
    pub column: usize,
}

impl TextPosition {
    /// The place of byte `offset` of a text; columns count characters. An offset that is no place of the text is its
    /// end.
    pub fn of(text: &str, offset: usize) -> Self {
        let before = text.get(..offset).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        TextPosition { line, column: before.rsplit('\n').next().unwrap_or_default().chars().count() + 1 }
    }
}

/// `:line:column` where they are known.
fn position(at: Option<TextPosition>) -> String {
    at.map_or(String::new(), |p| format!(":{}:{}", p.line, p.column))
}
