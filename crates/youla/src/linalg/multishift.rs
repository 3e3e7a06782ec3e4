//! The QR iteration with many shifts at a time: a chain of small bulges is chased through a diagonal window, and the window's
//! orthogonal factor is applied to the rest by matrix products (K. Braman, R. Byers and R. Mathias, The multishift QR
//! algorithm, part I, SIAM J. Matrix Anal. Appl. 23 (2002), 929). Blocks that have become small are left to the double-shift
//! iteration, in a window of their own.

use super::early_deflation::{Deflation, deflate_early};
use super::eye;
use super::francis::{Shifts, deflate, iterate};
use super::reflector::{householder, reflect_columns, reflect_rows};
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::ops::Range;

/// Order below which the whole matrix is left to the double-shift iteration.
const LARGE: usize = 110;

/// Order up to which a block that has split off is.
const SMALL: usize = 48;

/// Turns the Hessenberg matrix `t` into quasi-triangular form and accumulates the transformations in `q`.
pub(super) fn quasi_triangular(what: &str, t: &mut Mat<f64>, q: &mut Mat<f64>) -> Result<()> {
    let n = t.nrows();
    if n < LARGE {
        return iterate(what, t, q);
    }
    let (mut end, mut idle, mut total) = (n, 0, 0);
    while end > 0 {
        let start = deflate(t, end);
        if end - start <= SMALL {
            finish(what, t, q, start..end)?;
            (end, idle) = (start, 0);
            continue;
        }
        if total == 30 * n {
            return Err(Error::NoConvergence { what: format!("the Schur form of {what}"), iterations: total });
        }
        total += 1;
        let pairs = shift_pairs(end - start);
        let Deflation { deflated, shifts } = deflate_early(t, q, start..end, 3 * pairs + idle);
        end -= deflated;
        idle = if deflated > 0 { 0 } else { idle + 1 };
        // A window that deflates well is tried again before the next sweep.
        if 5 * deflated > 3 * pairs || end - start <= SMALL {
            continue;
        }
        let shifts =
            if shifts.is_empty() || idle % 6 == 5 { vec![Shifts::choose(t, start, end, idle + 5)] } else { shifts };
        let count = shifts.len().min(pairs);
        sweep(t, q, start..end, &shifts[shifts.len() - count..]);
    }
    Ok(())
}

/// Pairs of shifts for an active block of order n: as many as keep a chain short beside the block.
fn shift_pairs(n: usize) -> usize {
    match n {
        0..100 => 4,
        100..180 => 6,
        180..400 => 10,
        _ => 16,
    }
}

/// The double-shift iteration on the rows `window`, which are split off.
fn finish(what: &str, t: &mut Mat<f64>, q: &mut Mat<f64>, window: Range<usize>) -> Result<()> {
    let size = window.len();
    let mut local = t.submatrix(window.start, window.start, size, size).to_owned();
    let mut u = eye(size);
    iterate(what, &mut local, &mut u)?;
    t.as_mut().submatrix_mut(window.start, window.start, size, size).copy_from(&local);
    apply(t, q, window.start, size, u.as_ref());
    Ok(())
}

/// Applies the orthogonal U of the rows and columns `first .. first + size` to what lies above and right of the diagonal window,
/// and to Q.
pub(super) fn apply(t: &mut Mat<f64>, q: &mut Mat<f64>, first: usize, size: usize, u: MatRef<'_, f64>) {
    let n = t.nrows();
    let last = first + size;
    let right = u.transpose() * t.submatrix(first, last, size, n - last);
    t.as_mut().submatrix_mut(first, last, size, n - last).copy_from(&right);
    let above = t.submatrix(0, first, first, size) * u;
    t.as_mut().submatrix_mut(0, first, first, size).copy_from(&above);
    let accumulated = q.submatrix(0, first, q.nrows(), size) * u;
    q.as_mut().subcols_mut(first, size).copy_from(&accumulated);
}

/// One sweep with all `shifts` on the unreduced rows `block`: the chain is brought in at the top, moved on from window to window
/// and out at the bottom.
fn sweep(t: &mut Mat<f64>, q: &mut Mat<f64>, block: Range<usize>, shifts: &[Shifts]) {
    let chain = 3 * shifts.len();
    // Where the next reflection of each bulge acts; the leading one first.
    let mut positions: Vec<Option<usize>> = vec![None; shifts.len()];
    let mut top = block.start;
    loop {
        let bottom = (top + 2 * chain + 8).min(block.end);
        let size = bottom - top;
        let ends = bottom == block.end;
        let mut window = Window { t: t.submatrix(top, top, size, size).to_owned(), u: eye(size) };
        let mut limit = if ends { size - 1 } else { size - 3 };
        for (position, shifts) in positions.iter_mut().zip(shifts) {
            let local = position.map(|p| p - top);
            window.chase(local, limit, *shifts);
            *position = Some(top + limit);
            limit = if ends { limit } else { limit - 3 };
        }
        t.as_mut().submatrix_mut(top, top, size, size).copy_from(&window.t);
        apply(t, q, top, size, window.u.as_ref());
        if ends {
            return;
        }
        top = positions.last().copied().flatten().unwrap_or(block.end) - 1;
    }
}

/// A diagonal window in which bulges move.
struct Window {
    t: Mat<f64>,
    u: Mat<f64>,
}

impl Window {
    /// Moves one bulge until its next reflection would act on row `to`; from `None` it begins in row 0.
    fn chase(&mut self, from: Option<usize>, to: usize, shifts: Shifts) {
        let size = self.t.nrows();
        for k in from.unwrap_or(0)..to {
            let length = 3.min(size - k);
            let mut column = match k.checked_sub(1) {
                None => shifts.first_column(&self.t, 0),
                Some(previous) => [0, 1, 2].map(|i| if i < length { self.t[(k + i, previous)] } else { 0.0 }),
            };
            let v = &mut column[..length];
            let (tau, beta) = householder(v);
            if let Some(previous) = k.checked_sub(1) {
                self.t[(k, previous)] = beta;
                for i in 1..length {
                    self.t[(k + i, previous)] = 0.0;
                }
            }
            reflect_rows(&mut self.t, v, tau, k, k..size);
            reflect_columns(&mut self.t, v, tau, k, 0..size.min(k + 4));
            reflect_columns(&mut self.u, v, tau, k, 0..size);
        }
    }
}
