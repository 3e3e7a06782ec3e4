//! The program `youla`: from a closed-loop log to a trusted model.

use std::process::ExitCode;

// The allocator of musl takes two to three times as long for a run.
#[cfg(target_env = "musl")]
#[global_allocator]
static ALLOCATOR: dlmalloc::GlobalDlmalloc = dlmalloc::GlobalDlmalloc;

fn main() -> ExitCode {
    youla_cli::run(std::env::args_os()).into()
}
