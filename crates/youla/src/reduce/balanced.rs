//! Balancing-free square-root projection: A. Varga, Efficient minimal realization procedure based on balancing, IMACS
//! Symposium MCTS, Lille, 1991.
//!
//! With the Gramians `P = S S'`, `Q = R R'` and `R' S = U diag(sigma) V'`, the columns of `S V` and `R U` span the balanced
//! coordinates and their duals. Orthonormal bases X and Z of those that are kept give the projection
//! `(Z'X)^-1 Z' A X`; the ill-conditioned balancing transformation itself is never formed.

use crate::linalg::{discrete_gramian_factor, gramian_factor, solve};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// Hankel singular values of a system and the directions that belong to them.
pub(super) struct HankelDecomposition<'a, T: TimeDomain> {
    system: &'a StateSpace<T>,
    /// In descending order.
    pub(super) hankel: Vec<f64>,
    /// `S V`, n x n.
    right: Mat<f64>,
    /// `R U`, n x n.
    left: Mat<f64>,
}

impl<'a, T: TimeDomain> HankelDecomposition<'a, T> {
    /// Decomposes a stable system.
    pub(super) fn new(system: &'a StateSpace<T>) -> Result<Self> {
        let factor = match system.time().sample_time() {
            Some(_) => discrete_gramian_factor,
            None => gramian_factor,
        };
        let reachable = factor(system.a(), system.b())?.l;
        let observable = factor(system.a().transpose(), system.c().transpose())?.l;
        let product = observable.transpose() * &reachable;
        let svd = product.svd().map_err(|_| Error::NoConvergence {
            what: "the singular value decomposition of the Hankel product".into(),
            iterations: 0,
        })?;
        let hankel = svd.S().column_vector().iter().copied().collect();
        Ok(HankelDecomposition { system, hankel, right: reachable * svd.V(), left: observable * svd.U() })
    }

    /// The system in the coordinates of groups of Hankel singular values, given by their sizes from the largest value on;
    /// the states of each group stand in an orthonormal basis of its subspace.
    pub(super) fn project(&self, groups: &[usize]) -> Result<StateSpace<T>> {
        let n = self.system.order();
        let order = groups.iter().sum();
        let (mut left, mut right) = (Mat::zeros(order, n), Mat::zeros(n, order));
        let mut first = 0;
        for size in groups.iter().copied().filter(|size| *size > 0) {
            let x = orthonormal(self.right.subcols(first, size));
            let z = orthonormal(self.left.subcols(first, size));
            let dual = solve("the product of the dual bases", (z.transpose() * &x).as_ref(), z.transpose())?;
            left.as_mut().subrows_mut(first, size).copy_from(dual);
            right.as_mut().subcols_mut(first, size).copy_from(x);
            first += size;
        }
        let system = self.system;
        let (a, b, c) = (&left * system.a() * &right, &left * system.b(), system.c() * &right);
        StateSpace::new(a, b, c, system.d().to_owned(), system.time())
    }
}

/// Orthonormal basis of the span of the columns.
fn orthonormal(columns: MatRef<'_, f64>) -> Mat<f64> {
    columns.qr().compute_thin_Q()
}
