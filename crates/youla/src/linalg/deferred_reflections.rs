//! Reflections applied late: what lies right of a diagonal window, above it and in Q follows when the bulges have passed the window,
//! every reflection in its turn, in strips that stay in the fastest memory (B. Lang, Using level 3 BLAS in rotation-based
//! algorithms, SIAM J. Sci. Comput. 19 (1998), 626). A strip has a row or column in each lane of the widest registers.

use super::square::{LANES, Square};
use pulp::Simd;
use std::ops::Range;

/// Vectors that are reflected side by side, so that none waits for itself.
const VECTORS: usize = 4;

/// Rows of a strip of columns, turned on their side.
pub(super) type Strip = Vec<[f64; LANES]>;

/// The reflections `I - tau v v'`, `v = [1, v1, v2]`, of one bulge on its way: each acts one row below the one before it.
#[derive(Debug, Default)]
pub(super) struct Path {
    /// First row of the first reflection.
    pub(super) first: usize,
    /// `[tau, v1, v2]` of each; v2 is zero where a reflection has two rows.
    pub(super) steps: Vec<[f64; 3]>,
}

/// Applies the reflections of `paths` to the rows of the columns from `column` on; `strip` is memory for n + 1 rows.
#[inline(always)]
pub(super) fn reflect_rows_late<S: Simd>(simd: S, t: &mut Square, paths: &[Path], column: usize, strip: &mut Strip) {
    let (n, height) = (t.order(), t.height());
    let first = paths.iter().map(|path| path.first).min().unwrap_or(0);
    let last = paths.iter().map(|path| path.first + path.steps.len() + 2).max().unwrap_or(0);
    let rows = first..last.min(n);
    // A reflection of two rows reads one more, with the weight zero.
    strip[rows.len()] = [0.0; LANES];
    for j in (column..n).step_by(LANES) {
        let lanes = LANES.min(n - j);
        let columns = t.columns_from(j);
        for (lane, x) in columns.chunks_exact(height).take(lanes).enumerate() {
            for (row, x) in strip.iter_mut().zip(&x[rows.clone()]) {
                row[lane] = *x;
            }
        }
        for path in paths {
            reflect(simd, strip[path.first - first..].as_flattened_mut(), LANES, &path.steps);
        }
        for (lane, x) in columns.chunks_exact_mut(height).take(lanes).enumerate() {
            for (row, x) in strip.iter().zip(&mut x[rows.clone()]) {
                *x = row[lane];
            }
        }
    }
}

/// The same on the columns, for the first `rows` rows (a multiple of `LANES`).
#[inline(always)]
pub(super) fn reflect_columns_late<S: Simd>(simd: S, t: &mut Square, paths: &[Path], rows: usize) {
    let (n, height) = (t.order(), t.height());
    for i in (0..rows).step_by(LANES) {
        for Path { first, steps } in paths {
            let whole = steps.len().min(n - first - 2);
            reflect(simd, &mut t.columns_from(*first)[i..], height, &steps[..whole]);
            if let Some(last) = steps.get(whole) {
                reflect_last_columns(t, *last, i..i + LANES);
            }
        }
    }
}

/// A reflection of two columns, the last ones.
#[inline(always)]
fn reflect_last_columns(t: &mut Square, [tau, v1, _]: [f64; 3], rows: Range<usize>) {
    let (n, height) = (t.order(), t.height());
    let (x0, x1) = t.columns_from(n - 2).split_at_mut(height);
    for (x0, x1) in x0[rows.clone()].iter_mut().zip(&mut x1[rows]) {
        let w = tau * (*x0 + v1 * *x1);
        *x0 -= w;
        *x1 -= v1 * w;
    }
}

/// `steps` on vectors of `LANES` numbers that lie `stride` apart.
#[inline(always)]
fn reflect<S: Simd>(simd: S, x: &mut [f64], stride: usize, steps: &[[f64; 3]]) {
    let width = VECTORS * S::F64_LANES;
    for at in (0..LANES).step_by(width) {
        reflect_part(simd, &mut x[at..], width, stride, steps);
    }
}

#[inline(always)]
fn reflect_part<S: Simd>(simd: S, x: &mut [f64], width: usize, stride: usize, steps: &[[f64; 3]]) {
    let load = |x: &[f64]| -> [S::f64s; VECTORS] {
        let x = S::as_simd_f64s(&x[..width]).0;
        std::array::from_fn(|k| x[k])
    };
    let (mut x0, mut x1) = (load(x), load(&x[stride..]));
    let mut rest = x;
    for &[tau, v1, v2] in steps {
        let x2 = load(&rest[2 * stride..]);
        let (tau, v1, v2) = (simd.splat_f64s(-tau), simd.splat_f64s(v1), simd.splat_f64s(v2));
        let done = S::as_mut_simd_f64s(&mut rest[..width]).0;
        for l in 0..VECTORS {
            let sum = simd.mul_add_e_f64s(v1, x1[l], simd.mul_add_e_f64s(v2, x2[l], x0[l]));
            let w = simd.mul_f64s(tau, sum);
            done[l] = simd.add_f64s(x0[l], w);
            x0[l] = simd.mul_add_e_f64s(v1, w, x1[l]);
            x1[l] = simd.mul_add_e_f64s(v2, w, x2[l]);
        }
        rest = &mut rest[stride..];
    }
    S::as_mut_simd_f64s(&mut rest[..width]).0.copy_from_slice(&x0);
    S::as_mut_simd_f64s(&mut rest[stride..stride + width]).0.copy_from_slice(&x1);
}
