//! The part of the inputs that the excitation explains.

use super::{Channels, RecordLines, Sums, least_power, sums};
use crate::identify::verdict::limits::LEAST_EXPLAINED;
use crate::identify::verdict::partition::Partition;
use faer::{Mat, Side, c64};

/// The inputs as far as the excitation explains them, lines x m for each record: `S_ux S_xx^-1 x` in each band. Lines without a window:
/// a window hides what a sweep excites at the ends of a record, and what the ends leak is small beside what an input is asked for here.
pub(crate) fn explained_inputs(records: &[RecordLines<'_>], channels: Channels) -> Vec<Vec<c64>> {
    let Channels { m, p, q } = channels;
    let lines: usize = records.iter().map(|r| r.v.len() / p.max(1)).sum();
    let partition = Partition::equal(lines, channels);
    let all = sums(records, channels, &partition);
    let least = least_power(&all, channels);
    let gains: Vec<Option<Mat<c64>>> = all.iter().map(|s| gain(s, least(s))).collect();
    let of = |r: &RecordLines<'_>| {
        let total = r.u.len() / m.max(1);
        let mut out = vec![c64::ZERO; total * m];
        for k in 0..total {
            let Some(gain) = &gains[partition.of(k as f64 / total as f64)] else { continue };
            for j in 0..m {
                out[k * m + j] = (0..q).fold(c64::ZERO, |sum, a| sum + gain[(j, a)] * r.x[k * q + a]);
            }
        }
        out
    };
    records.iter().map(of).collect()
}

/// `S_ux S_xx^-1` along the directions of the excitation that explain more of an input than chance does.
fn gain(sums: &Sums, least: f64) -> Option<Mat<c64>> {
    let eigen = sums.xx.self_adjoint_eigen(Side::Lower).ok()?;
    let along = &sums.ux * eigen.U();
    let (m, q) = (along.nrows(), along.ncols());
    let explained = |i: usize, k: usize| along[(i, k)].norm_sqr() / eigen.S()[k].re;
    let strong: Vec<usize> = (0..q).filter(|k| eigen.S()[*k].re > least).collect();
    let free = (sums.lines as f64 - strong.len() as f64).max(1.0);
    let left = |i: usize| (sums.uu[(i, i)].re - strong.iter().map(|k| explained(i, *k)).sum::<f64>()).max(0.0) / free;
    let left: Vec<f64> = (0..m).map(left).collect();
    let moves = |k: &usize| (0..m).any(|i| explained(i, *k) > LEAST_EXPLAINED * left[i]);
    let mut inverse = vec![0.0; q];
    strong.iter().filter(|k| moves(k)).for_each(|k| inverse[*k] = 1.0 / eigen.S()[*k].re);
    let scaled = Mat::from_fn(m, q, |i, k| along[(i, k)] * inverse[k]);
    Some(&scaled * eigen.U().adjoint())
}
