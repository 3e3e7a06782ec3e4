//! Tests of several crates together, and of what holds for the whole project. What one crate promises alone is tested in its folder, the program
//! in `crates/youla-cli/tests`.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod architecture;
mod common;
mod files;
mod method;
mod run;
mod running_loop;
mod structures;
