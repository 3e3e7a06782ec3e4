//! Everything that can go wrong with reports, with the evidence.

use youla::ErrorKind;

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
    /// The data of a report cannot be written as JSON.
    #[error("the data of the report cannot be written as JSON: {source}")]
    ReportData {
        /// The reason.
        source: serde_json::Error,
    },
    /// The page of a report cannot be written.
    #[error("the page of the report cannot be written: {source}")]
    ReportTemplate {
        /// The reason.
        source: minijinja::Error,
    },
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
            Error::ReportData { .. } | Error::ReportTemplate { .. } => ErrorKind::Numerical,
        }
    }
}
