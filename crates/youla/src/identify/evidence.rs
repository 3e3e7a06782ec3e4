//! Whether the data speak against the nominal model: does a deviation S identified from one half of the record predict the
//! other half?
//!
//! Under S = 0, beta is noise that does not depend on alpha. With S1 from the first halves of all experiments and S2 from
//! the second halves, the scores
//! ```text
//! s1(k) = (S1 alpha)(k)' W beta(k)  over the second halves,    s2(k) = (S2 alpha)(k)' W beta(k)  over the first
//! ```
//! (S1 alpha without its mean, W the inverse powers of beta) then have mean zero whatever S1 and S2 are: an S of too high an
//! order, fitted to noise, does not count as evidence. Their sums over blocks of time give Student's t of each; the two may depend
//! on each other, and their mean is compared with the one-sided quantile of one, which is safe for any dependence between
//! independent and equal.
//!
//! This is a two-fold cross-validation (Stone, J. R. Stat. Soc. B 36, 111 (1974)) with a test of its outcome.

use super::subspace::uncertainty::student::student;
use super::subspace::{
    Experiment, InitialState, NoUncertainty, Order, Stability, SubspaceOptions, UncertaintyOptions, subspace,
};
use crate::factor::YoulaSignals;
use crate::lti::{Discrete, simulate};
use crate::{MatRef, Result};
use std::ops::Range;

/// Blocks of a half, at least and at most.
const BLOCKS: (usize, usize) = (10, 30);

/// The outcome of the test of S = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Mean of the two values of Student's t.
    pub statistic: f64,
    /// What it exceeds under S = 0 with a probability of one less the level, at most.
    pub threshold: f64,
    /// The level.
    pub level: f64,
}

impl Evidence {
    /// Whether the data contradict the nominal model. Where they do not, S carries no information.
    pub fn against_nominal(&self) -> bool {
        self.statistic > self.threshold
    }
}

/// Tests S = 0 with the order and the options of an identification.
pub(super) fn evidence(
    signals: &[YoulaSignals],
    time: Discrete,
    order: usize,
    options: &SubspaceOptions,
) -> Result<Evidence, NoUncertainty> {
    let failed = |error: crate::Error| {
        NoUncertainty::Failed(format!("the test of S = 0 on halves of the record is not possible: {error}"))
    };
    let options = SubspaceOptions {
        order: Order::Fixed(order),
        stability: Stability::Constrain,
        initial_state: InitialState::Estimated,
        uncertainty: UncertaintyOptions { level: options.uncertainty.level, ..Default::default() },
        ..options.clone()
    };
    let blocks = (options.past() + options.horizon) * 3;
    let samples: usize = signals.iter().map(|s| s.alpha.nrows() / 2).sum();
    let count = (samples / blocks).clamp(BLOCKS.0, BLOCKS.1);
    let (first, second) =
        rayon::join(|| score(signals, time, &options, 0, count), || score(signals, time, &options, 1, count));
    let (first, second) = (first.map_err(failed)?, second.map_err(failed)?);
    let level = options.uncertainty.level;
    let threshold = student(level, count as f64 / 1.5);
    Ok(Evidence { statistic: 0.5 * (first + second), threshold, level })
}

/// Student's t of the model of one half on the other halves.
fn score(
    signals: &[YoulaSignals],
    time: Discrete,
    options: &SubspaceOptions,
    half: usize,
    blocks: usize,
) -> Result<f64> {
    let part = |m: MatRef<'_, f64>, half: usize| {
        let range = range(m.nrows(), half);
        (range.start, range.len())
    };
    let experiments: Vec<_> = signals
        .iter()
        .map(|s| {
            let (start, length) = part(s.alpha.as_ref(), half);
            Experiment { u: s.alpha.subrows(start, length), y: s.beta.subrows(start, length) }
        })
        .collect();
    let model = subspace(&experiments, time, options)?.model;
    let total: usize = signals.iter().map(|s| s.alpha.nrows() - s.alpha.nrows() / 2).sum();
    let mut sums = Vec::new();
    for s in signals {
        let predicted = simulate(&model, s.alpha.as_ref(), &vec![0.0; model.order()])?;
        let (start, length) = part(s.alpha.as_ref(), 1 - half);
        let (predicted, beta) = (predicted.subrows(start, length), s.beta.subrows(start, length));
        let own = (blocks * length / total).max(1);
        sums.push(block_sums(predicted, beta, own));
    }
    Ok(student_t(&sums))
}

fn range(samples: usize, half: usize) -> Range<usize> {
    if half == 0 { 0..samples / 2 } else { samples / 2..samples }
}

/// Sums of the score over contiguous blocks.
fn block_sums(predicted: MatRef<'_, f64>, beta: MatRef<'_, f64>, blocks: usize) -> Vec<f64> {
    let samples = beta.nrows();
    let mut scores = vec![0.0; samples];
    for (predicted, beta) in predicted.col_iter().zip(beta.col_iter()) {
        let mean = predicted.iter().sum::<f64>() / samples as f64;
        let power = beta.squared_norm_l2().max(f64::MIN_POSITIVE);
        for (score, (p, b)) in scores.iter_mut().zip(predicted.iter().zip(beta.iter())) {
            *score += (p - mean) * b / power;
        }
    }
    (0..blocks).map(|j| scores[j * samples / blocks..(j + 1) * samples / blocks].iter().sum()).collect()
}

/// Sum over its deviation, with the covariance of neighbours as in [`super::subspace::Delta`].
fn student_t(sums: &[Vec<f64>]) -> f64 {
    let count = sums.iter().map(Vec::len).sum::<usize>() as f64;
    let total: f64 = sums.iter().flatten().sum();
    let mean = total / count;
    let mut variance = 0.0;
    for own in sums {
        let d: Vec<f64> = own.iter().map(|s| s - mean).collect();
        variance += d.iter().map(|d| d * d).sum::<f64>() + d.windows(2).map(|d| d[0] * d[1]).sum::<f64>();
    }
    let variance = variance * count / (count - 1.0);
    if variance > 0.0 { total / variance.sqrt() } else { 0.0 }
}
