//! Evidence for or against a model: fit, variance accounted for, loop certificate, prediction on fresh data.

mod certificate;
mod fit;

pub use certificate::{LoopCertificate, certify};
pub use fit::{fit, vaf};
