//! Dead time: how many of the newest inputs a long regression does without.

use crate::identify::likelihood::data::lag_sums::LagSums;
use crate::linalg::TINY;
use crate::statistics::chi_square_limit;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Normal quantile of the probability 1e-3 that an input that does not act is taken for one that does.
const QUANTILE: f64 = 3.09;

/// For each input the number of samples by which it can be delayed without loss: the largest d for which the coefficients of
/// u(t-1) ... u(t-d) are jointly zero for all outputs.
pub(crate) fn dead_times(sums: &LagSums, inputs: usize, largest: usize) -> Vec<usize> {
    let q = sums.channels;
    let p = q - inputs;
    let past = sums.lags - 1;
    let size = past * q;
    let z = sums.gram.submatrix(0, 0, size, size);
    let mean = (0..size).map(|i| z[(i, i)]).sum::<f64>() / size.max(1) as f64;
    let mut regular = z.to_owned();
    (0..size).for_each(|i| regular[(i, i)] += 1e-11 * mean);
    let Ok(cholesky) = regular.llt(Side::Lower) else { return vec![0; inputs] };
    let targets = sums.gram.submatrix(0, size + inputs, size, p).to_owned();
    let theta = cholesky.solve(&targets);
    let left = sums.gram.submatrix(size + inputs, size + inputs, p, p) - targets.transpose() * &theta;
    let degrees = (sums.windows as f64 - size as f64).max(1.0);
    let dead_time = |input: usize| {
        let count = largest.min(past / 2);
        let places: Vec<usize> = (1..=count).map(|lag| (past - lag) * q + input).collect();
        let unit = Mat::<f64>::from_fn(size, count, |i, j| if i == places[j] { 1.0 } else { 0.0 });
        let columns = cholesky.solve(&unit);
        let inverse = Mat::<f64>::from_fn(count, count, |i, j| columns[(places[i], j)]);
        let zero = |d: usize| {
            let Ok(factor) = inverse.submatrix(0, 0, d, d).llt(Side::Lower) else { return false };
            let statistic: f64 = (0..p)
                .map(|o| {
                    let b = Mat::<f64>::from_fn(d, 1, |i, _| theta[(places[i], o)]);
                    (b.transpose() * factor.solve(&b))[(0, 0)] / (left[(o, o)] / degrees).max(TINY)
                })
                .sum();
            statistic < chi_square_limit((d * p) as f64, QUANTILE)
        };
        (1..=count).take_while(|d| zero(*d)).last().unwrap_or(0)
    };
    (0..inputs).map(dead_time).collect()
}
