//! The loops of a plant with a controller for each channel: what channel i controls while the others o are closed,
//!
//! ```text
//! g_i = G_ii - G_io N_o (D_o + G_oo N_o)^-1 G_oi,        C = N / D diagonal, negative feedback
//! det(D + G N) = det(D_o + G_oo N_o) (D_i + g_i N_i)
//! ```
//!
//! so that `1 / (1 + g_i C_i)` is entry (i, i) of the sensitivity `(I + G C)^-1`: what ISO 14839-3 measures on each axis of a rotor.

use super::margins::OnGrid;
use youla::c64;

/// The loops at one line.
pub(super) struct Loops {
    /// g of each channel.
    pub(super) plants: Vec<c64>,
    work: Vec<c64>,
}

impl Loops {
    pub(super) fn new(channels: usize) -> Self {
        Loops { plants: vec![c64::ZERO; channels], work: vec![c64::ZERO; channels * channels] }
    }

    /// Finds the plants at line k for the response `g` (row by row) and returns `det(D + G N)`.
    pub(super) fn at(&mut self, g: &[c64], on: &[OnGrid], k: usize) -> c64 {
        let mut determinant = c64::ONE;
        for i in 0..on.len() {
            let others = self.close_others(g, on, k, i);
            determinant = others * (on[i].denominator[k] + self.plants[i] * on[i].numerator[k]);
        }
        determinant
    }

    /// Gaussian elimination of the other columns of `D + G N`, with column i of G in the place of its own; returns the determinant of the others.
    /// Without pivoting: a pivot of zero says that some of the loops are critical at this line.
    fn close_others(&mut self, g: &[c64], on: &[OnGrid], k: usize, i: usize) -> c64 {
        let (m, w) = (on.len(), &mut self.work[..]);
        for (column, c) in on.iter().enumerate() {
            let by = if column == i { c64::ONE } else { c.numerator[k] };
            (0..m).for_each(|row| w[row * m + column] = g[row * m + column] * by);
            if column != i {
                w[column * m + column] += c.denominator[k];
            }
        }
        let mut determinant = c64::ONE;
        for column in (0..m).filter(|column| *column != i) {
            let pivot = w[column * m + column];
            determinant *= pivot;
            for row in (0..m).filter(|row| *row == i || *row > column) {
                let factor = w[row * m + column] / pivot;
                (0..m).for_each(|j| w[row * m + j] -= factor * w[column * m + j]);
            }
        }
        self.plants[i] = w[i * m + i];
        determinant
    }
}
