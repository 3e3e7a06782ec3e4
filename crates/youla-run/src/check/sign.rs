//! The sign of the feedback where nobody states it: it is never guessed, but the log may show which of the two it was.

use super::{DataCheck, check_run};
use crate::settings::{Feedback, RunSettings};
use crate::{Error, Result};
use std::path::Path;
use youla_loop::check::{Finding, Severity, Test};

/// With which sign the controller explains the logged inputs, as the end of a message; `check` gives the check of the data for a sign.
pub fn agreement(check: impl Fn(Feedback) -> Option<DataCheck>) -> &'static str {
    let explains = |sign: Feedback| {
        let contradicts = |f: &Finding| f.test == Test::Controller && f.severity == Severity::Defect;
        check(sign).map(|found| !found.findings.iter().any(contradicts))
    };
    match [explains(Feedback::Negative), explains(Feedback::Positive)] {
        // More is wrong than the sign: nothing could be compared.
        [None, None] => "",
        [Some(true), None | Some(false)] => "; the log agrees with negative",
        [None | Some(false), Some(true)] => "; the log agrees with positive",
        _ => "; the log agrees with both or neither",
    }
}

/// [`RunSettings::read`] for a run: where `[controller]` lacks `feedback`, the message says with which sign the log agrees.
///
/// # Errors
/// Those of [`RunSettings::read`].
pub fn read_settings(path: &Path) -> Result<RunSettings> {
    RunSettings::read(path).map_err(|error| match youla_io::read_text(path) {
        Ok(text) => with_agreement(error, &text, path),
        Err(_) => error,
    })
}

/// The same for the text of a run.toml; `path` is named in errors, and its folder is that of the files.
///
/// # Errors
/// Those of [`RunSettings::parse`].
pub fn parse_settings(text: &str, path: &Path) -> Result<RunSettings> {
    RunSettings::parse(text, path).map_err(|error| with_agreement(error, text, path))
}

fn with_agreement(error: Error, text: &str, path: &Path) -> Error {
    let Error::File(youla_io::Error::Settings { path: file, at, problem }) = error else { return error };
    let shown = RunSettings::without_feedback(text).map_or("", |with| {
        let folder = path.parent().unwrap_or(Path::new(""));
        agreement(|sign| check_run(&with(sign)?, folder).ok())
    });
    Error::File(youla_io::Error::Settings { path: file, at, problem: problem + shown })
}
