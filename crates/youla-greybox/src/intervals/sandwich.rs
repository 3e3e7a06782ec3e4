//! Covariance of the estimate where the residuals are coloured, in two passes over the records.
//!
//! ```text
//! cov theta = (J'J)^-1 (sum_t sum_s J_t' R_e(t - s) J_s) (J'J)^-1
//! ```
//! (L. Ljung, System Identification: Theory for the User, 2nd ed., 1999, section 9.3, for an input that does not depend on the
//! noise: open loop, or the external signal of a simulated loop). R_e is the sample correlation of the residuals, tapered by
//! the window of Parzen, so that the sum stays positive. J are the sensitivities without the part that the initial states can
//! remove. Beside the records, memory goes with the number of lags.

use super::lags::History;
use super::residuals::ResidualSums;
use crate::GreyBoxModel;
use crate::prediction::sensitivity::{condense, rows};
use crate::prediction::sensitivity_bank::InitialCondition;
use crate::prediction::small_qr::dot;
use crate::search::criterion::{Criterion, Point, Slopes};
use crate::search::uncertainty::{Information, spread};
use crate::{Error, Result};
use faer::Scale;
use youla::Mat;
use youla::linalg::{leading_rank, least_squares};

/// First pass: lagged products of residuals and inputs, over `lags` lags.
pub(super) fn residual_sums(criterion: &Criterion<'_>, point: &Point, lags: usize) -> Result<ResidualSums> {
    let (p, m) = (criterion.outputs(), point.sampled.inputs());
    let mut found = ResidualSums::new(p, m, lags);
    for (samples, x0) in criterion.experiments.iter().zip(&point.initial_states) {
        let begin = InitialCondition { x0, slopes: None, estimated: 0 };
        found.sums.restart();
        let mut first = 0;
        let mut take = |piece: &mut [f64], count: usize| {
            let count = count / p;
            let u = &samples.u[first * m..];
            let value = |signal: usize, k: usize| match signal.checked_sub(p) {
                None => piece[k * p + signal],
                Some(input) => u[k * m + input],
            };
            found.sums.take(count, value);
            first += count;
        };
        rows(samples, &point.sampled, &[], &begin, &mut take)?;
        found.samples += first;
    }
    Ok(found)
}

/// Second pass: the sum in the middle, q x q.
pub(super) fn middle(
    criterion: &Criterion<'_>,
    point: &Point,
    slopes: &Slopes,
    residuals: &ResidualSums,
    lags: usize,
) -> Result<Mat<f64>> {
    let (p, q, initial) = (criterion.outputs(), slopes.simulated.len(), criterion.initial);
    let mut history = History::new(p * q, lags);
    let mut half = Mat::<f64>::zeros(q, q);
    for (samples, x0) in criterion.experiments.iter().zip(&point.initial_states) {
        let moved = criterion.moved(point, slopes, x0, samples)?;
        let begin = InitialCondition { x0, slopes: moved.as_ref().map(|m| m.as_ref()), estimated: initial };
        let removed = if initial == 0 {
            Mat::zeros(0, q)
        } else {
            let factor = condense(samples, &point.sampled, &slopes.simulated, &begin)?;
            let rank = leading_rank(factor.as_ref(), initial);
            let (r11, r12) = factor.as_ref().submatrix(0, 0, rank, initial + q).split_at_col(initial);
            least_squares("the sensitivity to the initial state", r11, r12)?.x
        };
        history.restart();
        let mut take = |piece: &mut [f64], count: usize| {
            let value = |signal: usize, k: usize| {
                let row = k * p + signal / q;
                let own = piece[(initial + signal % q) * count + row];
                (0..initial).fold(own, |value, j| value - piece[j * count + row] * removed[(j, signal % q)])
            };
            history.take(count / p, value);
            add_products(&mut half, &history, residuals, lags);
        };
        rows(samples, &point.sampled, &slopes.simulated, &begin, &mut take)?;
    }
    Ok(&half + half.transpose())
}

/// `sum_i s_i(t)' sum_lag sum_l R_il(lag) s_l(t - lag)`, that of lag 0 by half.
fn add_products(half: &mut Mat<f64>, history: &History, residuals: &ResidualSums, lags: usize) {
    let (p, q) = (residuals.outputs, half.ncols());
    for (i, b) in (0..p).flat_map(|i| (0..q).map(move |b| (i, b))) {
        let mut weighted = vec![0.0; history.before(0, 0).len()];
        for (lag, l) in (0..=lags).flat_map(|lag| (0..p).map(move |l| (lag, l))) {
            let factor = residuals.residual(i, l, lag) * if lag == 0 { 0.5 } else { parzen(lag, lags) };
            let past = history.before(l * q + b, lag);
            weighted.iter_mut().zip(past).for_each(|(sum, s)| *sum += factor * s);
        }
        (0..q).for_each(|a| half[(a, b)] += dot(history.before(i * q + a, 0), &weighted));
    }
}

/// The window of Parzen (E. Parzen, Technometrics 3 (1961), 167).
fn parzen(lag: usize, lags: usize) -> f64 {
    let x = lag as f64 / (lags + 1) as f64;
    if x <= 0.5 { 1.0 - 6.0 * x * x * (1.0 - x) } else { 2.0 * (1.0 - x).powi(3) }
}

/// The covariance with the colour of the residuals, for the parameters that the estimate moved.
pub(super) fn coloured(
    criterion: &Criterion<'_>,
    point: &Point,
    found: &GreyBoxModel,
    middle: &Mat<f64>,
) -> Result<Mat<f64>> {
    let white = found.covariance.as_ref();
    let own = criterion.physical;
    let moved = |j: &usize| *j >= own || white.is_some_and(|w| w[(*j, *j)] > 0.0);
    let free: Vec<usize> = (0..criterion.parameters).filter(moved).collect();
    let size = |j: &usize| if point.theta[*j] == 0.0 { criterion.scales[*j] } else { point.theta[*j].abs() };
    let sizes: Vec<f64> = free.iter().map(size).collect();
    let here = criterion.linearise(point)?.along(&free);
    let Some(inverse) = Information::new(&here, &sizes, criterion.energy.sqrt()).inverse else {
        return Err(Error::Undetermined { sentences: found.undetermined.sentences() });
    };
    let inner = Mat::from_fn(free.len(), free.len(), |i, j| middle[(free[i], free[j])]);
    // As for white residuals: what the unknowns took from the residuals.
    let factor = found.residuals as f64 / criterion.degrees_of_freedom as f64;
    let all = spread((&inverse * inner * &inverse).as_ref(), &free, criterion.parameters);
    Ok(Scale(factor) * all.as_ref().submatrix(0, 0, own, own))
}
