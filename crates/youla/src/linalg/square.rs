//! A square matrix in one slice, for iterations that change a few rows or columns at a time.

use faer::{Mat, MatRef};
use std::ops::{Index, IndexMut};

/// n x n, column after column; a few rows of zeros may fill the columns up.
#[derive(Debug, Clone)]
pub(super) struct Square {
    n: usize,
    height: usize,
    entries: Vec<f64>,
}

impl Square {
    pub(super) fn new(m: MatRef<'_, f64>) -> Self {
        let n = m.nrows();
        // Columns a power of two apart would share few lines of the fastest memory.
        let height = if n.is_multiple_of(64) { n + 8 } else { n };
        let mut entries = vec![0.0; n * height];
        for (j, column) in entries.chunks_exact_mut(height).enumerate() {
            for (i, x) in column[..n].iter_mut().enumerate() {
                *x = m[(i, j)];
            }
        }
        Square { n, height, entries }
    }

    pub(super) fn to_mat(&self) -> Mat<f64> {
        let mut m = Mat::zeros(self.n, self.n);
        for (j, column) in self.entries.chunks_exact(self.height).enumerate() {
            m.col_as_slice_mut(j).copy_from_slice(&column[..self.n]);
        }
        m
    }

    #[inline(always)]
    pub(super) fn order(&self) -> usize {
        self.n
    }

    /// Rows of a column with those that fill it up.
    #[inline(always)]
    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// The columns from j on, one after the other.
    #[inline(always)]
    pub(super) fn columns_from(&mut self, j: usize) -> &mut [f64] {
        &mut self.entries[j * self.height..]
    }

    /// `m := P m` with `P = I - tau v v'` on the rows from `row` on, restricted to the columns from `column` on.
    #[inline(always)]
    pub(super) fn reflect_rows<const N: usize>(&mut self, v: &[f64; N], tau: f64, row: usize, column: usize) {
        let height = self.height;
        for x in self.columns_from(column).chunks_exact_mut(height) {
            let x = &mut x[row..row + N];
            let w = tau * x.iter().zip(v).map(|(x, v)| x * v).sum::<f64>();
            x.iter_mut().zip(v).for_each(|(x, v)| *x -= w * v);
        }
    }

    /// `m := m P`, where P acts on the columns from `column` on, restricted to the first `rows` rows.
    #[inline(always)]
    pub(super) fn reflect_columns<const N: usize>(&mut self, v: &[f64; N], tau: f64, column: usize, rows: usize) {
        let height = self.height;
        let mut columns = self.columns_from(column).chunks_exact_mut(height);
        let x: [&mut [f64]; N] = std::array::from_fn(|_| columns.next().map(|x| &mut x[..rows]).unwrap_or_default());
        for i in 0..rows {
            let w = tau * (0..N).map(|k| x[k][i] * v[k]).sum::<f64>();
            (0..N).for_each(|k| x[k][i] -= w * v[k]);
        }
    }

    pub(super) fn norm_max(&self) -> f64 {
        self.entries.iter().fold(0.0, |m, x| x.abs().max(m))
    }
}

impl Index<(usize, usize)> for Square {
    type Output = f64;

    #[inline(always)]
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.entries[j * self.height + i]
    }
}

impl IndexMut<(usize, usize)> for Square {
    #[inline(always)]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.entries[j * self.height + i]
    }
}
