//! Eigenvalues with left and right eigenvectors of a real matrix, also where poles are equal or lack eigenvectors.
//!
//! Of the Schur form `A = Q T Q*` the vectors of simple eigenvalues follow by substitution. Equal eigenvalues form a group, which has
//! one decomposition: the singular vectors of `T - p I` that belong to its zero singular values are bases of the right and left
//! eigenvectors. Where they are fewer than the group has members (delays), those of the power `(T - p I)^g` span the invariant subspaces.
//! In both cases `W V = I` within the group, and `V W` is its spectral projector. The rows of `V^-1` would do for neither:
//! V has no inverse where one eigenvalue lacks vectors, and then all are lost.
//!
//! Source: G. W. Stewart and J.-G. Sun, Matrix Perturbation Theory (1990), chapters I.3 and V.

use crate::linalg::eigen::complex_schur::{ComplexSchur, complex_schur};
use crate::{Error, Result};
use faer::prelude::*;
use faer::{Mat, MatRef, c64};

/// Eigenvalues nearer to each other than this part of the norm are equal: their own vectors keep less than half of the digits,
/// and what depends on their difference squared is lost in rounding.
const EQUAL: f64 = 3e-7;
/// Rounding errors of an eigenvalue, `norm eps / |w v|`, within which a neighbour cannot be told from it. Chosen, not measured.
const ROUNDING: f64 = 30.0;
/// Singular value of `T - p I`, over the norm, up to which it belongs to an eigenvector.
const COMPLETE: f64 = 1e-6;

/// The eigenvalues of a matrix with their vectors.
pub(crate) struct Eigenvectors {
    /// In no order.
    pub(crate) values: Vec<c64>,
    /// Right vectors, columns of unit length within simple eigenvalues.
    pub(crate) right: Mat<c64>,
    /// Left vectors, rows; `W V = I` within each group.
    pub(crate) left: Mat<c64>,
    /// Eigenvalues that are equal, a group of one for each simple one.
    pub(crate) groups: Vec<Group>,
}

/// Eigenvalues that are equal to working precision.
pub(crate) struct Group {
    /// Their places.
    pub(crate) members: Vec<usize>,
    /// Whether there is an eigenvector for each; else the vectors span the invariant subspaces.
    pub(crate) complete: bool,
}

impl Eigenvectors {
    /// Of a square matrix.
    ///
    /// # Errors
    /// Those of [`crate::linalg::real_schur`]; [`Error::NoConvergence`] of a singular value decomposition; [`Error::NotFinite`].
    pub(crate) fn of(what: &str, a: MatRef<'_, f64>) -> Result<Self> {
        let ComplexSchur { q, t } = complex_schur(what, a)?;
        let n = t.nrows();
        let values: Vec<c64> = (0..n).map(|k| t[(k, k)]).collect();
        let (mut right, mut left) = (Mat::zeros(n, n), Mat::zeros(n, n));
        let mut product = Vec::with_capacity(n);
        for k in 0..n {
            let (v, w) = (substituted(&t, k), substituted_left(&t, k));
            let along = v.iter().zip(&w).fold(c64::ZERO, |sum, (v, w)| sum + v * w);
            product.push(along.norm());
            let scale = if along == c64::ZERO { c64::ONE } else { along };
            v.iter().enumerate().for_each(|(i, v)| right[(i, k)] = *v);
            w.iter().enumerate().for_each(|(i, w)| left[(k, i)] = *w / scale);
        }
        let mut groups = Vec::new();
        for members in grouped(&values, &product, t.norm_l2()) {
            let complete = members.len() == 1 || common(what, &t, &members, &mut right, &mut left)?;
            groups.push(Group { members, complete });
        }
        let (right, left) = (&q * right, left * q.adjoint());
        if !(right.is_all_finite() && left.is_all_finite()) {
            return Err(Error::NoConvergence { what: format!("the eigenvectors of {what}"), iterations: 0 });
        }
        Ok(Eigenvectors { values, right, left, groups })
    }
}

/// The right eigenvector of the k-th diagonal entry of a triangular matrix, of unit length.
fn substituted(t: &Mat<c64>, k: usize) -> Vec<c64> {
    let mut x = vec![c64::ZERO; t.nrows()];
    x[k] = c64::ONE;
    for i in (0..k).rev() {
        let sum = (i + 1..=k).fold(c64::ZERO, |sum, j| sum + t[(i, j)] * x[j]);
        x[i] = sum / away_from_zero(t[(k, k)] - t[(i, i)], t);
        bound(&mut x, i);
    }
    unit(x)
}

/// The left one, `w T = t_kk w`.
fn substituted_left(t: &Mat<c64>, k: usize) -> Vec<c64> {
    let n = t.nrows();
    let mut x = vec![c64::ZERO; n];
    x[k] = c64::ONE;
    for j in k + 1..n {
        let sum = (k..j).fold(c64::ZERO, |sum, i| sum + x[i] * t[(i, j)]);
        x[j] = sum / away_from_zero(t[(k, k)] - t[(j, j)], t);
        bound(&mut x, j);
    }
    unit(x)
}

/// Equal eigenvalues are perturbed by a rounding; their vectors are replaced afterwards.
fn away_from_zero(difference: c64, t: &Mat<c64>) -> c64 {
    let least = f64::EPSILON * t.norm_max().max(f64::MIN_POSITIVE / f64::EPSILON);
    if difference.norm() < least { c64::new(least, 0.0) } else { difference }
}

/// Keeps the entries within range.
fn bound(x: &mut [c64], latest: usize) {
    let size = x[latest].norm();
    if size > 1e100 {
        x.iter_mut().for_each(|x| *x /= size);
    }
}

fn unit(mut x: Vec<c64>) -> Vec<c64> {
    let largest = x.iter().map(|x| x.norm()).fold(0.0, f64::max);
    x.iter_mut().for_each(|x| *x /= largest);
    let length = x.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
    x.iter_mut().for_each(|x| *x /= length);
    x
}

/// The eigenvalues that rounding cannot tell apart, by chains of neighbours.
fn grouped(values: &[c64], product: &[f64], norm: f64) -> Vec<Vec<usize>> {
    let n = values.len();
    let rounding = |k: usize| ROUNDING * f64::EPSILON * norm / product[k].max(f64::EPSILON);
    // A rounding error larger than this says nothing of neighbours.
    let reach = |k: usize| (EQUAL * norm).max(rounding(k).min(1e-2 * norm));
    let near = |j: usize, k: usize| (values[j] - values[k]).norm() <= reach(j).min(reach(k));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in 0..n {
        let (own, mut rest): (Vec<_>, Vec<_>) = groups.into_iter().partition(|g| g.iter().any(|j| near(*j, k)));
        let mut joined: Vec<usize> = own.concat();
        joined.push(k);
        rest.push(joined);
        groups = rest;
    }
    groups
}

/// Writes the bases of a group, `W V = I`; whether it has an eigenvector for each member.
fn common(what: &str, t: &Mat<c64>, members: &[usize], right: &mut Mat<c64>, left: &mut Mat<c64>) -> Result<bool> {
    let (n, g) = (t.nrows(), members.len());
    let failed = || Error::NoConvergence { what: format!("the eigenvectors of {what}"), iterations: 0 };
    let mean = members.iter().fold(c64::ZERO, |sum, k| sum + t[(*k, *k)]) / g as f64;
    let norm = t.norm_l2().max(f64::MIN_POSITIVE);
    let shifted = Mat::from_fn(n, n, |i, j| (t[(i, j)] - if i == j { mean } else { c64::ZERO }) / norm);
    let mut svd = shifted.svd().map_err(|_| failed())?;
    let complete = svd.S().column_vector()[n - g].re <= COMPLETE;
    if !complete {
        let power = (1..g).fold(shifted.clone(), |power, _| power * &shifted);
        svd = power.svd().map_err(|_| failed())?;
    }
    let v = svd.V().subcols(n - g, g).to_owned();
    let w = svd.U().subcols(n - g, g).adjoint().to_owned();
    let w = (&w * &v).partial_piv_lu().solve(&w);
    for (place, k) in members.iter().enumerate() {
        right.col_mut(*k).copy_from(v.col(place));
        left.row_mut(*k).copy_from(w.row(place));
    }
    Ok(complete)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::{block_diagonal, eye};

    fn pair(re: f64, im: f64) -> Mat<f64> {
        Mat::from_fn(2, 2, |i, j| [[re, im], [-im, re]][i][j])
    }

    /// The nilpotent matrix of a delay.
    fn delay(n: usize) -> Mat<f64> {
        Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j + 1)))
    }

    /// In other coordinates, condition number about 10.
    fn mixed(a: &Mat<f64>) -> Mat<f64> {
        let n = a.nrows();
        let m = Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) + 0.3 * ((3 * i + 7 * j) as f64).sin());
        m.partial_piv_lu().solve(a * &m)
    }

    /// Whether the right vectors are eigenvectors that may be a basis.
    fn complete(found: &Eigenvectors) -> bool {
        found.groups.iter().all(|g| g.complete)
    }

    /// `A V = V L` for complete groups, `W V = I`, and the projectors sum to the identity.
    fn check(name: &str, a: &Mat<f64>, tolerance: f64) -> Eigenvectors {
        let n = a.nrows();
        let found = Eigenvectors::of("A", a.as_ref()).unwrap();
        let complex = Mat::from_fn(n, n, |i, j| c64::new(a[(i, j)], 0.0));
        let identity = &found.left * &found.right - Mat::<c64>::identity(n, n);
        assert!(identity.norm_max() < tolerance, "{name}: W V - I = {:.1e}", identity.norm_max());
        for k in found.groups.iter().filter(|g| g.complete).flat_map(|g| &g.members) {
            let residual = &complex * found.right.col(*k) - found.right.col(*k) * Scale(found.values[*k]);
            assert!(residual.norm_l2() < tolerance, "{name}: residual {:.1e}", residual.norm_l2());
        }
        found
    }

    #[test]
    fn equal_pairs_have_vectors_of_their_own() {
        let twice = block_diagonal(pair(0.9, 0.3).as_ref(), pair(0.9, 0.3).as_ref());
        let thrice = block_diagonal(twice.as_ref(), pair(0.9, 0.3).as_ref());
        let beside = block_diagonal(thrice.as_ref(), pair(0.5, 0.7).as_ref());
        for (name, a) in [("two", &twice), ("three", &thrice), ("beside", &beside)] {
            for a in [a.clone(), mixed(a)] {
                let found = check(name, &a, 1e-12);
                assert!(complete(&found), "{name}");
            }
        }
        let found = check("one", &(eye(4) * Scale(0.5)), 1e-14);
        assert!(complete(&found) && found.groups.len() == 1);
    }

    #[test]
    fn delays_leave_the_other_vectors_alone() {
        for (n, tolerance) in [(2, 1e-12), (3, 1e-12), (5, 1e-11)] {
            let a = block_diagonal(pair(0.9, 0.3).as_ref(), delay(n).as_ref());
            for a in [a.clone(), mixed(&a)] {
                let found = check("delay", &a, tolerance);
                let incomplete: Vec<usize> =
                    found.groups.iter().filter(|g| !g.complete).map(|g| g.members.len()).collect();
                assert_eq!(incomplete, [n]);
            }
        }
    }

    #[test]
    fn simple_eigenvalues_stay_simple() {
        let a = Mat::from_fn(12, 12, |i, j| ((5 * i + 3 * j * j + 7 * i * j) as f64).sin());
        let found = check("simple", &a, 1e-11);
        assert_eq!(found.groups.len(), 12);
        assert_eq!(check("none", &Mat::zeros(0, 0), 1.0).groups.len(), 0);
        // Nearly critical damping: an ill-conditioned pair is none that is equal.
        let near = Mat::from_fn(2, 2, |i, j| [[0.9, 1.0], [1e-8, 0.9]][i][j]);
        assert_eq!(check("near", &near, 1e-6).groups.len(), 2);
    }
}
