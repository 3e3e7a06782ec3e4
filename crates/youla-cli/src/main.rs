//! The program `youla`: from a closed-loop log to a trusted model.

use std::process::ExitCode;

fn main() -> ExitCode {
    youla_cli::run(std::env::args_os()).into()
}
