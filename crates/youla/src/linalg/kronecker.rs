//! Sylvester equations of at most 2 x 2 unknowns, the kernels of every method that walks along the diagonal blocks of Schur
//! forms: written with Kronecker products as at most four linear equations, solved with complete pivoting.

use faer::{Mat, MatRef};

/// Solves `A X + X B' = scale C` for A (p x p) and B (q x q), p, q <= 2.
///
/// `scale` is 1 except where the solution would overflow by nearness to singularity; pivots below rounding are replaced by
/// it, so that a solution always exists (the caller checks what it is worth).
pub(super) fn small_sylvester(a: MatRef<'_, f64>, b: MatRef<'_, f64>, c: MatRef<'_, f64>) -> (Mat<f64>, f64) {
    let mut system = Small::new(c);
    for j in 0..b.nrows() {
        for i in 0..a.nrows() {
            for l in 0..a.nrows() {
                *system.entry((i, j), (l, j)) += a[(i, l)];
            }
            for l in 0..b.nrows() {
                *system.entry((i, j), (i, l)) += b[(j, l)];
            }
        }
    }
    let (x, scale, _) = system.solve();
    (x, scale)
}

/// At most four equations in the unknowns of a small matrix X, taken column by column.
pub(super) struct Small {
    rows: usize,
    columns: usize,
    matrix: [[f64; 4]; 4],
    rhs: [f64; 4],
}

impl Small {
    /// Equations with the right-hand side `c` and no coefficients yet.
    pub(super) fn new(c: MatRef<'_, f64>) -> Self {
        let (rows, columns) = (c.nrows(), c.ncols());
        let mut rhs = [0.0; 4];
        for j in 0..columns {
            for i in 0..rows {
                rhs[i + j * rows] = c[(i, j)];
            }
        }
        Small { rows, columns, matrix: [[0.0; 4]; 4], rhs }
    }

    /// Coefficient of the unknown `x[unknown]` in the equation of `c[equation]`.
    pub(super) fn entry(&mut self, equation: (usize, usize), unknown: (usize, usize)) -> &mut f64 {
        &mut self.matrix[equation.0 + equation.1 * self.rows][unknown.0 + unknown.1 * self.rows]
    }

    /// Solution, scale and the size of the smallest pivot before replacement.
    pub(super) fn solve(mut self) -> (Mat<f64>, f64, f64) {
        let n = self.rows * self.columns;
        let mut order = [0, 1, 2, 3];
        let (mut largest, mut smallest) = (0.0_f64, f64::INFINITY);
        for k in 0..n {
            let (row, column) = self.pivot(k, n);
            self.matrix.swap(k, row);
            self.rhs.swap(k, row);
            order.swap(k, column);
            for equation in &mut self.matrix[..n] {
                equation.swap(k, column);
            }
            let size = self.matrix[k][k].abs();
            (largest, smallest) = (largest.max(size), smallest.min(size));
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
        let scale = self.overflow_guard(n);
        let mut x = Mat::zeros(self.rows, self.columns);
        let mut solution = [0.0; 4];
        for k in (0..n).rev() {
            let mut sum = self.rhs[k] * scale;
            for j in k + 1..n {
                sum -= self.matrix[k][j] * solution[j];
            }
            solution[k] = sum / self.matrix[k][k];
        }
        for k in 0..n {
            x[(order[k] % self.rows, order[k] / self.rows)] = solution[k];
        }
        (x, scale, smallest)
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
