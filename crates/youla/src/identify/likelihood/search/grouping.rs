//! Which poles share a block: those too close to each other to be distinguished.

use crate::linalg::{RealSchur, real_schur};
use faer::{Mat, MatRef, c64};

/// Condition of the transformation to blocks above which blocks are merged.
const LARGEST_CONDITION: f64 = 20.0;

/// The same for blocks of single poles: beyond it their bases hold no digits of use.
const SEPARABLE: f64 = 1e6;

/// States of the largest block that overlap alone makes.
const LARGEST_BLOCK: usize = 4;
/// Distance from the unit circle below which it does not count: poles slower than the records.
const CLOSE: f64 = 2e-4;

/// Distance from the unit circle beyond which poles count as no further: fast poles differ enough in what they do.
const FAST: f64 = 0.05;

/// Poles on either side of the circle, as 0.997 and 1.001, are exactly as far from each other as both are from it: they overlap as two on one side do.
const ACROSS: f64 = 1.01;

/// Groups of poles and a basis that separates them.
pub(crate) struct Grouped {
    /// Places of the poles of each block.
    pub(crate) groups: Vec<Vec<usize>>,
    /// Bases of their invariant subspaces side by side.
    pub(crate) basis: Mat<f64>,
}

/// The groups of the poles of A; without `merge` one per pole or pair as far as numbers allow.
pub(crate) fn grouped(a: MatRef<'_, f64>, merge: bool) -> Option<Grouped> {
    let form = real_schur("A", a).ok()?;
    let poles = form.eigenvalues();
    let mut groups = single(&poles);
    if merge {
        merge_overlapping(&mut groups, &poles);
    }
    let largest = if merge { LARGEST_CONDITION } else { SEPARABLE };
    loop {
        match invariant_bases(&form, &poles, &groups) {
            Some(basis) if groups.len() == 1 || condition(&basis) <= largest => return Some(Grouped { groups, basis }),
            _ if groups.len() == 1 => return None,
            _ => merge_closest(&mut groups, &poles),
        }
    }
}

/// One group per real pole or pair.
fn single(poles: &[c64]) -> Vec<Vec<usize>> {
    let mut groups = Vec::new();
    let mut i = 0;
    while i < poles.len() {
        let size = if poles[i].im != 0.0 { 2 } else { 1 };
        groups.push((i..(i + size).min(poles.len())).collect());
        i += size;
    }
    groups
}

/// Orthonormal bases of the invariant subspaces of the groups, side by side.
fn invariant_bases(form: &RealSchur, poles: &[c64], groups: &[Vec<usize>]) -> Option<Mat<f64>> {
    let n = poles.len();
    let mut all = Mat::zeros(n, n);
    let mut at = 0;
    for group in groups {
        let chosen = |p: c64| group.iter().any(|i| poles[*i] == p);
        let ordered = form.clone().reorder(chosen).ok()?;
        if ordered.dimension != group.len() {
            return None;
        }
        for j in 0..group.len() {
            (0..n).for_each(|i| all[(i, at + j)] = ordered.q[(i, j)]);
        }
        at += group.len();
    }
    Some(all)
}

fn condition(t: &Mat<f64>) -> f64 {
    match t.singular_values() {
        Ok(s) if !s.is_empty() && s[s.len() - 1] > 0.0 => s[0] / s[s.len() - 1],
        _ => f64::INFINITY,
    }
}

/// Merges groups with poles closer to each other than to the unit circle: there residues of single poles are ill determined and
/// steps in them short.
fn merge_overlapping(groups: &mut Vec<Vec<usize>>, poles: &[c64]) {
    let inside = |p: c64| (1.0 - p.norm()).abs().clamp(CLOSE, FAST);
    let overlap = |a: c64, b: c64| (a - b).norm() < ACROSS * (inside(a) + inside(b));
    let mut i = 0;
    while i < groups.len() {
        let other = (i + 1..groups.len()).find(|j| {
            let small = groups[i].len() + groups[*j].len() <= LARGEST_BLOCK;
            small && groups[i].iter().any(|a| groups[*j].iter().any(|b| overlap(poles[*a], poles[*b])))
        });
        match other {
            Some(j) => {
                let more = groups.remove(j);
                groups[i].extend(more);
            }
            None => i += 1,
        }
    }
}

/// Merges the two groups whose poles are closest.
fn merge_closest(groups: &mut Vec<Vec<usize>>, poles: &[c64]) {
    let mut best = (f64::INFINITY, 0, 1);
    for i in 0..groups.len() {
        for j in i + 1..groups.len() {
            for a in &groups[i] {
                for b in &groups[j] {
                    let distance = (poles[*a] - poles[*b]).norm();
                    if distance < best.0 {
                        best = (distance, i, j);
                    }
                }
            }
        }
    }
    let other = groups.remove(best.2);
    groups[best.1].extend(other);
}
