//! Integration tests of the running loop: redesigned controllers on the simulated rig, and the controller that runs in real time.
#![allow(missing_docs)]
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)]

mod check_rates;
#[path = "../../../youla/tests/all/common/systems.rs"]
mod common;
mod real_time;
mod redesign;
