//! Groups of lines: what a search near a point needs of many of them.
//!
//! A model near the point leaves `v - dG U - dT` of the outputs, with v what the point leaves and dG and dT the changes of the plant and of what
//! the ends give. These vary little over lines that are closer to each other than to every pole, so that such a group counts by a
//! triangular factor,
//! ```text
//! sum over the group of |W (v - dG U - dT)|^2 = |W (R_v - dG R_u - dT R_1)|^2,      [U 1 v] = Q [R_u R_1 R_v]
//! ```
//! whose m + 1 + p rows are lines like others: with `y = R_v + G R_u + T R_1` at the middle of the group. The error is of second order in the
//! width and vanishes with the change; all lines decide at last.

use super::point::Point;
use super::residual::residual;
use crate::identify::likelihood::data::spectra::{Lines, Spectra};
use faer::{Mat, c64};
use std::f64::consts::TAU;
use std::ops::Range;

/// Width of a group over the distance of its first line to the nearest pole. Chosen: slopes differ by 7 % (root mean square) in it.
const WIDTH: f64 = 0.25;
/// Largest such distance, rad per sample: autoregressions of the noise have 40 coefficients.
const FARTHEST: f64 = 0.04;
/// Lines of which groups are made, at least: on fewer a search costs little, and its start may be so far away that groups lead it to a neighbour of
/// a narrow mode.
const MANY: usize = 5000;
/// Lines for each row of a group, and for each that is left in all, at least.
const LEAST: usize = 2;
/// Share of a column that is left of it below which it depends on those before it.
const DEPENDENT: f64 = 1e-12;

/// The lines in groups around a point, for modes with damping ratios from `damping` on beside those of its model; `None` where they are not many fewer.
pub(crate) fn grouped(spectra: &Spectra, point: &Point, damping: f64) -> Option<Spectra> {
    let (all, rows) = (spectra.lines(), spectra.inputs + 1 + spectra.outputs);
    if all < MANY.max(2 * LEAST * rows * spectra.records.len()) {
        return None;
    }
    let poles = point.model.poles();
    let near = |z: c64| poles.iter().map(|p| (z - p).norm()).fold(FARTHEST.min(damping * (z - 1.0).norm()), f64::min);
    let width = |lines: &Lines, k: usize| (WIDTH * near(lines.z[k]) * lines.samples as f64 / TAU) as usize;
    let records = spectra.records.iter().zip(&point.ends).map(|(lines, t)| {
        let v = residual(&point.model, lines, t);
        let mut out = Lines::new(lines.samples);
        let (mut groups, mut first) = (Vec::new(), 0);
        while first < lines.z.len() {
            let end = (first + width(lines, first)).min(lines.z.len());
            if end < first + LEAST * rows {
                out.push(lines, first);
                first += 1;
            } else {
                groups.push(out.z.len()..out.z.len() + rows);
                put(&mut out, lines, &v, first..end);
                first = end;
            }
        }
        let left = residual(&point.model, &out, t);
        let of_groups = groups.into_iter().flat_map(|rows| rows.start * spectra.outputs..rows.end * spectra.outputs);
        of_groups.for_each(|i| out.y[i] = out.y[i] * 2.0 - left[i]);
        out
    });
    let out = Spectra { records: records.collect(), delays: spectra.delays.clone(), ..*spectra };
    (LEAST * out.lines() < all).then_some(out)
}

/// The rows of the triangular factor of `[U 1 v]` of a group, from its products.
fn put(out: &mut Lines, lines: &Lines, v: &[c64], group: Range<usize>) {
    let (m, p) = (lines.u.len() / lines.z.len(), lines.y.len() / lines.z.len());
    let q = m + 1 + p;
    let mut gram = Mat::<c64>::zeros(q, q);
    let mut row = vec![c64::ZERO; q];
    for k in group.clone() {
        row[..m].copy_from_slice(&lines.u[k * m..(k + 1) * m]);
        row[m] = lines.ends[k];
        row[m + 1..].copy_from_slice(&v[k * p..(k + 1) * p]);
        row.iter_mut().for_each(|x| *x *= lines.weight[k]);
        for j in 0..q {
            (0..=j).for_each(|i| gram[(i, j)] += row[i].conj() * row[j]);
        }
    }
    let share = group.clone().map(|k| lines.share[k]).sum::<f64>() / q as f64;
    let least: Vec<f64> = (0..q).map(|i| DEPENDENT * gram[(i, i)].re).collect();
    let middle = lines.z[(group.start + group.end - 1) / 2];
    for (i, least) in least.into_iter().enumerate() {
        let square = gram[(i, i)].re;
        let scale = if square > least { 1.0 / square.sqrt() } else { 0.0 };
        (0..q).for_each(|j| row[j] = if j < i { c64::ZERO } else { gram[(i, j)] * scale });
        for j in i + 1..q {
            (i + 1..=j).for_each(|l| gram[(l, j)] -= row[l].conj() * row[j]);
        }
        out.z.push(middle);
        out.weight.push(1.0);
        out.share.push(share);
        out.u.extend_from_slice(&row[..m]);
        out.ends.push(row[m]);
        out.y.extend_from_slice(&row[m + 1..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::likelihood::data::spectra::Sizes;
    use crate::identify::likelihood::search::model::Model;
    use crate::identify::likelihood::search::noise::Noise;
    use crate::identify::likelihood::search::point::energy;
    use crate::identify::likelihood::search::{DAMPED, with_best_inputs};
    use crate::identify::subspace::Experiment;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// At its point a model leaves on groups what it leaves on all lines; what a change adds to that is the same within 1 %.
    #[test]
    fn groups_count_as_their_lines() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut random = || rng.random::<f64>() - 0.5;
        let (mut x, u) = (0.0, Mat::from_fn(20_000, 1, |_, _| random()));
        let y = Mat::from_fn(20_000, 1, |t, _| {
            let y = x + random();
            x = 0.95 * x + u[(t, 0)];
            y
        });
        let records = [Experiment::new(u.as_ref(), y.as_ref())];
        let spectra = Spectra::new(&records, &Sizes::of(&records), &[0], 0);
        let (one, white) = (Mat::<f64>::identity(1, 1), Noise::white(1));
        let lag = Model::of((&one * 0.95).as_ref(), one.as_ref(), one.as_ref(), vec![0.0]).unwrap();
        let point = with_best_inputs(&spectra, lag, &white, false);
        let groups = grouped(&spectra, &point, DAMPED).unwrap();
        assert!(8 * groups.lines() < spectra.lines(), "{}", groups.lines());
        let mut moved = point.clone();
        moved.model.blocks[0].a[0] += 0.005;
        moved.model.blocks[0].b[0] *= 1.1;
        let [[now, then], [all_now, all_then]] =
            [&groups, &spectra].map(|lines| [&point, &moved].map(|at| energy(lines, &at.residuals(lines), &white)));
        assert!((now / all_now - 1.0).abs() < 1e-10, "{now} {all_now}");
        assert!(((then - now) / (all_then - all_now) - 1.0).abs() < 0.01, "{} {}", then - now, all_then - all_now);
    }
}
