//! Runs from settings to the folder of results.

mod common;
mod factors;
mod models;
mod settings;
