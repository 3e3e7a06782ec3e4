//! Standard output, progress on the terminal, and how failures end the program.

use crate::terminal;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::path::Path;
use std::time::Duration;
use youla::ErrorKind;
use youla_run::{ReadingProgress, Stage};

/// How results are printed.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Form {
    /// Print nothing but errors.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Print the result as JSON instead of a table; of a run, the contents of summary.json.
    #[arg(long, global = true, conflicts_with = "quiet")]
    pub(crate) json: bool,
}

/// Why the program ends early.
#[derive(Debug)]
pub enum Failure {
    /// A crate refused: its sentence and what kind of failure it is.
    Refused(String, ErrorKind),
    /// Nobody reads the output any more.
    OutputClosed,
}

impl Failure {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        youla_io::Error::Io { path: path.to_owned(), source }.into()
    }
}

macro_rules! refused {
    ($($error:ty),*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Failure::Refused(error.to_string(), error.kind())
            }
        }
    )*};
}

refused!(youla::Error, youla_commission::Error, youla_io::Error, youla_paper::Error, youla_run::Error);

/// Prints one sentence and gives the exit code: 2 for input that cannot be used, 3 for an impossible computation.
pub(crate) fn fail(failure: &Failure) -> u8 {
    match failure {
        Failure::OutputClosed => 0,
        Failure::Refused(sentence, kind) => {
            // Without standard error the progress is not shown.
            let _ = writeln!(std::io::stderr(), "{} {}", terminal::error_word(), shown(sentence));
            match kind {
                ErrorKind::BadInput => 2,
                ErrorKind::Numerical => 3,
            }
        }
    }
}

/// Names come from files: what would command the terminal or turn the direction of the text is written as `\u001b`, as in JSON.
pub(crate) fn shown(text: &str) -> String {
    let commands = |c: char| {
        let turns =
            matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        turns || (c.is_control() && !matches!(c, '\n' | '\t'))
    };
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if commands(c) { out.push_str(&format!("\\u{:04x}", u32::from(c))) } else { out.push(c) }
    }
    out
}

/// Prints text for people: words wrapped at the width of the terminal, and colour where there is one.
pub(crate) fn say_wrapped(text: &str) -> Result<(), Failure> {
    print(&terminal::shown(&shown(text)))
}

/// Prints a line to standard output.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    print(&shown(text))
}

fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}").and_then(|()| out.flush()).map_err(|e| match e.kind() {
        std::io::ErrorKind::BrokenPipe => Failure::OutputClosed,
        _ => Failure::io(Path::new("standard output"), e),
    })
}

/// Prints a question and leaves the cursor behind it.
pub(crate) fn ask_line(question: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    write!(out, "{question}: ").and_then(|()| out.flush()).map_err(|e| Failure::io(Path::new("the terminal"), e))
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

#[cfg(test)]
mod tests {
    use super::shown;

    #[test]
    fn nothing_commands_the_terminal() {
        assert_eq!(shown("a\u{1b}[2Jb\r\n\tc \u{202e}d\u{9b}"), "a\\u001b[2Jb\\u000d\n\tc \\u202ed\\u009b");
        assert_eq!(shown("täglich 5 µm – gut"), "täglich 5 µm – gut");
    }
}
