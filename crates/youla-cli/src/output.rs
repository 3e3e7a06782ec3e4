//! Standard output, progress on the terminal, and how failures end the program.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;
use youla::run::{ReadingProgress, Stage};
use youla::{Error, ErrorKind};

/// Why the program ends early.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The library refused.
    Library(Error),
    /// Nobody reads the output any more.
    OutputClosed,
}

impl Failure {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Failure::Library(Error::Io { path: path.to_owned(), source })
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Failure::Library(error)
    }
}

/// Prints one sentence and gives the exit code: 2 for input that cannot be used, 3 for an impossible computation.
pub(crate) fn fail(failure: &Failure) -> ExitCode {
    match failure {
        Failure::OutputClosed => ExitCode::SUCCESS,
        Failure::Library(error) => {
            // Without standard error there is nobody to tell.
            let _ = writeln!(std::io::stderr(), "error: {error}");
            match error.kind() {
                ErrorKind::BadInput => ExitCode::from(2),
                ErrorKind::Numerical => ExitCode::from(3),
            }
        }
    }
}

/// Prints a line to standard output.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}").and_then(|()| out.flush()).map_err(|e| match e.kind() {
        std::io::ErrorKind::BrokenPipe => Failure::OutputClosed,
        _ => Failure::io(Path::new("standard output"), e),
    })
}

/// One bar over the stages, on a terminal only.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    pub(crate) fn new(hidden: bool) -> Self {
        let bar = if hidden { ProgressBar::hidden() } else { ProgressBar::new(Stage::ALL.len() as u64) };
        if let Ok(style) = ProgressStyle::with_template("{spinner} [{pos}/{len}] {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Progress(bar)
    }

    pub(crate) fn stage(&self, stage: Stage) {
        let position = Stage::ALL.iter().position(|s| *s == stage).unwrap_or_default();
        self.0.set_position(position as u64 + 1);
        self.0.set_message(stage.name());
    }

    pub(crate) fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Samples read so far, on a terminal only.
pub(crate) struct Reading(ProgressBar);

impl Reading {
    pub(crate) fn new(hidden: bool) -> Self {
        let bar = if hidden { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {human_pos} samples ({elapsed})") {
            bar.set_style(style);
        }
        Reading(bar)
    }

    pub(crate) fn at(&self, at: ReadingProgress) {
        self.0.set_message(format!("pass {}:", at.pass));
        self.0.set_position(at.samples);
    }

    pub(crate) fn finish(&self) {
        self.0.finish_and_clear();
    }
}
