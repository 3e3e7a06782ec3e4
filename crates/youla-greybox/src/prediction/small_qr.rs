//! The triangular factor of a tall matrix of few columns, `[R; rows] = Q R+` by Householder reflections that leave the zeros
//! of R alone (G. H. Golub and C. F. Van Loan, Matrix Computations, 4th ed., section 5.2).
//!
//! [`youla::linalg::SequentialQr`] does the same for wide matrices; with a dozen columns its blocking costs more than it saves,
//! and here each reflection is two passes over contiguous columns in the cache.

use faer::Mat;

/// Terms that are summed side by side.
const LANES: usize = 8;

/// R, in the making.
pub(crate) struct SmallQr {
    /// width x width.
    r: Mat<f64>,
}

impl SmallQr {
    pub(crate) fn new(width: usize) -> Self {
        SmallQr { r: Mat::zeros(width, width) }
    }

    pub(crate) fn into_factor(self) -> Mat<f64> {
        self.r
    }

    /// Folds in `count` rows, given by columns, which are used up.
    #[inline(always)]
    pub(crate) fn fold(&mut self, rows: &mut [f64], count: usize) {
        for j in 0..self.r.ncols() {
            let (done, later) = rows.split_at_mut((j + 1) * count);
            let column = &done[j * count..];
            let length = dot(column, column).sqrt();
            if length == 0.0 {
                continue;
            }
            // I - w w' / (beta (beta - alpha)) with w = [alpha - beta; column] takes [alpha; column] to [beta; 0].
            let alpha = self.r[(j, j)];
            let beta = -alpha.hypot(length).copysign(alpha);
            let head = alpha - beta;
            self.r[(j, j)] = beta;
            for (k, other) in later.chunks_exact_mut(count).enumerate() {
                let top = &mut self.r[(j, j + 1 + k)];
                let share = (head * *top + dot(column, other)) / (beta * -head);
                *top -= share * head;
                other.iter_mut().zip(column).for_each(|(value, w)| *value -= share * w);
            }
        }
    }
}

/// Inner product with eight running sums, which the compiler vectorises.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * b);
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gram_matrix_is_kept() {
        let value = |i: usize, j: usize| ((i * i * (j + 2)) as f64 + 1.0).sin() * [1.0, 1e-6, 1e6, 0.0][j];
        let h = Mat::from_fn(157, 4, value);
        let mut triangle = SmallQr::new(4);
        for (first, count) in [(0, 3), (3, 100), (103, 54)] {
            let mut rows: Vec<f64> = (0..4).flat_map(|j| (first..first + count).map(move |i| value(i, j))).collect();
            triangle.fold(&mut rows, count);
        }
        let r = triangle.into_factor();
        let (gram, found) = (h.transpose() * &h, r.transpose() * &r);
        for i in 0..4 {
            for j in 0..4 {
                let size = h.col(i).norm_l2() * h.col(j).norm_l2();
                assert!((gram[(i, j)] - found[(i, j)]).abs() <= 1e-14 * size, "{i} {j}");
                assert!(i <= j || r[(i, j)] == 0.0);
            }
        }
    }
}
