//! Identification methods: the subspace family, and what is built on it.

pub mod direct;
mod evidence;
pub mod greybox;
pub mod hansen;
pub mod subspace;
