//! What the program prints, and how failures end it.

use crate::terminal;
use clap::Args;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use youla::ErrorKind;

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

impl Form {
    /// Whether nobody reads words: neither text nor progress is shown.
    pub(crate) fn is_silent(self) -> bool {
        self.quiet || self.json
    }

    /// Prints a result, in the form that was asked for.
    pub(crate) fn print(self, json: impl FnOnce() -> Value, text: impl FnOnce() -> String) -> Result<(), Failure> {
        match (self.json, self.quiet) {
            (true, _) => say(&json().to_string()),
            (_, true) => Ok(()),
            _ => print(&terminal::shown(&sanitised(&text()))),
        }
    }
}

/// Paths, one on each line.
pub(crate) fn lines_of(paths: &[PathBuf]) -> String {
    paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join("\n")
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

refused!(
    youla::Error,
    youla_commission::Error,
    youla_io::Error,
    youla_paper::Error,
    youla_run::Error,
    youla_twin::Error
);

/// Prints one sentence and gives the exit code: 2 for input that cannot be used, 3 for an impossible computation.
pub(crate) fn fail(failure: &Failure) -> u8 {
    match failure {
        Failure::OutputClosed => 0,
        Failure::Refused(sentence, kind) => {
            // Without standard error the progress is not shown.
            let _ = writeln!(terminal::stderr(), "{} {}", terminal::error_word(), sanitised(sentence));
            match kind {
                ErrorKind::BadInput => 2,
                ErrorKind::Numerical => 3,
            }
        }
    }
}

/// Names come from files: what would command the terminal or turn the direction of the text is written as `\u001b`, as in JSON.
pub(crate) fn sanitised(text: &str) -> String {
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

/// Prints text as it is to standard output.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    print(&sanitised(text))
}

/// Prints a file that a command has written.
pub(crate) fn say_file(path: &Path) -> Result<(), Failure> {
    say(youla_io::read_text(path)?.trim_end())
}

fn print(text: &str) -> Result<(), Failure> {
    let mut out = terminal::stdout();
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

#[cfg(test)]
mod tests {
    use super::sanitised;

    #[test]
    fn nothing_commands_the_terminal() {
        assert_eq!(sanitised("a\u{1b}[2Jb\r\n\tc \u{202e}d\u{9b}"), "a\\u001b[2Jb\\u000d\n\tc \\u202ed\\u009b");
        assert_eq!(sanitised("täglich 5 µm – gut"), "täglich 5 µm – gut");
    }
}
