//! Runs from settings to the folder of results.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod common;
mod controllers;
mod models;
mod readings;
mod settings;
