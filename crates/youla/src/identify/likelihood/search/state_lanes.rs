//! States of a block on several lines at a time.

use super::block::Block;
use crate::identify::likelihood::data::lanes::{LANES, Lanes};
use faer::c64;

/// `M = (z I - A)^-1`, row by row, and `X = M (B U + z t)` of one block; with z what multiplies t.
#[inline(always)]
pub(crate) fn states(
    block: &Block,
    (z, ends, u): (&Lanes, &Lanes, &[Lanes]),
    t: &[f64],
    (inverse, x): (&mut [Lanes], &mut [Lanes]),
) {
    let (s, m) = (block.states, u.len());
    resolvent(block, z, inverse);
    x[..s].fill(Lanes::ZERO);
    for j in 0..s {
        let mut drive = ends.scaled(t[j]);
        (0..m).for_each(|l| drive.add_scaled(&u[l], block.b[j * m + l]));
        (0..s).for_each(|i| x[i].add_product(&inverse[i * s + j], &drive));
    }
}

/// (z I - A)^-1 of each line, row by row.
#[inline(always)]
pub(crate) fn resolvent(block: &Block, z: &Lanes, out: &mut [Lanes]) {
    if block.is_triangular() {
        return triangular(block, z, out);
    }
    let mut one = vec![c64::ZERO; block.a.len()];
    for l in 0..LANES {
        block.resolvent(c64::new(z.re[l], z.im[l]), &mut one);
        out.iter_mut().zip(&one).for_each(|(out, v)| (out.re[l], out.im[l]) = (v.re, v.im));
    }
}

/// The same for A with blocks A_ii of one or two states along its diagonal and zeros below them, from the last to the first:
/// R_ii = (z I - A_ii)^-1, R_ij = R_ii times the sum of A_ik R_kj over k > i.
#[inline(always)]
fn triangular(block: &Block, z: &Lanes, out: &mut [Lanes]) {
    let s = block.states;
    let a = |i: usize, j: usize| block.a[i * s + j];
    out[..s * s].fill(Lanes::ZERO);
    let mut end = s;
    while end > 0 {
        let first = if end > 1 && a(end - 1, end - 2) != 0.0 { end - 2 } else { end - 1 };
        if end - first == 1 {
            out[first * s + first] = z.shifted(-a(first, first)).inverse();
        } else {
            let (i, j) = (first, first + 1);
            let (p, q) = (z.shifted(-a(i, i)), z.shifted(-a(j, j)));
            let scale = p.times(&q).shifted(-a(i, j) * a(j, i)).inverse();
            (out[i * s + i], out[j * s + j]) = (q.times(&scale), p.times(&scale));
            (out[i * s + j], out[j * s + i]) = (scale.scaled(a(i, j)), scale.scaled(a(j, i)));
        }
        for j in end..s {
            for k in first..end {
                let mut sum = Lanes::ZERO;
                (end..s).for_each(|l| sum.add_scaled(&out[l * s + j], a(k, l)));
                for i in first..end {
                    let diagonal = out[i * s + k];
                    out[i * s + j].add_product(&diagonal, &sum);
                }
            }
        }
        end = first;
    }
}
