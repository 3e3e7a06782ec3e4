//! `T Y + Y S' = D` and `T Y S' - Y = D` with quasi-triangular T and S, solved from the lower right corner: by halves, so that
//! most of the work is matrix products (I. Jonsson and B. Kågström, Recursive blocked algorithms for solving triangular systems, ACM
//! Trans. Math. Softw. 28 (2002), 392), and at last block by block.

use crate::linalg::eigen::schur::{DiagonalBlock, blocks};
use crate::linalg::kronecker::{Entries, SmallSolution, solve_product, solve_sum};
use crate::{Error, Result};
use faer::prelude::*;
use faer::{MatMut, MatRef};
use pulp::{Arch, NullaryFnOnce};

/// Order up to which an equation is not split.
const UNSPLIT: usize = 16;

/// The two equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// `A X + X B = C`.
    Sum,
    /// `A X B - X = C`.
    Product,
}

/// Solves `T Y + Y S' = D` or `T Y S' - Y = D` by halves of the longer side; Y takes the place of D. With `T = [T1 T12; 0 T2]` the
/// lower half of Y comes first, with `S = [S1 S12; 0 S2]` its right half.
pub(super) fn substitute(
    what: &str,
    form: Form,
    t: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
    mut y: MatMut<'_, f64>,
) -> Result<()> {
    let (n, m) = (t.nrows(), s.nrows());
    if n.max(m) <= UNSPLIT {
        return substitute_small(what, form, t, s, y);
    }
    if n >= m {
        let k = middle(t);
        let (t1, t12, _, t2) = t.split_at(k, k);
        let (mut upper, mut lower) = y.split_at_row_mut(k);
        substitute(what, form, t2, s, lower.rb_mut())?;
        let known = match form {
            Form::Sum => t12 * &lower,
            Form::Product => t12 * (&lower * s.transpose()),
        };
        upper -= known;
        return substitute(what, form, t1, s, upper);
    }
    let k = middle(s);
    let (s1, s12, _, s2) = s.split_at(k, k);
    let (mut left, mut right) = y.rb_mut().split_at_col_mut(k);
    substitute(what, form, t, s2, right.rb_mut())?;
    let known = &right * s12.transpose();
    left -= if form == Form::Sum { known } else { t * known };
    substitute(what, form, t, s1, left)
}

/// The same for `S = T` and a symmetric D: of the blocks beside the diagonal, only those above it.
pub(super) fn substitute_symmetric(what: &str, form: Form, t: MatRef<'_, f64>, mut y: MatMut<'_, f64>) -> Result<()> {
    if t.nrows() <= UNSPLIT {
        substitute_small(what, form, t, t, y.rb_mut())?;
        let mean = 0.5 * (&y + y.rb().transpose());
        y.copy_from(mean);
        return Ok(());
    }
    let k = middle(t);
    let (t1, t12, _, t2) = t.split_at(k, k);
    let (mut y1, mut y12, mut y21, mut y2) = y.split_at_mut(k, k);
    substitute_symmetric(what, form, t2, y2.rb_mut())?;
    let known = t12 * &y2;
    let half = match form {
        Form::Sum => {
            y12 -= known;
            substitute(what, form, t1, t2, y12.rb_mut())?;
            &y12 * t12.transpose()
        }
        Form::Product => {
            y12 -= &known * t2.transpose();
            substitute(what, form, t1, t2, y12.rb_mut())?;
            (t1 * &y12 + 0.5 * known) * t12.transpose()
        }
    };
    y1 -= &half + half.transpose();
    y21.copy_from(y12.transpose());
    substitute_symmetric(what, form, t1, y1)
}

/// A row near the middle between two diagonal blocks.
fn middle(t: MatRef<'_, f64>) -> usize {
    let k = t.nrows() / 2;
    if t[(k, k - 1)] == 0.0 { k } else { k + 1 }
}

/// A small matrix by columns, filled up with zeros.
type Tile = [[f64; UNSPLIT]; UNSPLIT];

fn tile(m: MatRef<'_, f64>) -> Tile {
    let mut tile = [[0.0; UNSPLIT]; UNSPLIT];
    for (j, column) in tile.iter_mut().enumerate().take(m.ncols()) {
        for (i, x) in column.iter_mut().enumerate().take(m.nrows()) {
            *x = m[(i, j)];
        }
    }
    tile
}

/// The equation of at most `UNSPLIT` rows and columns.
fn substitute_small(
    what: &str,
    form: Form,
    t: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
    mut y: MatMut<'_, f64>,
) -> Result<()> {
    let (rows, columns) = (blocks(t), blocks(s));
    let mut small =
        Small { form, t: tile(t), s: tile(s), above: tile(t), y: tile(y.rb()), rows: &rows, columns: &columns };
    for &DiagonalBlock { start, size } in &rows {
        small.above[start..start + size].iter_mut().for_each(|column| column[start..].fill(0.0));
    }
    let rcond = Arch::new().dispatch(&mut small);
    if rcond.is_nan() || rcond <= f64::EPSILON {
        return Err(Error::Singular { what: format!("the equation of {what}"), rcond: rcond.max(0.0) });
    }
    for j in 0..y.ncols() {
        for i in 0..y.nrows() {
            y[(i, j)] = small.y[j][i];
        }
    }
    Ok(())
}

/// A small equation, compiled for each kind of processor.
struct Small<'a> {
    form: Form,
    t: Tile,
    s: Tile,
    /// T without its diagonal blocks.
    above: Tile,
    y: Tile,
    rows: &'a [DiagonalBlock],
    columns: &'a [DiagonalBlock],
}

impl NullaryFnOnce for &mut Small<'_> {
    type Output = f64;

    /// Solves block column by block column from the right; returns the worst ratio of a pivot to the size of its block.
    #[inline(always)]
    fn call(self) -> f64 {
        let mut rcond = f64::INFINITY;
        for &column in self.columns.iter().rev() {
            self.subtract_known(column);
            for &row in self.rows.iter().rev() {
                let found = self.solve_block(row, column);
                // Also for a ratio that is not a number.
                rcond = if found >= rcond { rcond } else { found };
                if rcond.is_nan() {
                    return rcond;
                }
            }
        }
        rcond
    }
}

/// `y -= factor x`.
#[inline(always)]
fn subtract(y: &mut [f64; UNSPLIT], factor: f64, x: &[f64; UNSPLIT]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y -= factor * x;
    }
}

/// The entries of a diagonal block by rows.
#[inline(always)]
fn diagonal(tile: &Tile, k: usize, size: usize) -> Entries {
    let entry = |i: usize, j: usize| if i < size && j < size { tile[k + j][k + i] } else { 0.0 };
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

#[inline(always)]
fn largest(entries: &Entries) -> f64 {
    entries.as_flattened().iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

impl Small<'_> {
    /// Y_right S'_right of the solved columns enters a block column as it is, or multiplied by T.
    #[inline(always)]
    fn subtract_known(&mut self, column: DiagonalBlock) {
        let Small { form, t, s, y, .. } = self;
        for j in column.start..column.start + column.size {
            let (unsolved, solved) = y.split_at_mut(column.start + column.size);
            let weights = s[column.start + column.size..].iter().map(|s| s[j]);
            match form {
                Form::Sum => solved.iter().zip(weights).for_each(|(x, weight)| subtract(&mut unsolved[j], weight, x)),
                Form::Product => {
                    let mut known = [0.0; UNSPLIT];
                    solved.iter().zip(weights).for_each(|(x, weight)| subtract(&mut known, -weight, x));
                    t.iter().zip(known).for_each(|(t, known)| subtract(&mut unsolved[j], known, t));
                }
            }
        }
    }

    /// Solves for one block of Y and subtracts what it means for the rows above.
    #[inline(always)]
    fn solve_block(&mut self, row: DiagonalBlock, column: DiagonalBlock) -> f64 {
        let (i, j, height, width) = (row.start, column.start, row.size, column.size);
        let (t, s) = (diagonal(&self.t, i, height), diagonal(&self.s, j, width));
        let entry = |r: usize, k: usize| if r < height && k < width { self.y[j + k][i + r] } else { 0.0 };
        let rhs = [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]];
        let (SmallSolution { x, smallest_pivot, .. }, size) = match self.form {
            Form::Sum => (solve_sum((height, width), &t, &s, &rhs), largest(&t) + largest(&s)),
            Form::Product => (solve_product((height, width), &t, &s, &rhs), largest(&t) * largest(&s) + 1.0),
        };
        for k in 0..width {
            for r in 0..height {
                self.y[j + k][i + r] = x[r][k];
                let weight = match self.form {
                    Form::Sum => x[r][k],
                    Form::Product => x[r][0] * s[k][0] + x[r][1] * s[k][1],
                };
                subtract(&mut self.y[j + k], weight, &self.above[i + r]);
            }
        }
        smallest_pivot / size
    }
}
