//! The stages of a run: what is computed, from records and loop to models with evidence. A stage knows nothing of how it is shown.

pub(crate) mod certificate;
pub(crate) mod clock;
pub(crate) mod context;
pub(crate) mod direct;
pub(crate) mod factors;
pub(crate) mod grey_box;
pub(crate) mod hansen;
pub(crate) mod nonparametric;
pub(crate) mod parts;
pub(crate) mod pipeline;
pub(crate) mod recommend;
pub(crate) mod redesign;
pub(crate) mod reduction;
pub(crate) mod responses;
pub(crate) mod signals;
pub(crate) mod uncertainty;
pub(crate) mod validate;
