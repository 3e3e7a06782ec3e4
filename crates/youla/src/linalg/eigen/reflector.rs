//! Householder reflections `P = I - tau v v'` with `v[0] = 1` and plane rotations, the two orthogonal building blocks of
//! the Hessenberg and Schur reductions (Golub and Van Loan, Matrix Computations, 4th ed., section 5.1).

use crate::linalg::square::Square;
use faer::Mat;
use std::ops::Range;

/// Overwrites `x` by the Householder vector `v` and returns `(tau, beta)` with `(I - tau v v') x = beta e1`.
/// `beta` takes the sign opposite to `x[0]`, so that no cancellation occurs.
pub(crate) fn householder(x: &mut [f64]) -> (f64, f64) {
    let scale = x.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    let head = x[0];
    if scale == 0.0 || x[1..].iter().all(|e| *e == 0.0) {
        x[0] = 1.0;
        return (0.0, head);
    }
    let norm = scale * x.iter().map(|e| (e / scale).powi(2)).sum::<f64>().sqrt();
    let beta = -norm.copysign(head);
    let pivot = head - beta;
    for e in &mut x[1..] {
        *e /= pivot;
    }
    x[0] = 1.0;
    (-pivot / beta, beta)
}

/// `m := P m`, where P acts on the rows from `row` on, restricted to the given columns.
pub(crate) fn reflect_rows(m: &mut Mat<f64>, v: &[f64], tau: f64, row: usize, columns: Range<usize>) {
    for j in columns {
        let x = &mut m.col_as_slice_mut(j)[row..row + v.len()];
        let w = tau * x.iter().zip(v).map(|(x, v)| x * v).sum::<f64>();
        for (x, v) in x.iter_mut().zip(v) {
            *x -= w * v;
        }
    }
}

/// `m := m P`, where P acts on the columns from `column` on, restricted to the given rows.
pub(crate) fn reflect_columns(m: &mut Mat<f64>, v: &[f64], tau: f64, column: usize, rows: Range<usize>) {
    let mut w = vec![0.0; rows.len()];
    for (k, v) in v.iter().enumerate() {
        for (w, x) in w.iter_mut().zip(&m.col_as_slice(column + k)[rows.clone()]) {
            *w += x * v;
        }
    }
    for (k, v) in v.iter().enumerate() {
        let factor = tau * v;
        for (x, w) in m.col_as_slice_mut(column + k)[rows.clone()].iter_mut().zip(&w) {
            *x -= factor * w;
        }
    }
}

/// The rotation `[c s; -s c]`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rotation {
    pub(crate) c: f64,
    pub(crate) s: f64,
}

impl Rotation {
    /// The rotation that turns `[x; y]` onto the first axis.
    pub(crate) fn onto_first(x: f64, y: f64) -> Self {
        let r = x.hypot(y);
        if r == 0.0 { Rotation { c: 1.0, s: 0.0 } } else { Rotation { c: x / r, s: y / r } }
    }

    /// Similarity `t := R t R'` in the plane (k, k+1) of a quasi-triangular `t`, and `q := q R'`.
    pub(crate) fn similarity(self, t: &mut Square, q: &mut Square, k: usize) {
        let Rotation { c, s } = self;
        let (n, height) = (t.order(), t.height());
        for column in t.columns_from(k).chunks_exact_mut(height) {
            let (x, y) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * x + s * y, c * y - s * x);
        }
        for (m, rows) in [(t, (k + 2).min(n)), (q, n)] {
            let (left, right) = m.columns_from(k).split_at_mut(height);
            for (x, y) in left[..rows].iter_mut().zip(&mut right[..rows]) {
                (*x, *y) = (c * *x + s * *y, c * *y - s * *x);
            }
        }
    }
}
