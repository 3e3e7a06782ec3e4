//! How B and D change with the weight of one block of time.
//!
//! They solve the normal equations `sum_t phi_t e_t = 0` with `e = y - yhat` and the sensitivities phi of yhat to
//! `psi = (x0, B - K D, D)`. When the weight of block j rises and with it A, C and K change,
//! ```text
//! H dpsi = sum_{t in j} phi_t e_t - sum_t phi_t dyhat_t,    H = sum_t phi_t phi_t'
//! dx+ = (A - K C) dx + d(A - K C) x + dK y,    dyhat = C dx + dC x
//! ```
//! to first order (Gauss and Newton: phi itself is held, its change meets residuals that it does not depend on). The changes of
//! all blocks run through the record side by side.

use super::super::channels::Channels;
use super::super::condense::{condense, regressors};
use super::super::output_error::{Base, Part, join, without_disturbances};
use super::super::sensitivity::Sensitivity;
use super::blocks::TimeBlock;
use super::influence::PairChange;
use crate::linalg::{SequentialQr, least_squares};
use crate::{Mat, MatRef, Result};
use faer::Scale;
use rayon::prelude::*;

/// Samples held at a time.
const PIECE: usize = 256;

/// The right-hand sides of all blocks, one column each, for the common unknowns.
pub(super) fn input_changes(
    channels: &Channels<'_>,
    blocks: &[TimeBlock],
    changes: &[PairChange],
    base: &Base,
) -> Result<Mat<f64>> {
    let factors = condense(channels, &base.predictor, &base.unknowns);
    let parts: Vec<Part> = factors.iter().map(|f| join(f, &base.unknowns)).collect();
    let stacked = Stacked::new(changes);
    let experiments = channels.scaled();
    let outputs = without_disturbances(&experiments, &base.disturbances);
    let sums: Vec<Result<Mat<f64>>> = (0..parts.len())
        .into_par_iter()
        .map(|e| {
            let signals = &experiments[e];
            let known = regressors(signals.view(), &base.predictor);
            let known =
                (0..base.unknowns.outputs).map(|i| known.columns.of_output(known.signals.as_ref(), i)).collect();
            let (x0, y) = (&base.initial_states[e], &outputs[e]);
            let of_experiment = OfExperiment { u: &signals.u, y, known, x0, base };
            reduced(&parts[e], of_experiment.sums(e, blocks, &stacked).as_ref(), base.unknowns.own())
        })
        .collect();
    let common = base.unknowns.common();
    let (mut whole, mut right) = (SequentialQr::new(common + 1, common + 1), Mat::zeros(common, blocks.len()));
    for (part, sum) in parts.iter().zip(sums) {
        whole.fold_rows(part.common());
        right += sum?;
    }
    let r = whole.r().subcols(0, common);
    let half = least_squares("the normal equations of B and D", r.transpose(), right.as_ref())?.x;
    Ok(least_squares("the regressors of B and D", r, half.as_ref())?.x)
}

/// Takes off what the initial state and the disturbances adjust: `g - R12' R11^-T g0`.
fn reduced(part: &Part, sums: MatRef<'_, f64>, own: usize) -> Result<Mat<f64>> {
    let rest = sums.subrows(own, sums.nrows() - own);
    if own == 0 {
        return Ok(rest.to_owned());
    }
    let (r11, r12) = part.of_own();
    let share = least_squares("the regressors of an initial state", r11.transpose(), sums.subrows(0, own))?.x;
    Ok(rest - r12.transpose() * share)
}

/// The changes of all blocks below each other: row `l J + j` belongs to row l of block j.
struct Stacked {
    count: usize,
    a: Mat<f64>,
    c: Mat<f64>,
    k: Mat<f64>,
}

impl Stacked {
    fn new(changes: &[PairChange]) -> Self {
        let count = changes.len();
        let stack = |part: fn(&PairChange) -> &Mat<f64>| {
            let (rows, columns) = (part(&changes[0]).nrows(), part(&changes[0]).ncols());
            Mat::from_fn(rows * count, columns, |i, q| part(&changes[i % count])[(i / count, q)])
        };
        Stacked { count, a: stack(|c| &c.a), c: stack(|c| &c.c), k: stack(|c| &c.k) }
    }
}

struct OfExperiment<'a> {
    u: &'a Mat<f64>,
    /// Without the known disturbances.
    y: &'a Mat<f64>,
    /// The regressors of their coefficients, one matrix per output.
    known: Vec<Mat<f64>>,
    x0: &'a [f64],
    base: &'a Base,
}

impl OfExperiment<'_> {
    /// `sum_{t in j} phi_t e_t - sum_t phi_t dyhat_t` over `[x0 | disturbances | B D]`, a column per block.
    fn sums(&self, experiment: usize, blocks: &[TimeBlock], stacked: &Stacked) -> Mat<f64> {
        let unknowns = &self.base.unknowns;
        let (n, p, count) = (unknowns.states, unknowns.outputs, stacked.count);
        let mut sensitivities: Vec<_> = (0..p).map(|i| Sensitivity::new(&self.base.predictor, i, unknowns)).collect();
        let mut sums = Mat::zeros(unknowns.width() - 1, count);
        let (mut x, mut dx) = (self.x0.to_vec(), vec![0.0; n * count]);
        for (j, block) in blocks.iter().enumerate().filter(|(_, b)| b.experiment == experiment) {
            for start in block.samples.clone().step_by(PIECE) {
                let length = PIECE.min(block.samples.end - start);
                let states = self.states(start, length, &mut x);
                let (u, y) = (self.u.subrows(start, length), self.y.subrows(start, length));
                let changed = self.changed_outputs(states.as_ref(), y, stacked, &mut dx);
                let predicted = self.base.predictor.c.as_ref() * &states;
                let by_d = u * self.base.d.transpose();
                for (i, sensitivity) in sensitivities.iter_mut().enumerate() {
                    let e: Vec<f64> = (0..length).map(|t| y[(t, i)] - predicted[(i, t)] - by_d[(t, i)]).collect();
                    let width = unknowns.width_of_output(i);
                    let mut phi = Mat::zeros(length, width);
                    sensitivity.fill(u, self.known[i].subrows(start, length), &e, phi.as_mut());
                    let (phi, e) = phi.as_ref().split_at_col(width - 1);
                    let mut found = phi.transpose() * &changed[i] * Scale(-1.0);
                    let own = phi.transpose() * e;
                    (0..own.nrows()).for_each(|r| found[(r, j)] += own[(r, 0)]);
                    add(&mut sums, &found, unknowns.own() + unknowns.of_b(), unknowns.of_d_above(i));
                }
            }
        }
        sums
    }

    /// The states of the predictor at `length` samples, n x length; `x` moves on behind them.
    fn states(&self, start: usize, length: usize, x: &mut Vec<f64>) -> Mat<f64> {
        let Base { predictor, driven, .. } = self.base;
        let (u, y) = (self.u, self.y);
        let n = x.len();
        let mut states = Mat::zeros(n, length);
        for t in 0..length {
            let mut next = vec![0.0; n];
            for (l, next) in next.iter_mut().enumerate() {
                states[(l, t)] = x[l];
                *next = (0..n).map(|q| predictor.a[(l, q)] * x[q]).sum::<f64>();
                *next += (0..u.ncols()).map(|q| driven[(l, q)] * u[(start + t, q)]).sum::<f64>();
                if let Some(k) = &predictor.k {
                    *next += (0..y.ncols()).map(|q| k[(l, q)] * y[(start + t, q)]).sum::<f64>();
                }
            }
            *x = next;
        }
        states
    }

    /// `dyhat` of every output, length x blocks; `dx`, row l of block j at `l J + j`, moves on.
    fn changed_outputs(
        &self,
        states: MatRef<'_, f64>,
        y: MatRef<'_, f64>,
        stacked: &Stacked,
        dx: &mut Vec<f64>,
    ) -> Vec<Mat<f64>> {
        let predictor = &self.base.predictor;
        let (n, p, count, length) = (states.nrows(), predictor.c.nrows(), stacked.count, states.ncols());
        let drive = &stacked.a * states + &stacked.k * y.subcols(0, stacked.k.ncols()).transpose();
        let direct = &stacked.c * states;
        let mut outputs = vec![Mat::zeros(count, length); p];
        for t in 0..length {
            for (i, output) in outputs.iter_mut().enumerate() {
                let column = output.col_as_slice_mut(t);
                column.copy_from_slice(&direct.col_as_slice(t)[i * count..(i + 1) * count]);
                (0..n).for_each(|l| accumulate(column, predictor.c[(i, l)], &dx[l * count..(l + 1) * count]));
            }
            let mut next = drive.col_as_slice(t).to_vec();
            for (l, row) in next.chunks_exact_mut(count).enumerate() {
                (0..n).for_each(|q| accumulate(row, predictor.a[(l, q)], &dx[q * count..(q + 1) * count]));
            }
            *dx = next;
        }
        outputs.iter().map(|output| output.transpose().to_owned()).collect()
    }
}

/// `to += factor from`.
fn accumulate(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
}

/// Adds the sums of one output: those of its own row of D have their own place, `above` behind the shared ones.
fn add(sums: &mut Mat<f64>, found: &Mat<f64>, shared: usize, above: usize) {
    for j in 0..sums.ncols() {
        (0..shared).for_each(|r| sums[(r, j)] += found[(r, j)]);
        (shared..found.nrows()).for_each(|r| sums[(above + r, j)] += found[(r, j)]);
    }
}
