//! What belongs to a running loop: the check of its data, its excitation and the redesign of its controller.

pub mod check;
mod error;
pub mod excite;
pub mod redesign;

pub use error::{Error, Result};
