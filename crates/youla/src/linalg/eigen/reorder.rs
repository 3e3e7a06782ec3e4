//! Reordering of a real Schur form by direct swapping of neighbouring diagonal blocks: Z. Bai and J. W. Demmel, On swapping
//! diagonal blocks in real Schur form, Linear Algebra Appl. 186 (1993), 73-95.
//!
//! Neighbours A11 (p x p) and A22 (q x q) change places under the orthogonal matrix of the QR factorisation
//! `[-X; I] = Q R`, where `A11 X - X A22 = A12`. A swap that would disturb the matrix by more than rounding is refused.

use crate::linalg::eigen::reflector::{Rotation, householder, reflect_columns, reflect_rows};
use crate::linalg::eigen::schur::{DiagonalBlock, RealSchur, block_eigenvalues, blocks, standardise};
use crate::linalg::kronecker::{SmallSolution, solve_sum};
use crate::linalg::square::Square;
use crate::{Error, Result};
use faer::{Mat, c64};

/// A real Schur form whose first `dimension` columns of Q span the invariant subspace of the selected eigenvalues.
#[derive(Debug, Clone)]
pub struct OrderedSchur {
    /// Orthogonal matrix Q, n x n.
    pub q: Mat<f64>,
    /// Quasi-triangular matrix T, n x n, the selected eigenvalues first.
    pub t: Mat<f64>,
    /// Number of selected eigenvalues.
    pub dimension: usize,
    /// Relative residual `||A - Q T Q'|| / ||A||`: that of the Schur form plus what the swaps set to zero.
    pub residual: f64,
}

impl OrderedSchur {
    /// Eigenvalues in the order in which they are on the diagonal of T.
    pub fn eigenvalues(&self) -> Vec<c64> {
        blocks(self.t.as_ref()).into_iter().flat_map(|b| block_eigenvalues(self.t.as_ref(), b)).collect()
    }
}

impl RealSchur {
    /// Moves the eigenvalues for which `select` holds to the top, keeping their order otherwise. A pair moves where
    /// `select` holds for its member with positive imaginary part.
    ///
    /// # Errors
    /// [`Error::NoConvergence`] where two blocks are too close to each other to be swapped without losing digits.
    ///
    /// ```
    /// use youla::{Mat, linalg::real_schur};
    /// let a = Mat::from_fn(2, 2, |i, j| [[3.0, 1.0], [0.0, -2.0]][i][j]);
    /// let ordered = real_schur("A", a.as_ref())?.reorder(|p| p.re < 0.0)?;
    /// assert_eq!(ordered.dimension, 1);
    /// assert!((ordered.t[(0, 0)] + 2.0).abs() < 1e-14);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn reorder(self, select: impl Fn(c64) -> bool) -> Result<OrderedSchur> {
        let RealSchur { q, t: form, residual } = self;
        let norm = form.norm_l2();
        let (mut t, mut q) = (Square::new(form.as_ref()), Square::new(q.as_ref()));
        let (mut dimension, mut start, mut disturbed) = (0, 0, 0.0_f64);
        while start < t.order() {
            let size = if start + 1 < t.order() && t[(start + 1, start)] != 0.0 { 2 } else { 1 };
            let chosen = select(block_eigenvalues(form.as_ref(), DiagonalBlock { start, size })[0]);
            start += size;
            if chosen {
                disturbed += move_up(&mut t, &mut q, start - size, dimension, norm)?;
                dimension += size;
            }
        }
        let residual = residual + if norm == 0.0 { 0.0 } else { disturbed / norm };
        Ok(OrderedSchur { q: q.to_mat(), t: t.to_mat(), dimension, residual })
    }
}

/// Moves the block that begins in row `from` up to row `to`; returns the sum of what was set to zero.
fn move_up(t: &mut Square, q: &mut Square, from: usize, to: usize, norm: f64) -> Result<f64> {
    let (mut row, mut disturbed) = (from, 0.0);
    while row > to {
        let above = if row >= to + 2 && t[(row - 1, row - 2)] != 0.0 { 2 } else { 1 };
        let below = if row + 1 < t.order() && t[(row + 1, row)] != 0.0 { 2 } else { 1 };
        disturbed += swap(t, q, row - above, above, below, norm)?;
        row -= above;
        // A pair on the verge of being real may have split: then its first half is moved on, and the second follows.
        if below == 2 && t[(row + 1, row)] == 0.0 {
            disturbed += move_up(t, q, row, to, norm)?;
            disturbed += move_up(t, q, row + 1, to + 1, norm)?;
            return Ok(disturbed);
        }
    }
    Ok(disturbed)
}

/// Exchanges the neighbouring blocks of `above` and `below` rows that begin in row k; returns the size of what was set to
/// zero.
fn swap(t: &mut Square, q: &mut Square, k: usize, above: usize, below: usize, norm: f64) -> Result<f64> {
    if above == 1 && below == 1 {
        let (first, second) = (t[(k, k)], t[(k + 1, k + 1)]);
        Rotation::onto_first(t[(k, k + 1)], second - first).similarity(t, q, k);
        (t[(k, k)], t[(k + 1, k + 1)], t[(k + 1, k)]) = (second, first, 0.0);
        return Ok(0.0);
    }
    let size = above + below;
    let reflections = swapping_reflections(t, k, above, below);
    let left = rehearse(t, k, below, size, &reflections);
    if left > 20.0 * f64::EPSILON * norm {
        let (first, second) = (t[(k, k)], t[(k + above, k + above)]);
        let what = format!("the exchange of the eigenvalues with real parts {first} and {second} of a Schur form");
        return Err(Error::NoConvergence { what, iterations: 1 });
    }
    for Reflection { row, v, tau } in &reflections {
        match **v {
            [v0, v1] => apply(t, q, &[v0, v1], *tau, k + row, k, size),
            [v0, v1, v2] => apply(t, q, &[v0, v1, v2], *tau, k + row, k, size),
            [v0, v1, v2, v3] => apply(t, q, &[v0, v1, v2, v3], *tau, k + row, k, size),
            _ => {}
        }
    }
    for i in k + below..k + size {
        for j in k..k + below {
            t[(i, j)] = 0.0;
        }
    }
    for (row, rows) in [(k, below), (k + below, above)] {
        if rows == 2 {
            standardise(t, q, row);
        }
    }
    Ok(left)
}

/// A reflection of the rows from `row` on, for a swap of the `size` rows from row k on.
fn apply<const N: usize>(t: &mut Square, q: &mut Square, v: &[f64; N], tau: f64, row: usize, k: usize, size: usize) {
    t.reflect_rows(v, tau, row, k);
    t.reflect_columns(v, tau, row, k + size);
    q.reflect_columns(v, tau, row, q.order());
}

/// A Householder reflection of the rows from `row` on, counted within the two blocks.
struct Reflection {
    row: usize,
    v: Vec<f64>,
    tau: f64,
}

/// What the exchange would leave below the new diagonal blocks, tried on a copy of the old ones.
fn rehearse(t: &Square, k: usize, below: usize, size: usize, reflections: &[Reflection]) -> f64 {
    let mut copy = Mat::from_fn(size, size, |i, j| t[(k + i, k + j)]);
    for Reflection { row, v, tau } in reflections {
        reflect_rows(&mut copy, v, *tau, *row, 0..size);
        reflect_columns(&mut copy, v, *tau, *row, 0..size);
    }
    copy.submatrix(below, 0, size - below, below).norm_l2()
}

/// Householder vectors of the QR factorisation of `[-X; g I]`, where `A11 X - X A22 = g A12`.
fn swapping_reflections(t: &Square, k: usize, above: usize, below: usize) -> Vec<Reflection> {
    let middle = k + above;
    let entries = |row, column, height, width, sign: f64| {
        let entry = |i, j| if i < height && j < width { sign * t[(row + i, column + j)] } else { 0.0 };
        [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
    };
    let a11 = entries(k, k, above, above, 1.0);
    let [[a, b], [c, d]] = entries(middle, middle, below, below, -1.0);
    let rhs = entries(k, middle, above, below, 1.0);
    let SmallSolution { x, scale, .. } = solve_sum((above, below), &a11, &[[a, c], [b, d]], &rhs);
    let mut panel = Mat::from_fn(above + below, below, |i, j| match i.checked_sub(above) {
        None => -x[i][j],
        Some(row) => f64::from(u8::from(row == j)) * scale,
    });
    let mut reflections = Vec::with_capacity(below);
    for j in 0..below {
        let mut v: Vec<f64> = (j..above + below).map(|i| panel[(i, j)]).collect();
        let (tau, _) = householder(&mut v);
        reflect_rows(&mut panel, &v, tau, j, j..below);
        reflections.push(Reflection { row: j, v, tau });
    }
    reflections
}

#[cfg(test)]
mod tests {
    use crate::Error;
    use crate::linalg::{eye, real_schur};
    use faer::Mat;
    use std::cell::Cell;

    /// Two conjugate pairs `+-i` and `+-i (1 + gap)`, coupled.
    fn two_pairs(gap: f64) -> Mat<f64> {
        let w = 1.0 + gap;
        Mat::from_fn(4, 4, |i, j| {
            [[0.0, 1.0, 3.0, -1.0], [-1.0, 0.0, 0.5, 2.0], [0.0, 0.0, 0.0, w], [0.0, 0.0, -w, 0.0]][i][j]
        })
    }

    #[test]
    fn close_pairs_change_places_or_are_refused() {
        for gap in [1.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 0.0] {
            let a = two_pairs(gap);
            let seen = Cell::new(0);
            let second = |_| {
                seen.set(seen.get() + 1);
                seen.get() == 2
            };
            match real_schur("A", a.as_ref()).unwrap().reorder(second) {
                Ok(ordered) => {
                    assert_eq!(ordered.dimension, 2);
                    let (q, t) = (&ordered.q, &ordered.t);
                    assert!((q * t * q.transpose() - &a).norm_l2() < 1e-14 * a.norm_l2(), "gap {gap}");
                    assert!((q.transpose() * q - eye(4)).norm_l2() < 1e-14);
                    assert_eq!(t[(2, 0)].abs() + t[(3, 0)].abs() + t[(2, 1)].abs() + t[(3, 1)].abs(), 0.0);
                }
                Err(error) => assert!(gap < 1e-9 && matches!(error, Error::NoConvergence { .. }), "{error}"),
            }
        }
    }
}
