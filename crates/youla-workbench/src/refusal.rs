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

macro_rules! of_a_run {
    ($($error:ty),*) => {$(
        impl From<$error> for Refusal {
            fn from(error: $error) -> Self {
                Refusal::Run(error.into())
            }
        }
    )*};
}

of_a_run!(youla::Error, youla_io::Error, youla_report::Error);

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
