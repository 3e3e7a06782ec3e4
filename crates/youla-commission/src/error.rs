//! The errors of a campaign.

use std::path::PathBuf;

/// Result of every fallible function of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of a campaign, with its evidence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The method rejected its input, or a computation failed.
    #[error(transparent)]
    Method(#[from] youla::Error),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] youla_io::Error),
    /// The redesign was impossible.
    #[error(transparent)]
    Loop(#[from] youla_loop::Error),
    /// The identification was impossible.
    #[error(transparent)]
    Run(#[from] youla_run::Error),
    /// The twin was impossible.
    #[error(transparent)]
    Twin(youla_twin::Error),
    /// The page could not be made.
    #[error(transparent)]
    Report(#[from] youla_report::Error),
    /// The connection of a twin failed.
    #[error(transparent)]
    Connection(#[from] youla_rig::Error),
    /// A part of a larger task failed.
    #[error("{part}: {source}")]
    Within {
        /// The part, in the words of the user, for example `2500 rpm`.
        part: String,
        /// What failed.
        source: Box<Error>,
    },
    /// The campaign cannot be run as it is written.
    #[error("{}: {problem}", path.display())]
    Campaign {
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
    /// There is no new controller to switch to.
    #[error("{reason}")]
    Refused {
        /// Why.
        reason: String,
    },
}

/// There is nothing to switch to, for this reason.
///
/// # Errors
/// [`Error::Refused`], always.
pub(crate) fn refuse<T>(reason: String) -> Result<T> {
    Err(Error::Refused { reason })
}

pub(crate) fn failed(problem: &str) -> Error {
    Error::Controller { problem: problem.into() }
}

impl From<youla_twin::Error> for Error {
    fn from(error: youla_twin::Error) -> Self {
        match error {
            youla_twin::Error::Controller { problem } => Error::Controller { problem },
            youla_twin::Error::File(source) => Error::File(source),
            other => Error::Twin(other),
        }
    }
}

youla::error_context! {
    sources: Method File Loop Run Twin Report;
    numerical: Controller Refused;
    bad_input: Campaign Connection;
}
