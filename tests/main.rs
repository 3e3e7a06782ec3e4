//! Integration tests of the files: readers, exports, and the examples on measured data.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

#[path = "../../../youla/tests/all/common/systems.rs"]
mod common;
mod exports;
mod readers;
mod real_data;
