//! Sylvester equations of at most 2 x 2 unknowns, the kernels of every method that walks along the diagonal blocks of Schur
//! forms: written with Kronecker products as at most four linear equations, solved with complete pivoting.

use faer::{Mat, MatRef};

/// Solution of a small equation.
pub(super) struct SmallSolution {
    /// X for the right-hand side `scale C`.
    pub(super) x: Mat<f64>,
    /// 1, except where X would overflow.
    pub(super) scale: f64,
    /// Size of the smallest pivot before replacement.
    pub(super) smallest_pivot: f64,
}

/// At most four equations in the unknowns of a small matrix X, taken column by column.
pub(super) struct Small {
    rows: usize,
    columns: usize,
    matrix: [[f64; 4]; 4],
    rhs: [f64; 4],
}

impl Small {
    /// The equation `A X + X B' = C` for A (p x p) and B (q x q), p, q <= 2.
    pub(super) fn sum(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> Self {
        Self::new(c, |(i, j), (k, l)| {
            let left = if j == l { a[(i, k)] } else { 0.0 };
            let right = if i == k { b[(j, l)] } else { 0.0 };
            left + right
        })
    }

    /// The equation `A X B' - X = C` for A (p x p) and B (q x q), p, q <= 2.
    pub(super) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> Self {
        Self::new(c, |(i, j), (k, l)| a[(i, k)] * b[(j, l)] - if (i, j) == (k, l) { 1.0 } else { 0.0 })
    }

    /// Equations with the right-hand side `c`; `coefficient(e, u)` is that of the unknown `x[u]` in the equation of `c[e]`.
    fn new(c: MatRef<'_, f64>, coefficient: impl Fn((usize, usize), (usize, usize)) -> f64) -> Self {
        let (rows, columns) = (c.nrows(), c.ncols());
        let mut small = Small { rows, columns, matrix: [[0.0; 4]; 4], rhs: [0.0; 4] };
        for e in 0..rows * columns {
            let equation = (e % rows, e / rows);
            small.rhs[e] = c[equation];
            for u in 0..rows * columns {
                small.matrix[e][u] = coefficient(equation, (u % rows, u / rows));
            }
        }
        small
    }

    /// Solves with complete pivoting. Pivots below rounding are replaced by it, so that a solution always exists; the
    /// caller judges by `smallest_pivot` or by a residual what it is worth.
    pub(super) fn solve(mut self) -> SmallSolution {
        let n = self.rows * self.columns;
        let mut order = [0, 1, 2, 3];
        let (mut largest, mut smallest_pivot) = (0.0_f64, f64::INFINITY);
        for k in 0..n {
            let (row, column) = self.pivot(k, n);
            self.matrix.swap(k, row);
            self.rhs.swap(k, row);
            order.swap(k, column);
            for equation in &mut self.matrix[..n] {
                equation.swap(k, column);
            }
            let size = self.matrix[k][k].abs();
            (largest, smallest_pivot) = (largest.max(size), smallest_pivot.min(size));
            let floor = (f64::EPSILON * largest).max(f64::MIN_POSITIVE / f64::EPSILON);
            if size < floor {
                self.matrix[k][k] = floor;
            }
            for i in k + 1..n {
                let factor = self.matrix[i][k] / self.matrix[k][k];
                for j in k + 1..n {
                    self.matrix[i][j] -= factor * self.matrix[k][j];
                }
                self.rhs[i] -= factor * self.rhs[k];
            }
        }
        let (x, scale) = self.substitute(order);
        SmallSolution { x, scale, smallest_pivot }
    }

    /// Back-substitution after elimination; `order` says which unknown stands in which column.
    fn substitute(&self, order: [usize; 4]) -> (Mat<f64>, f64) {
        let n = self.rows * self.columns;
        let scale = self.overflow_guard(n);
        let mut x = Mat::zeros(self.rows, self.columns);
        let mut solution = [0.0; 4];
        for k in (0..n).rev() {
            let mut sum = self.rhs[k] * scale;
            for j in k + 1..n {
                sum -= self.matrix[k][j] * solution[j];
            }
            solution[k] = sum / self.matrix[k][k];
            x[(order[k] % self.rows, order[k] / self.rows)] = solution[k];
        }
        (x, scale)
    }

    /// Position of the largest entry of the remaining equations.
    fn pivot(&self, k: usize, n: usize) -> (usize, usize) {
        let mut best = (k, k);
        for i in k..n {
            for j in k..n {
                if self.matrix[i][j].abs() > self.matrix[best.0][best.1].abs() {
                    best = (i, j);
                }
            }
        }
        best
    }

    /// A factor that keeps the back-substitution from overflowing.
    fn overflow_guard(&self, n: usize) -> f64 {
        let last = self.matrix[n - 1][n - 1].abs();
        let size = self.rhs[..n].iter().fold(0.0_f64, |m, e| m.max(e.abs()));
        if size > 1e100 * last { 1e100 * last / size } else { 1.0 }
    }
}
