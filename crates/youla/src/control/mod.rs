//! Controllers and the loops that they close.

mod closed_loop;
mod observer_controller;

pub use closed_loop::{closed_loop, with_input_port};
pub use observer_controller::observer_controller;
