//! The program `youla`: from a closed-loop log to a trusted model.

mod args;
mod commands;
mod output;
mod paper;
mod starts;
mod subspace;
mod table;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = args::Args::parse();
    match commands::run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => output::fail(&failure),
    }
}
