//! A pole of the nominal model, or several equal ones, with the parameters of the Cramér-Rao bound.

use super::information::DIRECTION;
use faer::linalg::solvers::Solve;
use youla::{Mat, c64};

/// `C (z - P)^-1 B` with `P = p I`, r x r; with its conjugate where p is not real.
pub(super) struct Pole {
    pub(super) value: c64,
    /// Frobenius norm of the residue `C B`.
    pub(super) size: f64,
    /// p x r.
    c: Mat<c64>,
    /// r x m; the held columns are those of the identity.
    b: Mat<c64>,
    held: Vec<usize>,
}

impl Pole {
    /// From the residue (p x m) of `members` equal poles; none where it vanishes.
    pub(super) fn new(value: c64, residue: &Mat<c64>, members: usize) -> Option<Self> {
        let svd = residue.svd().ok()?;
        let sizes = svd.S().column_vector();
        let directions = (0..sizes.nrows()).filter(|k| sizes[*k].re > DIRECTION * sizes[0].re).count();
        let r = directions.min(members);
        if r == 0 {
            return None;
        }
        let c = Mat::from_fn(residue.nrows(), r, |i, k| svd.U()[(i, k)] * sizes[k]);
        let b = svd.V().subcols(0, r).adjoint().to_owned();
        let held = independent_columns(&b);
        let own = Mat::from_fn(r, r, |i, j| b[(i, held[j])]);
        let b = own.partial_piv_lu().solve(&b);
        Some(Pole { value, size: residue.norm_l2(), c: c * own, b, held })
    }

    /// Real parameters for P, C and B but for the columns that are held: twice as many for a pair.
    pub(super) fn parameters(&self) -> usize {
        self.parts() * self.held.len() * (self.c.nrows() + self.b.ncols())
    }

    /// The places of the diagonal entries of P among them; of a pair the real parts, the imaginary ones follow.
    pub(super) fn own_parameters(&self) -> impl Iterator<Item = usize> {
        let (r, parts) = (self.held.len(), self.parts());
        (0..r).map(move |i| parts * i * (r + 1))
    }

    fn parts(&self) -> usize {
        if self.value.im > 0.0 { 2 } else { 1 }
    }

    /// The columns `dG/dtheta U` of this pole at z, each of p values.
    pub(super) fn columns(&self, z: c64, u: &[c64], mut take: impl FnMut(&[c64])) {
        let one = self.derivatives(z, u, |x| x);
        if self.parts() == 1 {
            return one.iter().for_each(|column| take(column));
        }
        let other = self.derivatives(z, u, |x| x.conj());
        for (one, other) in one.iter().zip(&other) {
            take(&one.iter().zip(other).map(|(a, b)| a + b).collect::<Vec<_>>());
            take(&one.iter().zip(other).map(|(a, b)| c64::new(0.0, 1.0) * (a - b)).collect::<Vec<_>>());
        }
    }

    /// The derivatives of `C (z - P)^-1 B u` by every entry of P, C and B, or those of the conjugate term.
    fn derivatives(&self, z: c64, u: &[c64], of: impl Fn(c64) -> c64) -> Vec<Vec<c64>> {
        let (r, p, m) = (self.held.len(), self.c.nrows(), self.b.ncols());
        let gain = c64::new(1.0, 0.0) / (z - of(self.value));
        let along: Vec<c64> =
            (0..r).map(|i| (0..m).fold(c64::ZERO, |sum, s| sum + of(self.b[(i, s)]) * u[s])).collect();
        let output = |i: usize, size: c64| (0..p).map(|k| of(self.c[(k, i)]) * size).collect::<Vec<_>>();
        let unit = |k: usize, size: c64| (0..p).map(|l| if l == k { size } else { c64::ZERO }).collect::<Vec<_>>();
        let mut all = Vec::with_capacity(r * (p + m));
        all.extend((0..r * r).map(|k| output(k / r, along[k % r] * gain * gain)));
        all.extend((0..p * r).map(|k| unit(k / r, along[k % r] * gain)));
        let free: Vec<usize> = (0..m).filter(|s| !self.held.contains(s)).collect();
        all.extend((0..r).flat_map(|i| free.iter().map(move |s| (i, *s))).map(|(i, s)| output(i, u[s] * gain)));
        all
    }
}

/// As many columns as there are rows, each the longest beside those chosen before, in rising order.
fn independent_columns(b: &Mat<c64>) -> Vec<usize> {
    let (mut rest, mut chosen) = (b.clone(), Vec::new());
    for _ in 0..b.nrows() {
        let length = |j: &usize| rest.col(*j).norm_l2();
        let free = (0..b.ncols()).filter(|j| !chosen.contains(j));
        // The first of those that are equally long but for rounding.
        let longest = free.clone().map(|j| length(&j)).fold(0.0, f64::max);
        let Some(next) = free.clone().find(|j| length(j) >= (1.0 - 1e-9) * longest) else { break };
        let size = length(&next).max(f64::MIN_POSITIVE);
        let direction: Vec<c64> = rest.col(next).iter().map(|x| x / size).collect();
        for j in 0..b.ncols() {
            let along = (0..b.nrows()).fold(c64::ZERO, |sum, i| sum + direction[i].conj() * rest[(i, j)]);
            (0..b.nrows()).for_each(|i| rest[(i, j)] -= direction[i] * along);
        }
        chosen.push(next);
    }
    chosen.sort_unstable();
    chosen
}
