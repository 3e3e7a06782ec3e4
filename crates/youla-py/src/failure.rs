//! Errors of the library as Python exceptions with the library's message.

use pyo3::prelude::*;
use std::path::Path;
use youla::ErrorKind;

/// Path under which options of Python are parsed: their errors name no file.
pub(crate) const OPTIONS: &str = "options";

/// Why a call fails.
#[derive(Debug)]
pub(crate) struct Failure {
    kind: ErrorKind,
    message: String,
    /// Whether a file is meant: then the words of run.toml are the right ones.
    of_file: bool,
}

pub(crate) type Result<T, E = Failure> = std::result::Result<T, E>;

impl Failure {
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Failure { kind: ErrorKind::BadInput, message: message.into(), of_file: false }
    }

    pub(crate) fn numerical(message: impl Into<String>) -> Self {
        Failure { kind: ErrorKind::Numerical, message: message.into(), of_file: false }
    }

    pub(crate) fn of_file(self) -> Self {
        Failure { of_file: true, ..self }
    }
}

macro_rules! refused {
    ($($error:ty),*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Failure { kind: error.kind(), message: error.to_string(), of_file: false }
            }
        }
    )*};
}

refused!(youla::Error, youla_greybox::Error, youla_loop::Error, youla_report::Error, youla_twin::Error);

impl From<youla_io::Error> for Failure {
    fn from(error: youla_io::Error) -> Self {
        let message = match &error {
            youla_io::Error::Settings { path, problem, .. } if path == Path::new(OPTIONS) => problem.clone(),
            youla_io::Error::Unwritable { path, source } => {
                format!("{}: results cannot be written there ({source}); choose another place", path.display())
            }
            other => other.to_string(),
        };
        let of_file = matches!(&error, youla_io::Error::Settings { path, .. } if path != Path::new(OPTIONS));
        Failure { kind: error.kind(), message, of_file }
    }
}

impl From<youla_run::Error> for Failure {
    fn from(error: youla_run::Error) -> Self {
        match error {
            youla_run::Error::File(of_file) => of_file.into(),
            other => Failure { kind: other.kind(), message: other.to_string(), of_file: false },
        }
    }
}

impl From<serde_json::Error> for Failure {
    fn from(error: serde_json::Error) -> Self {
        Failure::input(format!("this is no JSON that the package wrote: {error}"))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        let class = match failure.kind {
            ErrorKind::BadInput => "InputError",
            ErrorKind::Numerical => "NumericalError",
        };
        Python::attach(|py| {
            let words = |told: String| match failure.of_file {
                true => Ok(told),
                false => py.import("youla._options")?.getattr("in_python")?.call1((told,))?.extract(),
            };
            let told = words(failure.message);
            let raised = told.and_then(|told| py.import("youla._errors")?.getattr(class)?.call1((told,)));
            raised.map_or_else(|error| error, PyErr::from_value)
        })
    }
}
