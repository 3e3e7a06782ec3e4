//! The criterion, its minimum within bounds, and what the data determine there.

pub(crate) mod bounds;
pub(crate) mod cost;
pub(crate) mod criterion;
pub(crate) mod estimate;
pub(crate) mod fit;
pub(crate) mod identifiability;
pub(crate) mod levenberg;
pub(crate) mod uncertainty;
