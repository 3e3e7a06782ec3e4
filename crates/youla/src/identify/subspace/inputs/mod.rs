//! B, D and the initial states for given A and C.

pub(crate) mod condense;
pub(crate) mod output_error;
pub(crate) mod sensitivity;
