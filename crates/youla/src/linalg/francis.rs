//! The QR iteration with implicit double shift that reduces a Hessenberg matrix to quasi-triangular form: J. G. F. Francis,
//! The QR transformation, Comput. J. 4 (1961-62), 265 and 332; the test for deflation is that of M. Ahues and F. Tisseur,
//! LAPACK Working Note 122 (1997).

use super::reflector::{householder, reflect_columns, reflect_rows};
use super::schur::standardise;
use crate::{Error, Result};
use faer::Mat;
use std::ops::Range;

/// Turns the Hessenberg matrix `t` into quasi-triangular form, deflating from the bottom until nothing is left, and
/// accumulates the transformations in `q`.
pub(super) fn iterate(what: &str, t: &mut Mat<f64>, q: &mut Mat<f64>) -> Result<()> {
    let n = t.nrows();
    let limit = 30 * n.max(10);
    let (mut end, mut total, mut since_deflation) = (n, 0, 0);
    while end > 0 {
        let start = deflate(t, end);
        match end - start {
            1 => (end, since_deflation) = (end - 1, 0),
            2 => {
                standardise(t, q, start);
                (end, since_deflation) = (end - 2, 0);
            }
            _ if total == limit => {
                let what = format!("the Schur form of {what}");
                return Err(Error::NoConvergence { what, iterations: total });
            }
            _ => {
                total += 1;
                since_deflation += 1;
                let shifts = Shifts::choose(t, start, end, since_deflation);
                let first = first_row(t, start, end, shifts);
                sweep(t, q, start..end, first, shifts);
            }
        }
    }
    Ok(())
}

/// Sets the lowest negligible subdiagonal entry above row `end` to zero and returns the first row of the unreduced block.
pub(super) fn deflate(t: &mut Mat<f64>, end: usize) -> usize {
    for k in (1..end).rev() {
        if is_negligible(t, k) {
            t[(k, k - 1)] = 0.0;
            return k;
        }
    }
    0
}

/// Whether the subdiagonal entry of row k may be set to zero at no more than the cost of a rounding, also for graded
/// matrices (Ahues and Tisseur 1997).
fn is_negligible(t: &Mat<f64>, k: usize) -> bool {
    let eps = f64::EPSILON;
    let (below, above) = (t[(k, k - 1)].abs(), t[(k - 1, k)].abs());
    let (upper, lower) = (t[(k - 1, k - 1)], t[(k, k)]);
    let mut neighbours = upper.abs() + lower.abs();
    if neighbours == 0.0 {
        neighbours = t.norm_max();
    }
    if below <= f64::MIN_POSITIVE / eps {
        return true;
    }
    if below > eps * neighbours {
        return false;
    }
    let (small, large) = (below.min(above), below.max(above));
    let gap = (upper - lower).abs();
    let (least, most) = (lower.abs().min(gap), lower.abs().max(gap));
    let sum = most + large;
    small * (large / sum) <= (f64::MIN_POSITIVE / eps).max(eps * (least * (most / sum)))
}

/// Two shifts: a conjugate pair `re +- i im`, or the real numbers `re +- split`; one of `im` and `split` is zero.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shifts {
    pub(super) re: f64,
    pub(super) im: f64,
    pub(super) split: f64,
}

impl Shifts {
    /// Eigenvalues of the trailing 2 x 2 block (if real, twice the one nearer to the last entry), with an exceptional
    /// pair every tenth sweep to leave a cycle.
    pub(super) fn choose(t: &Mat<f64>, start: usize, end: usize, sweeps: usize) -> Self {
        let n = end - 1;
        let (a, b, c, d) = (t[(n - 1, n - 1)], t[(n - 1, n)], t[(n, n - 1)], t[(n, n)]);
        if sweeps.is_multiple_of(10) {
            let k = if sweeps.is_multiple_of(20) { n } else { start + 2 };
            let size = t[(k, k - 1)].abs() + t[(k - 1, k - 2)].abs();
            return Shifts { re: t[(k, k)] + 0.75 * size, im: 0.4375_f64.sqrt() * size, split: 0.0 };
        }
        let half = 0.5 * (a - d);
        let discriminant = half * half + b * c;
        if discriminant < 0.0 {
            return Shifts { re: d + half, im: (-discriminant).sqrt(), split: 0.0 };
        }
        let away = half + discriminant.sqrt().copysign(half);
        Shifts { re: if away == 0.0 { d } else { d - b * c / away }, im: 0.0, split: 0.0 }
    }

    /// The first column of `(T - s1 I)(T - s2 I)` for the block that begins in row k, divided by its size. It is made of
    /// differences to the shifts, so that eigenvalues that agree in many digits are still told apart.
    pub(super) fn first_column(self, t: &Mat<f64>, k: usize) -> [f64; 3] {
        let (a, b, c, d) = (t[(k, k)] - self.re, t[(k, k + 1)], t[(k + 1, k)], t[(k + 1, k + 1)] - self.re);
        let Shifts { im, split, .. } = self;
        let size = a.abs() + im.abs() + split.abs() + c.abs();
        if size == 0.0 {
            return [0.0; 3];
        }
        let r = c / size;
        [r * b + (a - split) * ((a + split) / size) + im * (im / size), r * (a + d), r * t[(k + 2, k + 1)]]
    }
}

/// The row in which a sweep may begin: the lowest below which the shifts act as if the rows above were split off, because
/// two subdiagonal entries in turn are small. From farther up they would be lost in rounding on their way down.
fn first_row(t: &Mat<f64>, start: usize, end: usize, shifts: Shifts) -> usize {
    for k in (start + 1..end - 2).rev() {
        let [x, y, z] = shifts.first_column(t, k);
        let neighbours = t[(k - 1, k - 1)].abs() + t[(k, k)].abs() + t[(k + 1, k + 1)].abs();
        if t[(k, k - 1)].abs() * (y.abs() + z.abs()) <= f64::EPSILON * x.abs() * neighbours {
            return k;
        }
    }
    start
}

/// One implicit double-shift QR sweep on the unreduced rows `block`, chasing the bulge down from the row `first` on.
fn sweep(t: &mut Mat<f64>, q: &mut Mat<f64>, block: Range<usize>, first: usize, shifts: Shifts) {
    let (n, Range { start, end }) = (t.nrows(), block);
    let mut column = shifts.first_column(t, first);
    for k in first..end - 1 {
        let length = 3.min(end - k);
        if k > first {
            for (i, e) in column.iter_mut().enumerate().take(length) {
                *e = t[(k + i, k - 1)];
            }
        }
        let v = &mut column[..length];
        let (tau, beta) = householder(v);
        if k > first {
            t[(k, k - 1)] = beta;
            for i in 1..length {
                t[(k + i, k - 1)] = 0.0;
            }
        } else if k > start {
            t[(k, k - 1)] *= 1.0 - tau;
        }
        reflect_rows(t, v, tau, k, k..n);
        reflect_columns(t, v, tau, k, 0..end.min(k + 4));
        reflect_columns(q, v, tau, k, 0..n);
    }
}
