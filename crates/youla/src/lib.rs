//! Closed-loop identification without opening the loop.

pub mod control;
pub mod error;
pub mod factor;
pub mod identify;
pub mod linalg;
pub mod lti;
pub mod record;
pub mod reduce;
pub mod report;
pub mod rig;
pub mod run;
pub mod study;
pub mod units;
pub mod validate;

pub use error::{Error, ErrorKind, Result};
pub use faer::{Mat, MatRef, c64};
