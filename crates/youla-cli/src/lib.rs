//! The program `youla`: from a closed-loop log to a trusted model. A library, so that the Python package holds the program too.

mod args;
mod check;
mod commands;
mod commission;
mod compare;
mod excite;
mod export;
mod identify;
mod init;
mod interrupt;
mod log_flags;
mod output;
mod paper;
mod plot;
mod progress;
mod rig;
mod run_folder;
mod synchronise;
mod table;
mod terminal;
mod workbench;

pub use output::Failure;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser};
use std::ffi::OsString;
use std::io::Write;

/// The description of the command line, from which the example `manual` writes man page and completions.
pub fn command() -> clap::Command {
    args::Args::command()
}

/// Runs the program with these arguments, the first of them its name, and returns its exit code: 0; 1 where a check found a defect or a campaign stopped;
/// 2 for input that cannot be used; 3 for an impossible computation. Ctrl-C in `paper` and `study merge` ends the process with 130.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let given: Vec<OsString> = args.into_iter().collect();
    let args = match args::Args::try_parse_from(&given) {
        Ok(args) => args,
        Err(refusal) => {
            // Nobody reads a closed output.
            let _ = refusal.print();
            if let Some(hint) = hint(&refusal, &given) {
                let _ = writeln!(terminal::stderr(), "\n{hint}");
            }
            return u8::try_from(refusal.exit_code()).unwrap_or(2);
        }
    };
    match commands::run(&args) {
        Ok(true) => 0,
        Ok(false) => 1,
        Err(failure) => output::fail(&failure),
    }
}

/// Where a flag that is none is set, and which is meant by one that serves a log only.
fn hint(refusal: &clap::Error, given: &[OsString]) -> Option<String> {
    match (refusal.kind(), refusal.get(ContextKind::InvalidArg)) {
        (ErrorKind::UnknownArgument, Some(ContextValue::String(flag))) => {
            let key = flag.trim_start_matches('-').replace('-', "_");
            let tables = youla_run::tables_with(&key);
            let hint = format!("`{key}` is a key of {tables} in run.toml, which `youla init` writes for a log");
            (!tables.is_empty()).then_some(hint)
        }
        (ErrorKind::MissingRequiredArgument, _) if given.iter().any(|arg| arg == "--output") => {
            Some("--output names a measured output of a log; --out is the folder of the run".into())
        }
        _ => None,
    }
}
