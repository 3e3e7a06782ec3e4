//! What the method promises by itself. With the bearing, with files and in runs it is tested in `tests/`.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod architecture;
mod common;
mod likelihood;
mod random_loops;
