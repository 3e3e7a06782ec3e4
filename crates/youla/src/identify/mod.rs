//! Identification methods: the subspace family, and what is built on it.

pub mod direct;
mod fit;
pub mod greybox;
pub mod hansen;
pub mod hansen_pem;
pub mod hansen_refine;
pub mod innovation_form;
pub(crate) mod projected_pem;
pub mod refine;
pub mod subspace;
pub mod subspace_pem;
