//! Blocks of time: contiguous Hankel columns of one experiment.
//!
//! Products of samples up to past + horizon apart stand in one Hankel column, so that neighbouring blocks share them at their
//! border. A block should therefore be several times longer; with three times, the sums over neighbours still correlate
//! by up to a sixth, which the covariance allows for (see [`super::delta`]).

use super::options::LEAST_BLOCKS;
use crate::{Error, Result};
use std::ops::Range;

/// A part of an experiment.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct TimeBlock {
    pub(super) experiment: usize,
    /// Hankel columns, counted within the experiment.
    pub(in super::super) columns: Range<usize>,
    /// Samples of the experiment: those at the present of the columns, with what is left at both ends.
    pub(super) samples: Range<usize>,
}

/// Cuts experiments of so many samples, never across their boundaries; each has at least one block.
///
/// Without a number that was asked for: all Hankel columns over three times past + horizon, within 20 and 60.
pub(super) fn cut(samples: &[usize], past: usize, horizon: usize, asked: Option<usize>) -> Result<Vec<TimeBlock>> {
    let width = past + horizon;
    let columns: Vec<usize> = samples.iter().map(|n| n + 1 - width).collect();
    let total: usize = columns.iter().sum();
    let count = asked.unwrap_or((total / (3 * width)).clamp(20, 60));
    let mut blocks = Vec::new();
    for (experiment, (&columns, &samples)) in columns.iter().zip(samples).enumerate() {
        let share = ((count * columns + total / 2) / total).clamp(1, columns);
        let at = |k: usize| k * columns / share;
        blocks.extend((0..share).map(|k| TimeBlock {
            experiment,
            columns: at(k)..at(k + 1),
            samples: if k == 0 { 0 } else { at(k) + past }..if k + 1 == share { samples } else { at(k + 1) + past },
        }));
    }
    if blocks.len() < LEAST_BLOCKS {
        let what = "the number of Hankel columns that are cut into blocks for the uncertainty".into();
        return Err(Error::OutOfRange { what, value: total as f64, must: "at least 10" });
    }
    Ok(blocks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_all_once_and_end_with_their_experiment() {
        let blocks = cut(&[1000, 103, 50], 7, 5, None).unwrap();
        assert_eq!(blocks.len(), 27 + 3 + 1);
        for (experiment, samples) in [1000, 103, 50].into_iter().enumerate() {
            let own: Vec<_> = blocks.iter().filter(|b| b.experiment == experiment).collect();
            assert_eq!((own[0].columns.start, own[own.len() - 1].columns.end), (0, samples - 11));
            assert_eq!((own[0].samples.start, own[own.len() - 1].samples.end), (0, samples));
            for pair in own.windows(2) {
                assert_eq!(pair[0].columns.end, pair[1].columns.start);
                assert_eq!(pair[0].samples.end, pair[1].samples.start);
            }
        }
        assert!(cut(&[14], 5, 5, None).is_err());
    }
}
