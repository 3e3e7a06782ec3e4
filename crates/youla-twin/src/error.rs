//! The errors of a simulated machine and its loop, with the evidence.

use std::path::PathBuf;

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of a simulated machine or its loop, with its evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The method rejected its input, or a computation failed.
    #[error(transparent)]
    Method(#[from] youla::Error),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] youla_io::Error),
    /// The settings of a loop could not be realised.
    #[error(transparent)]
    Run(#[from] youla_run::Error),
    /// The connection of a twin failed.
    #[error(transparent)]
    Connection(#[from] youla_rig::Error),
    /// The loop of a file cannot run as it is described.
    #[error("{}: {problem}", path.display())]
    Loop {
        /// The file.
        path: PathBuf,
        /// What is wrong, and the remedy.
        problem: String,
    },
    /// The controller does not do what it was asked for.
    #[error("the controller {problem}")]
    Controller {
        /// What it did.
        problem: String,
    },
}

impl Error {
    /// Whether the input is invalid or a computation failed.
    pub fn kind(&self) -> youla::ErrorKind {
        match self {
            Error::Method(source) => source.kind(),
            Error::File(source) => source.kind(),
            Error::Run(source) => source.kind(),
            Error::Controller { .. } => youla::ErrorKind::Numerical,
            Error::Loop { .. } | Error::Connection(_) => youla::ErrorKind::BadInput,
        }
    }
}

/// The controller does not do what it was asked for.
pub(crate) fn failed(problem: &str) -> Error {
    Error::Controller { problem: problem.into() }
}
