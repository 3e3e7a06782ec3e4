//! Sylvester equations of at most 2 x 2 unknowns, the kernels of every method that walks along the diagonal blocks of Schur
//! forms: written with Kronecker products as one, two or four linear equations, solved with complete pivoting.

/// A matrix of at most 2 x 2, by rows.
pub(super) type Entries = [[f64; 2]; 2];

/// Solution of a small equation.
pub(super) struct SmallSolution {
    /// X for the right-hand side `scale C`.
    pub(super) x: Entries,
    /// 1, except where X would overflow.
    pub(super) scale: f64,
    /// Size of the smallest pivot before replacement.
    pub(super) smallest_pivot: f64,
}

/// Solves `A X + X B' = C` for A (p x p), B (q x q) and `(p, q) = shape`, p, q <= 2.
#[inline(always)]
pub(super) fn solve_sum(shape: (usize, usize), a: &Entries, b: &Entries, c: &Entries) -> SmallSolution {
    solve(shape, c, |(i, j), (k, l)| {
        let left = if j == l { a[i][k] } else { 0.0 };
        let right = if i == k { b[j][l] } else { 0.0 };
        left + right
    })
}

/// Solves `A X B' - X = C`, likewise.
#[inline(always)]
pub(super) fn solve_product(shape: (usize, usize), a: &Entries, b: &Entries, c: &Entries) -> SmallSolution {
    solve(shape, c, |(i, j), (k, l)| a[i][k] * b[j][l] - if (i, j) == (k, l) { 1.0 } else { 0.0 })
}

/// `coefficient(e, u)` is that of the unknown `x[u]` in the equation of `c[e]`.
#[inline(always)]
fn solve(
    shape: (usize, usize),
    c: &Entries,
    coefficient: impl Fn((usize, usize), (usize, usize)) -> f64,
) -> SmallSolution {
    match shape {
        (1, 1) => solve_equations([(0, 0)], c, coefficient),
        (2, 1) => solve_equations([(0, 0), (1, 0)], c, coefficient),
        (1, _) => solve_equations([(0, 0), (0, 1)], c, coefficient),
        _ => solve_equations([(0, 0), (1, 0), (0, 1), (1, 1)], c, coefficient),
    }
}

/// Solves for the `unknowns`. Pivots below rounding are replaced by it, so that a solution always exists; the caller judges by
/// `smallest_pivot` or by a residual what it is worth.
#[inline(always)]
fn solve_equations<const N: usize>(
    unknowns: [(usize, usize); N],
    c: &Entries,
    coefficient: impl Fn((usize, usize), (usize, usize)) -> f64,
) -> SmallSolution {
    let mut matrix = unknowns.map(|e| unknowns.map(|u| coefficient(e, u)));
    let mut rhs = unknowns.map(|(i, j)| c[i][j]);
    let mut order = unknowns;
    let (mut largest, mut smallest_pivot) = (0.0_f64, f64::INFINITY);
    for k in 0..N {
        let (row, column) = pivot(&matrix, k);
        matrix.swap(k, row);
        rhs.swap(k, row);
        order.swap(k, column);
        matrix.iter_mut().for_each(|equation| equation.swap(k, column));
        let size = matrix[k][k].abs();
        (largest, smallest_pivot) = (largest.max(size), smallest_pivot.min(size));
        let floor = (f64::EPSILON * largest).max(f64::MIN_POSITIVE / f64::EPSILON);
        if size < floor {
            matrix[k][k] = floor;
        }
        for i in k + 1..N {
            let factor = matrix[i][k] / matrix[k][k];
            for j in k + 1..N {
                matrix[i][j] -= factor * matrix[k][j];
            }
            rhs[i] -= factor * rhs[k];
        }
    }
    let scale = overflow_guard(matrix[N - 1][N - 1].abs(), &rhs);
    let (mut x, mut solution) = ([[0.0; 2]; 2], [0.0; N]);
    for k in (0..N).rev() {
        let mut sum = rhs[k] * scale;
        for j in k + 1..N {
            sum -= matrix[k][j] * solution[j];
        }
        solution[k] = sum / matrix[k][k];
        x[order[k].0][order[k].1] = solution[k];
    }
    SmallSolution { x, scale, smallest_pivot }
}

/// Position of the largest entry of the equations from k on.
#[inline(always)]
fn pivot<const N: usize>(matrix: &[[f64; N]; N], k: usize) -> (usize, usize) {
    let (mut best, mut largest) = ((k, k), matrix[k][k].abs());
    for i in k..N {
        for j in k..N {
            if matrix[i][j].abs() > largest {
                (best, largest) = ((i, j), matrix[i][j].abs());
            }
        }
    }
    best
}

/// A factor that keeps the back-substitution from overflowing.
#[inline(always)]
fn overflow_guard(last: f64, rhs: &[f64]) -> f64 {
    let size = rhs.iter().fold(0.0_f64, |m, e| m.max(e.abs()));
    if size > 1e100 * last { 1e100 * last / size } else { 1.0 }
}
