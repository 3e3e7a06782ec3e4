//! Integration tests of the physical structures: the bearing of the paper in its loop, and measured machines.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod common;
mod demo;
mod drive;
mod emps;
mod hansen_pem;
mod templates;
