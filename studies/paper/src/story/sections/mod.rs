//! The sections of the page, each from the results of the paper.

pub(super) mod experiments;
pub(super) mod rig;
pub(super) mod settings;
pub(super) mod study;
pub(super) mod timing;
