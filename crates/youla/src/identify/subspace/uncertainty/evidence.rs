//! Whether the outputs depend on the inputs at all: does a model S identified from one half of the record predict the other
//! half? For the deviation system of the Hansen scheme: whether the data speak against the nominal model.
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

use super::super::view::Signals;
use super::super::{Experiment, InitialState, Order, Stability, SubspaceData, SubspaceOptions};
use super::student::student;
use super::{NoUncertainty, UncertaintyOptions};
use crate::lti::simulate;
use crate::{MatRef, Result};
use std::ops::Range;

/// Blocks of a half, at least and at most.
const BLOCKS: (usize, usize) = (10, 30);

/// The outcome of the test of S = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviationEvidence {
    /// Mean of the two values of Student's t.
    pub statistic: f64,
    /// What it exceeds under S = 0 with a probability of one less the level, at most.
    pub threshold: f64,
    /// The level.
    pub level: f64,
}

impl DeviationEvidence {
    /// Whether the data contradict the nominal model. Where they do not, S carries no information.
    pub fn against_nominal(&self) -> bool {
        self.statistic > self.threshold
    }
}

impl SubspaceData<'_> {
    /// Tests whether the outputs depend on the inputs, with the order of a model found from these data by `options`. For alpha
    /// and beta: whether S = 0, the nominal model.
    ///
    /// # Errors
    /// [`NoUncertainty`] where half of the data gives no model.
    pub fn evidence(&self, order: usize, options: &SubspaceOptions) -> Result<DeviationEvidence, NoUncertainty> {
        let failed = |error: crate::Error| {
            NoUncertainty::Failed(format!("the test of S = 0 on halves of the record is not possible: {error}"))
        };
        let options = self.options_of_halves(order, options).map_err(failed)?;
        let experiments = self.channels.beyond_disturbances().map_err(failed)?;
        let samples: usize = experiments.iter().map(|s| s.u.nrows() / 2).sum();
        let count = (samples
            / options.horizon.past().saturating_add(options.horizon.future()).saturating_mul(3).max(1))
        .clamp(BLOCKS.0, BLOCKS.1);
        let of = |half| self.score(&experiments, &options, half, count);
        let (first, second) = rayon::join(|| of(0), || of(1));
        let (first, second) = (first.map_err(failed)?, second.map_err(failed)?);
        let level = options.uncertainty.level;
        let threshold = student(level, count as f64 / 1.5);
        Ok(DeviationEvidence { statistic: 0.5 * (first + second), threshold, level })
    }

    /// Those of the model, for records that are shifted by the delays already.
    fn options_of_halves(&self, order: usize, options: &SubspaceOptions) -> Result<SubspaceOptions> {
        Ok(SubspaceOptions {
            delays: Vec::new(),
            order: Order::Fixed(order),
            stability: Stability::Constrain,
            initial_state: InitialState::Estimated,
            uncertainty: UncertaintyOptions { level: options.uncertainty.level, ..Default::default() },
            ..self.checked(options)?
        })
    }

    /// Student's t of the model of one half on the other halves.
    fn score(&self, experiments: &[Signals], options: &SubspaceOptions, half: usize, blocks: usize) -> Result<f64> {
        let part = |m: MatRef<'_, f64>, half: usize| {
            let range = range(m.nrows(), half);
            (range.start, range.len())
        };
        let halves: Vec<_> = experiments
            .iter()
            .map(|s| {
                let (start, length) = part(s.u.as_ref(), half);
                Experiment::new(s.u.as_ref().subrows(start, length), s.y.as_ref().subrows(start, length))
            })
            .collect();
        let model = SubspaceData::new(&halves, self.time, options)?.identify(options)?.model;
        let total: usize = experiments.iter().map(|s| s.u.nrows() - s.u.nrows() / 2).sum();
        let mut sums = Vec::new();
        for s in experiments {
            let predicted = simulate(&model, s.u.as_ref(), &vec![0.0; model.order()])?;
            let (start, length) = part(s.u.as_ref(), 1 - half);
            let (predicted, beta) = (predicted.subrows(start, length), s.y.as_ref().subrows(start, length));
            let own = (blocks * length / total).max(1);
            sums.push(block_sums(predicted, beta, own));
        }
        Ok(student_t(&sums))
    }
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

/// Sum over its deviation, with the covariance of neighbours as in [`super::Delta`].
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
