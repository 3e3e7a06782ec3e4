//! The triangular factor of block-Hankel data, from their Gram matrix or by orthogonal reduction.

pub(crate) mod factorisation;
pub(crate) mod gram;
pub(crate) mod hankel_layout;
pub(crate) mod row_map;
