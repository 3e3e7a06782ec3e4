//! Why a request has no answer.

use std::path::Path;
use youla::ErrorKind;

/// Why a request has no answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Refusal {
    #[error(transparent)]
    Run(#[from] youla_run::Error),
    #[error("{0}")]
    Text(String),
}

pub(crate) type Result<T> = std::result::Result<T, Refusal>;

impl From<youla::Error> for Refusal {
    fn from(error: youla::Error) -> Self {
        Refusal::Run(error.into())
    }
}

impl From<youla_io::Error> for Refusal {
    fn from(error: youla_io::Error) -> Self {
        Refusal::Run(error.into())
    }
}

impl From<youla_report::Error> for Refusal {
    fn from(error: youla_report::Error) -> Self {
        Refusal::Run(error.into())
    }
}

impl From<serde_json::Error> for Refusal {
    fn from(error: serde_json::Error) -> Self {
        Refusal::Text(error.to_string())
    }
}

impl Refusal {
    pub(crate) fn at(path: &Path, source: std::io::Error) -> Self {
        youla_io::Error::Io { path: path.to_owned(), source }.into()
    }

    /// As the exit code of the program: 2 for input that cannot be used, 3 for an impossible computation.
    pub(crate) fn exit(&self) -> u8 {
        match self {
            Refusal::Run(error) if error.kind() == ErrorKind::Numerical => 3,
            _ => 2,
        }
    }
}
