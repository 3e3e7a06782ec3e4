//! The records of all experiments: checked, scaled, without delays, with known disturbances beside them.

pub(crate) mod channels;
pub(crate) mod delay;
pub(crate) mod disturbance;
pub(crate) mod experiment;
pub(crate) mod statistics;
pub(crate) mod view;
