//! How A, C and K change with the weight of one block of time.
//!
//! The triangular factor R of the Hankel data becomes that of `R' R + STEP H_j' H_j`, with the Hankel columns H_j of the block,
//! and the method runs again on it for the same order. The common scale of R does not matter to A, C and K, so that this
//! direction alone is the influence of the block. The states of the second run are turned into those of the first,
//! ```text
//! Gamma_j T = Gamma  (least squares),    dA = (T^-1 A_j T - A) / STEP,   dC = (C_j T - C) / STEP,   dK = (T^-1 K_j - K) / STEP
//! ```
//! What T leaves open changes the states alone, and B is fitted to the A and C so found.

use super::super::channels::Channels;
use super::super::factorisation::{BlockWeights, HankelLq};
use super::super::output_error::Base;
use super::super::output_pair::OutputPair;
use super::super::projected::Projected;
use super::super::{Stability, SubspaceOptions, output_error, stability};
use super::blocks::TimeBlock;
use crate::linalg::{least_squares, observability, solve};
use crate::lti::Discrete;
use crate::{Mat, Result};
use faer::Scale;
use rayon::prelude::*;

/// Share by which the weight of a block is raised: the error of the difference quotient is of this size over the number of
/// blocks, and rounding is magnified by its inverse.
pub(super) const STEP: f64 = 0.02;

/// The change of the predictor's matrices for twice the weight of a block, to first order.
pub(super) struct PairChange {
    /// `A - K C`, n x n.
    pub(super) a: Mat<f64>,
    /// p x n.
    pub(super) c: Mat<f64>,
    /// n x p, or n x 0 for a simulation.
    pub(super) k: Mat<f64>,
}

/// The changes for all blocks; blocks in parallel.
pub(super) fn pair_changes(
    channels: &Channels<'_>,
    triangle: &HankelLq,
    blocks: &[TimeBlock],
    base: &Base,
    options: &SubspaceOptions,
    time: Discrete,
) -> Result<Vec<PairChange>> {
    let weights = BlockWeights::new(triangle);
    let gamma = observability(base.pair.a.as_ref(), base.pair.c.as_ref(), options.horizon.future());
    // The directions that known disturbances take are the same for all blocks but for ends of the size of the horizon.
    let experiments = channels.beyond_disturbances()?;
    let changes: Vec<Result<PairChange>> = blocks
        .par_iter()
        .map(|block| {
            let heavier = weights.raised(&experiments, block.experiment, block.columns.clone(), STEP)?;
            change(&heavier, base, &gamma, options, time)
        })
        .collect();
    changes.into_iter().collect()
}

fn change(
    heavier: &HankelLq,
    base: &Base,
    gamma: &Mat<f64>,
    options: &SubspaceOptions,
    time: Discrete,
) -> Result<PairChange> {
    let n = base.pair.a.nrows();
    let with_gain = base.predictor.k.is_some() && base.innovation_gain;
    let projected = Projected::new(heavier, options)?;
    let pair = projected.realise(n)?;
    let gain = if with_gain { projected.innovation(&pair)?.gain().map(|gain| gain.to_owned()) } else { None };
    let choice = if base.poles_moved { Stability::Constrain } else { Stability::Allow };
    let (pair, _) = stability::apply(choice, pair, time)?;
    let of_pair = observability(pair.a.as_ref(), pair.c.as_ref(), options.horizon.future());
    let turn = least_squares("an observability matrix", of_pair.as_ref(), gamma.as_ref())?;
    let back = |m: &Mat<f64>| solve("the change of states", turn.x.as_ref(), m.as_ref());
    let pair = OutputPair { a: back(&(&pair.a * &turn.x))?, c: &pair.c * &turn.x };
    let gain = gain.map(|k| back(&k)).transpose()?;
    let (predictor, _) = output_error::predictor(&pair, gain.as_ref().map(|k| k.as_ref()), base.predictor.k.is_none())?;
    let quotient = |new: &Mat<f64>, old: &Mat<f64>| (new - old) * Scale(1.0 / STEP);
    let k = match (&predictor.k, &base.predictor.k) {
        (Some(new), Some(old)) => quotient(new, old),
        _ => Mat::zeros(n, 0),
    };
    Ok(PairChange { a: quotient(&predictor.a, &base.predictor.a), c: quotient(&predictor.c, &base.predictor.c), k })
}
