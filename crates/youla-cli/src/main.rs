//! The program `youla`: from a closed-loop log to a trusted model.

mod args;
mod check;
mod commands;
mod compare;
mod demo;
mod dialect;
mod excite;
mod export;
mod identify;
mod init;
mod log_flags;
mod manual;
mod output;
mod paper;
mod plot;
mod raster;
mod run_folder;
mod study;
mod subspace;
mod table;
mod terminal;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = args::Args::parse();
    match commands::run(&args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(failure) => output::fail(&failure),
    }
}
