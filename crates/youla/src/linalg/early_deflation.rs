//! Aggressive early deflation: the Schur form of a window at the lower end of a Hessenberg block shows which eigenvalues have
//! converged although no subdiagonal entry is small, and the others serve as shifts (K. Braman, R. Byers and R. Mathias, The
//! multishift QR algorithm, part II, SIAM J. Matrix Anal. Appl. 23 (2002), 948).

use super::francis::{Shifts, iterate};
use super::multishift::apply;
use super::reflector::{householder, reflect_columns, reflect_rows};
use super::reorder::move_up;
use super::schur::{block_eigenvalues, blocks};
use super::{eye, hessenberg};
use faer::Mat;
use std::ops::Range;

/// What a window gave.
pub(super) struct Deflation {
    /// Rows deflated at the lower end.
    pub(super) deflated: usize,
    /// Eigenvalues of the rest of the window in pairs.
    pub(super) shifts: Vec<Shifts>,
}

/// Deflates what has converged in the last `size` rows of the unreduced rows `block`.
pub(super) fn deflate_early(t: &mut Mat<f64>, q: &mut Mat<f64>, block: Range<usize>, size: usize) -> Deflation {
    let size = size.min((block.len() - 1) / 2);
    let top = block.end - size;
    let coupling = t[(top, top - 1)];
    let mut window = t.submatrix(top, top, size, size).to_owned();
    let mut u = eye(size);
    if iterate("a window", &mut window, &mut u).is_err() {
        return Deflation { deflated: 0, shifts: Vec::new() };
    }
    let left = converged(&mut window, &mut u, coupling);
    let shifts = shifts(&window, left);
    if left == size {
        return Deflation { deflated: 0, shifts };
    }
    t[(top, top - 1)] = coupling * restore(&mut window, &mut u, left);
    t.as_mut().submatrix_mut(top, top, size, size).copy_from(&window);
    apply(t, q, top, size, u.as_ref());
    Deflation { deflated: size - left, shifts }
}

/// Moves the eigenvalues that have not converged to the top of the window; returns the order of what is left. The spike
/// `coupling * (first row of U)` is what couples the window to the rows above.
fn converged(window: &mut Mat<f64>, u: &mut Mat<f64>, coupling: f64) -> usize {
    let norm = window.norm_l2();
    let (mut left, mut kept) = (window.nrows(), 0);
    while kept < left {
        let pair = left >= kept + 2 && window[(left - 1, left - 2)] != 0.0;
        let first = left - 1 - usize::from(pair);
        let mut size = window[(left - 1, left - 1)].abs();
        if pair {
            size += (window[(left - 1, first)].abs() * window[(first, left - 1)].abs()).sqrt();
        }
        let size = if size == 0.0 { coupling.abs() } else { size };
        let spike = (first..left).map(|k| (coupling * u[(0, k)]).abs()).fold(0.0, f64::max);
        if spike <= (f64::EPSILON * size).max(f64::MIN_POSITIVE / f64::EPSILON) {
            left = first;
            continue;
        }
        // Blocks that cannot change places stay; what has been deflated so far holds.
        if move_up(window, u, first, kept, norm).is_err() {
            return left;
        }
        kept += left - first;
    }
    left
}

/// Eigenvalues of the first `left` rows as pairs of shifts; of an odd number of real ones, the first is left out.
fn shifts(window: &Mat<f64>, left: usize) -> Vec<Shifts> {
    let leading = window.submatrix(0, 0, left, left);
    let (mut found, mut single) = (Vec::new(), None::<f64>);
    for block in blocks(leading).into_iter().rev() {
        let p = block_eigenvalues(leading, block)[0];
        match (block.size, single) {
            (2, _) => found.push(Shifts { re: p.re, im: p.im, split: 0.0 }),
            (_, None) => single = Some(p.re),
            (_, Some(other)) => {
                single = None;
                found.push(Shifts { re: 0.5 * (p.re + other), im: 0.0, split: 0.5 * (p.re - other) });
            }
        }
    }
    found.reverse();
    found
}

/// Turns the spike of the first `left` rows into a single entry, and these rows back into Hessenberg form; returns the entry,
/// relative to the coupling.
fn restore(window: &mut Mat<f64>, u: &mut Mat<f64>, left: usize) -> f64 {
    if left == 0 {
        return 0.0;
    }
    let size = window.nrows();
    let mut spike: Vec<f64> = (0..left).map(|k| u[(0, k)]).collect();
    let (tau, beta) = householder(&mut spike);
    reflect_rows(window, &spike, tau, 0, 0..size);
    reflect_columns(window, &spike, tau, 0, 0..left);
    reflect_columns(u, &spike, tau, 0, 0..size);
    let Ok(form) = hessenberg("a window", window.submatrix(0, 0, left, left)) else { return beta };
    window.as_mut().submatrix_mut(0, 0, left, left).copy_from(&form.h);
    let right = form.q.transpose() * window.submatrix(0, left, left, size - left);
    window.as_mut().submatrix_mut(0, left, left, size - left).copy_from(&right);
    let moved = u.subcols(0, left) * &form.q;
    u.as_mut().subcols_mut(0, left).copy_from(&moved);
    beta
}
