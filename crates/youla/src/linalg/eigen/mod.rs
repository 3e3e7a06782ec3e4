//! Schur forms, eigenvalues and eigenvectors.

pub(crate) mod balance;
pub(crate) mod bulge_chasing;
pub(crate) mod complex_eigenvalues;
pub(crate) mod complex_schur;
pub(crate) mod eigenvectors;
pub(crate) mod francis;
pub(crate) mod hessenberg;
pub(crate) mod reflector;
pub(crate) mod reorder;
pub(crate) mod schur;
pub(crate) mod shifts;
