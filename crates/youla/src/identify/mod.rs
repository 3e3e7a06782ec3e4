//! Identification methods: the subspace family, and what is built on it.

pub mod direct;
pub mod fit;
pub mod hansen;
pub mod innovation_form;
pub mod likelihood;
pub mod subspace;
