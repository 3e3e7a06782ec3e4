//! The choice of order, dead time and direct path: starts from long regressions, then models one step away.

pub(crate) mod dead_time;
pub(crate) mod deadline;
pub(crate) mod grow;

pub(crate) mod lines;
pub(crate) mod loads;
pub(crate) mod neighbours;
mod own_noise;
mod places;
pub(crate) mod problem;
pub(crate) mod resize;
mod rivals;
pub(crate) mod solve;
pub(crate) mod starts;
pub(crate) mod states;
mod unmoved;
pub(crate) mod unseen;
mod wide;
