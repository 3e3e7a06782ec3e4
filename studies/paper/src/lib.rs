//! The paper as a computation: its study and its experiments on the bearing of `youla-twin`, every figure, table and claim.

mod error;
pub mod run;
pub mod story;
pub mod study;

pub use error::{Error, Result};
