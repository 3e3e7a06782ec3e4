//! Balancing-free square-root projection: A. Varga, Efficient minimal realization procedure based on balancing, IMACS
//! Symposium MCTS, Lille, 1991.
//!
//! With the Gramians `P = S S'`, `Q = R R'` and `R' S = U diag(sigma) V'`, the columns of `S V` and `R U` span the balanced
//! coordinates and their duals. Orthonormal bases X and Z of those that are kept give the projection
//! `(Z'X)^-1 Z' A X`; the ill-conditioned balancing transformation itself is never formed.

use crate::linalg::{discrete_gramian_factor, gramian_factor, solve};
use crate::lti::{StateSpace, TimeDomain};
use crate::{Error, Result};
use faer::prelude::*;
use faer::{Mat, MatRef, c64};

/// Hankel singular values of a system and the directions that belong to them.
pub(super) struct HankelDecomposition<T: TimeDomain> {
    pub(super) system: StateSpace<T>,
    /// In descending order.
    pub(super) hankel: Vec<f64>,
    /// `S V`, n x n.
    right: Mat<f64>,
    /// `R U`, n x n.
    left: Mat<f64>,
}

impl<T: TimeDomain> HankelDecomposition<T> {
    /// Decomposes a stable system.
    pub(super) fn new(system: StateSpace<T>) -> Result<Self> {
        let reachable = factor(system.time(), system.a(), system.b())?;
        let observable = factor(system.time(), system.a().transpose(), system.c().transpose())?;
        Self::from_factors(system, &reachable, &observable)
    }

    /// The same with other factors S and R of the two Gramians, n x n.
    pub(super) fn from_factors(system: StateSpace<T>, reachable: &Mat<f64>, observable: &Mat<f64>) -> Result<Self> {
        let product = observable.transpose() * reachable;
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
        let system = &self.system;
        let (a, b, c) = (&left * system.a() * &right, &left * system.b(), system.c() * &right);
        StateSpace::new(a, b, c, system.d().to_owned(), system.time())
    }
}

/// Lower triangular factor of the Gramian of (A, B).
pub(super) fn factor<T: TimeDomain>(time: T, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let factor = match time.sample_time() {
        Some(_) => discrete_gramian_factor,
        None => gramian_factor,
    };
    factor(a, b)
}

/// Orthonormal basis of the span of the columns.
fn orthonormal(columns: MatRef<'_, f64>) -> Mat<f64> {
    columns.qr().compute_thin_Q()
}

/// Replaces the states from number `order` on by their equilibrium at frequency zero: with `s0 = 0` or `z0 = 1`,
/// `A_r = A11 + A12 (s0 I - A22)^-1 A21` and so on.
pub(super) fn residualise<T: TimeDomain>(system: &StateSpace<T>, order: usize) -> Result<StateSpace<T>> {
    let fast = system.order() - order;
    let c64 { re: still, .. } = system.time().boundary(0.0);
    let (a, b, c, d) = (system.a(), system.b(), system.c(), system.d());
    let distance = Scale(still) * Mat::<f64>::identity(fast, fast) - a.submatrix(order, order, fast, fast);
    let solve = |rhs| solve("the fast part of the system at frequency zero", distance.as_ref(), rhs);
    let (by_state, by_input) = (solve(a.submatrix(order, 0, fast, order))?, solve(b.subrows(order, fast))?);
    let (to_state, to_output) = (a.submatrix(0, order, order, fast), c.subcols(order, fast));
    StateSpace::new(
        a.submatrix(0, 0, order, order) + to_state * &by_state,
        b.subrows(0, order) + to_state * &by_input,
        c.subcols(0, order) + to_output * &by_state,
        d + to_output * &by_input,
        system.time(),
    )
}
