//! The triangular factor of a tall matrix, row by row: `H = Q R` with `R' R = H' H`, of which only R is kept.
//!
//! A matrix with millions of rows is folded in pieces, `[R; new rows] = Q+ R+` (sequential TSQR; Demmel, Grigori,
//! Hoemmen, Langou, SIAM J. Sci. Comput. 34, 2012), in the memory of one piece. `R` is upper triangular and in echelon
//! form: a column that depends on the columns before it (to about 1e-11 of its length) opens no new row.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor::{qr_in_place, qr_in_place_scratch, recommended_block_size};
use faer::{Mat, MatMut, MatRef, Par};

/// Steps of the inverse iteration for a condition number; each costs two triangular solutions.
const STEPS: usize = 6;

/// Accumulates the triangular factor of a matrix with `width` columns.
///
/// ```
/// use youla::{Mat, linalg::SequentialQr};
/// let mut triangle = SequentialQr::new(1, 2);
/// triangle.fold(2, |mut rows| { rows[(0, 0)] = 3.0; rows[(1, 0)] = 4.0; });
/// assert!((triangle.r()[(0, 0)].abs() - 5.0).abs() < 1e-15);
/// ```
#[derive(Debug, Clone)]
pub struct SequentialQr {
    /// R in the first rows, room for new rows below.
    work: Mat<f64>,
    /// Rows of R that hold something.
    used: usize,
}

impl SequentialQr {
    /// An empty factor of `width` columns that takes up to `capacity` (at least 1) new rows at a time.
    pub fn new(width: usize, capacity: usize) -> Self {
        SequentialQr { work: Mat::zeros(width + capacity.max(1), width), used: 0 }
    }

    /// Takes up to `capacity` (at least 1) new rows at a time from now on; what is there stays.
    pub(crate) fn make_room(&mut self, capacity: usize) {
        let mut work = Mat::zeros(self.width() + capacity.max(1), self.width());
        work.as_mut().subrows_mut(0, self.used).copy_from(self.r());
        self.work = work;
    }

    /// Number of columns.
    pub(crate) fn width(&self) -> usize {
        self.work.ncols()
    }

    /// Folds in `count` new rows (at most the capacity), which `fill` writes into the zeroed view that it is given.
    pub fn fold(&mut self, count: usize, fill: impl FnOnce(MatMut<'_, f64>)) {
        let (rows, width) = (self.used + count, self.width());
        let mut stacked = self.work.as_mut().subrows_mut(0, rows);
        let mut fresh = stacked.as_mut().subrows_mut(self.used, count);
        fresh.fill(0.0);
        fill(fresh);
        reduce(stacked.as_mut());
        self.used = rows.min(width);
        for j in 0..width {
            stacked.as_mut().col_mut(j).subrows_mut((j + 1).min(self.used), self.used.saturating_sub(j + 1)).fill(0.0);
        }
    }

    /// Folds in the rows of a matrix.
    pub fn fold_rows(&mut self, rows: MatRef<'_, f64>) {
        let capacity = self.work.nrows() - self.width();
        for start in (0..rows.nrows()).step_by(capacity) {
            let part = rows.subrows(start, capacity.min(rows.nrows() - start));
            self.fold(part.nrows(), |mut fresh| fresh.copy_from(part));
        }
    }

    /// The factor: at most `width` rows, upper triangular.
    pub fn r(&self) -> MatRef<'_, f64> {
        self.work.as_ref().subrows(0, self.used)
    }
}

/// Householder QR in place; leaves R in the upper triangle.
fn reduce(mut a: MatMut<'_, f64>) {
    let (rows, columns) = (a.nrows(), a.ncols());
    let size = rows.min(columns);
    if size == 0 {
        return;
    }
    let block = recommended_block_size::<f64>(rows, columns);
    let mut coefficients = Mat::zeros(block, size);
    let scratch = qr_in_place_scratch::<f64>(rows, columns, block, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    qr_in_place(a.as_mut(), coefficients.as_mut(), Par::Seq, MemStack::new(&mut memory), Default::default());
}

/// Number of directions that the first `columns` columns of a factor `r` span: its rows down to the last one that holds
/// more than rounding there. In echelon form these are the leading rows.
pub fn leading_rank(r: MatRef<'_, f64>, columns: usize) -> usize {
    let leading = r.subcols(0, columns);
    let floor: Vec<f64> = (0..columns).map(|j| 1e-10 * leading.col(j).norm_l2()).collect();
    let significant = |i: &usize| (0..columns).any(|j| leading[(*i, j)].abs() > floor[j]);
    (0..r.nrows()).rev().find(significant).map_or(0, |last| last + 1)
}

/// Ratio of the largest to the smallest singular value of a lower triangular matrix whose rows have unit length, by inverse
/// iteration: at most the true one, and close to it.
pub(crate) fn triangular_condition(lower: MatRef<'_, f64>) -> f64 {
    let columns: Vec<Vec<f64>> =
        lower.col_iter().enumerate().map(|(j, column)| column.iter().skip(j).copied().collect()).collect();
    let largest = largest_singular(columns.len(), |v| {
        times(&columns, v);
        transposed_times(&columns, v);
    });
    let smallest = largest_singular(columns.len(), |v| {
        solve(&columns, v);
        transposed_solve(&columns, v);
    });
    largest * smallest
}

/// Square root of the largest eigenvalue of a symmetric positive definite map, by the power method from a fixed vector
/// without structure.
fn largest_singular(n: usize, map: impl Fn(&mut [f64])) -> f64 {
    let mut v: Vec<f64> = (0..n).map(|i| 1.0 + 0.5 * (1.7 * i as f64 + 0.3 * (i * i % 7) as f64).sin()).collect();
    let mut value = 0.0;
    for _ in 0..STEPS {
        let length = norm(&v);
        v.iter_mut().for_each(|x| *x /= length);
        map(&mut v);
        value = norm(&v);
    }
    value.sqrt()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// `v = L v` for the columns of L from the diagonal on.
fn times(columns: &[Vec<f64>], v: &mut [f64]) {
    for (j, column) in columns.iter().enumerate().rev() {
        let x = v[j];
        v[j] = 0.0;
        v[j..].iter_mut().zip(column).for_each(|(v, l)| *v += l * x);
    }
}

/// `v = L' v`.
fn transposed_times(columns: &[Vec<f64>], v: &mut [f64]) {
    for (j, column) in columns.iter().enumerate() {
        v[j] = dot(column, &v[j..]);
    }
}

/// `v = L^-1 v`.
fn solve(columns: &[Vec<f64>], v: &mut [f64]) {
    for (j, column) in columns.iter().enumerate() {
        v[j] /= column[0];
        let x = v[j];
        v[j + 1..].iter_mut().zip(&column[1..]).for_each(|(v, l)| *v -= l * x);
    }
}

/// `v = L^-T v`.
fn transposed_solve(columns: &[Vec<f64>], v: &mut [f64]) {
    for (j, column) in columns.iter().enumerate().rev() {
        v[j] = (v[j] - dot(&column[1..], &v[j + 1..])) / column[0];
    }
}

/// In eight sums, which the processor adds side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a8.zip(b8) {
        (0..8).for_each(|k| sums[k] += a[k] * b[k]);
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(rows: usize, columns: usize, seed: u64) -> Mat<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Mat::from_fn(rows, columns, |_, _| rng.random::<f64>() - 0.5)
    }

    #[test]
    fn gram_matrix_is_kept() {
        let h = random(157, 6, 1);
        let mut triangle = SequentialQr::new(6, 10);
        triangle.fold_rows(h.as_ref());
        let r = triangle.r();
        let gram = h.transpose() * &h;
        assert!((r.transpose() * r - &gram).norm_max() < 1e-13 * gram.norm_max());
        assert_eq!((r.nrows(), r[(3, 2)]), (6, 0.0));
    }

    #[test]
    fn dependent_column_opens_no_row() {
        let mut h = random(80, 4, 2);
        for i in 0..80 {
            h[(i, 2)] = h[(i, 0)] - 3.0 * h[(i, 1)];
        }
        let mut triangle = SequentialQr::new(4, 30);
        triangle.fold_rows(h.as_ref());
        let ranks: Vec<usize> = (0..=4).map(|k| leading_rank(triangle.r(), k)).collect();
        assert_eq!(ranks, [0, 1, 2, 2, 3]);
    }
}
