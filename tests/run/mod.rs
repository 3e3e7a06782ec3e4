//! Runs on the demonstrations.

mod factors;
