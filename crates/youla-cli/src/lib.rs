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

use clap::{CommandFactory, Parser};
use std::ffi::OsString;

/// The description of the command line, from which the example `manual` writes man page and completions.
pub fn command() -> clap::Command {
    args::Args::command()
}

/// Runs the program with these arguments, the first of them its name, and returns its exit code: 0; 1 where a check found a defect or a campaign stopped;
/// 2 for input that cannot be used; 3 for an impossible computation. Ctrl-C in `paper` and `study merge` ends the process with 130.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    let args = match args::Args::try_parse_from(args) {
        Ok(args) => args,
        Err(refusal) => {
            // Nobody reads a closed output.
            let _ = refusal.print();
            return u8::try_from(refusal.exit_code()).unwrap_or(2);
        }
    };
    match commands::run(&args) {
        Ok(true) => 0,
        Ok(false) => 1,
        Err(failure) => output::fail(&failure),
    }
}
