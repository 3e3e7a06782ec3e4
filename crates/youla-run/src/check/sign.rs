//! The sign of the feedback where nobody states it: it is never guessed, but the log may show which of the two it was.

use super::{DataCheck, check_run};
use crate::settings::{Feedback, RunSettings};
use crate::{Error, Result};
use std::path::Path;
use youla_loop::check::{Severity, Test};

/// The sign with which the controller explains the logged inputs, where it does so with one of them only; `check` gives the check of the
/// data for a sign.
pub fn agreeing_feedback(check: impl Fn(Feedback) -> Option<DataCheck>) -> Option<Feedback> {
    let explains = |sign: Feedback| {
        let contradicts = |f: &youla_loop::check::Finding| f.test == Test::Controller && f.severity == Severity::Defect;
        check(sign).is_some_and(|found| !found.findings.iter().any(contradicts))
    };
    match [explains(Feedback::Negative), explains(Feedback::Positive)] {
        [true, false] => Some(Feedback::Negative),
        [false, true] => Some(Feedback::Positive),
        _ => None,
    }
}

/// What a message says of [`agreeing_feedback`].
pub fn agreement(found: Option<Feedback>) -> &'static str {
    match found {
        Some(Feedback::Negative) => "; the log agrees with negative",
        Some(Feedback::Positive) => "; the log agrees with positive",
        None => "; the log does not tell which",
    }
}

/// [`RunSettings::read`] for a run: where `[controller]` lacks `feedback`, the message says with which sign the log agrees.
///
/// # Errors
/// Those of [`RunSettings::read`].
pub fn read_settings(path: &Path) -> Result<RunSettings> {
    RunSettings::read(path).map_err(|error| {
        let Error::File(youla_io::Error::Settings { path: file, at, problem }) = error else { return error };
        let with = youla_io::read_text(path).ok().and_then(|text| RunSettings::without_feedback(&text));
        let shown = with.map_or("", |with| {
            let folder = path.parent().unwrap_or(Path::new(""));
            agreement(agreeing_feedback(|sign| check_run(&with(sign)?, folder).ok()))
        });
        Error::File(youla_io::Error::Settings { path: file, at, problem: problem + shown })
    })
}
