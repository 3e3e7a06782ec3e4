//! The initial state with which a model reproduces a record best.

use super::{Discrete, StateSpace, simulate};
use crate::linalg::SequentialQr;
use crate::{Mat, MatRef, Result};
use faer::RowRef;

/// Outputs from the initial state with `min over x0 of sum |y(k) - C A^k x0 - (response to u)(k)|^2`; y has the shape of what
/// is simulated.
pub fn simulate_best(model: &StateSpace<Discrete>, u: MatRef<'_, f64>, y: MatRef<'_, f64>) -> Result<Mat<f64>> {
    let forced = simulate(model, u, &vec![0.0; model.order()])?;
    let x0 = initial_state(model, (y - &forced).as_ref());
    simulate(model, u, &x0)
}

/// Least-squares initial state of the free response `C A^k x0`. Samples after the response has decayed to 1e-9 of its
/// start carry no information and are not visited.
fn initial_state(model: &StateSpace<Discrete>, residual: MatRef<'_, f64>) -> Vec<f64> {
    let (n, p) = (model.order(), model.outputs());
    if n == 0 {
        return Vec::new();
    }
    let mut powers = FreeResponse::new(model);
    let floor = 1e-9 * powers.largest();
    let mut triangle = SequentialQr::new(n + 1, CHUNK * p);
    let mut start = 0;
    while start < residual.nrows() && powers.largest() > floor && powers.largest().is_finite() {
        let rows = CHUNK.min(residual.nrows() - start);
        triangle.fold(rows * p, |mut piece| {
            for k in 0..rows {
                for (i, row) in powers.rows.chunks_exact(n).enumerate() {
                    let values = row.iter().copied().chain([residual[(start + k, i)]]);
                    piece.as_mut().row_mut(k * p + i).iter_mut().zip(values).for_each(|(entry, value)| *entry = value);
                }
                powers.advance();
            }
        });
        start += rows;
    }
    let r = Mat::from_fn(n, n + 1, |i, j| if i < triangle.r().nrows() { triangle.r()[(i, j)] } else { 0.0 });
    // The singular value decomposition settles states that the outputs do not show: they stay zero.
    match r.subcols(0, n).thin_svd() {
        Ok(svd) => {
            let x0 = svd.pseudoinverse() * r.col(n);
            (0..n).map(|i| x0[i]).collect()
        }
        Err(_) => vec![0.0; n],
    }
}

/// `C A^k`, one contiguous row per output.
struct FreeResponse {
    /// The entries of each row of A that are not zero, by their column: a chain of delays has one a row.
    a: Vec<Vec<(usize, f64)>>,
    rows: Vec<f64>,
    next: Vec<f64>,
}

impl FreeResponse {
    fn new(model: &StateSpace<Discrete>) -> Self {
        let entries = |row: RowRef<'_, f64>| row.iter().copied().enumerate().filter(|(_, a)| *a != 0.0).collect();
        let rows = model.c().row_iter().flat_map(|row| row.iter().copied()).collect();
        FreeResponse { a: model.a().row_iter().map(entries).collect(), rows, next: vec![0.0; model.order()] }
    }

    /// NaN where an entry is not a number.
    fn largest(&self) -> f64 {
        self.rows.iter().fold(0.0, |largest, v| if v.abs() > largest || v.is_nan() { v.abs() } else { largest })
    }

    /// From `C A^k` to `C A^(k+1)`.
    fn advance(&mut self) {
        for row in self.rows.chunks_exact_mut(self.next.len()) {
            self.next.fill(0.0);
            for (value, entries) in row.iter().zip(&self.a) {
                entries.iter().for_each(|(column, a)| self.next[*column] += value * a);
            }
            row.copy_from_slice(&self.next);
        }
    }
}

/// Samples per block of the streaming least squares.
const CHUNK: usize = 256;
