//! The program as users run it.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod book;
mod browser;
mod check;
mod cli;
mod common;
mod contract;
mod demo;
mod examples;
mod paper;
mod reference;
mod schema;
