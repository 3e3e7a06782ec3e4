//! The delta method: the covariance of everything that follows smoothly from an estimate, by the change of the estimate with
//! the weight of each block of time (an infinitesimal jackknife over blocks).
//!
//! With the changes `d_j` of a vector of quantities for twice the weight of block j, to first order,
//! ```text
//! V = J / (J - 1) sum_j (d_j d_j' + (d_j d_{j+1}' + d_{j+1} d_j') / 2)
//! ```
//! the second term over neighbours of the same experiment: Hankel columns overlap at the border of two blocks (the window
//! of Bartlett with one lag; Newey and West, Econometrica 55, 703 (1987)). The window leaves `J / 1.5` degrees of freedom to a
//! variance, with which Student's quantiles are taken.
//!
//! Sources: Efron, The Jackknife, the Bootstrap and other resampling plans, SIAM 1982, section 6.3; Kuensch, Ann. Statist.
//! 17, 1217 (1989), for blocks of a time series.

use super::student::{ellipse, two_sided_student};
use crate::lti::{Discrete, StateSpace};
use crate::{Mat, Result};
use faer::Scale;

/// Share of the influence of a block by which a system is moved to differentiate what follows from it.
pub(super) const STEP: f64 = 1e-2;

/// The change of a system for twice the weight of a block, to first order.
#[derive(Debug, Clone)]
pub struct BlockInfluence {
    /// The experiment that the block is a part of, counted from 0.
    pub experiment: usize,
    /// Change of A, n x n.
    pub a: Mat<f64>,
    /// Change of B, n x m.
    pub b: Mat<f64>,
    /// Change of C, p x n.
    pub c: Mat<f64>,
    /// Change of D, p x m.
    pub d: Mat<f64>,
}

impl BlockInfluence {
    /// What lies between two systems with the same states.
    pub fn between(experiment: usize, from: &StateSpace<Discrete>, to: &StateSpace<Discrete>) -> Self {
        let (a, b) = (to.a() - from.a(), to.b() - from.b());
        BlockInfluence { experiment, a, b, c: to.c() - from.c(), d: to.d() - from.d() }
    }

    fn times(self, factor: f64) -> Self {
        let scale = |m: Mat<f64>| m * Scale(factor);
        let BlockInfluence { experiment, a, b, c, d } = self;
        BlockInfluence { experiment, a: scale(a), b: scale(b), c: scale(c), d: scale(d) }
    }
}

/// A system with the influence of each block of time on it.
#[derive(Debug, Clone)]
pub struct Delta {
    /// The estimate.
    pub model: StateSpace<Discrete>,
    /// Its change with each block, in its states and units.
    pub blocks: Vec<BlockInfluence>,
    /// Level of intervals and regions.
    pub level: f64,
}

/// Covariance of a vector from its changes with each block, given the experiment of each.
pub(super) fn covariance(changes: &[Vec<f64>], experiments: &[usize]) -> Mat<f64> {
    let size = changes.first().map_or(0, Vec::len);
    let mut sum = Mat::<f64>::zeros(size, size);
    for (j, d) in changes.iter().enumerate() {
        let next = changes.get(j + 1).filter(|_| experiments[j] == experiments[j + 1]);
        for (r, c) in (0..size).flat_map(|r| (0..size).map(move |c| (r, c))) {
            sum[(r, c)] += d[r] * d[c] + next.map_or(0.0, |next| 0.5 * (d[r] * next[c] + next[r] * d[c]));
        }
    }
    let count = changes.len() as f64;
    sum * Scale(count / (count - 1.0))
}

impl Delta {
    /// Degrees of freedom of a variance.
    pub fn degrees_of_freedom(&self) -> f64 {
        self.blocks.len() as f64 / 1.5
    }

    /// Half width of an interval over the standard deviation.
    pub fn student(&self) -> f64 {
        two_sided_student(self.level, self.degrees_of_freedom())
    }

    /// Bound of `d' V^-1 d` for the two parts of a complex number.
    pub fn ellipse(&self) -> f64 {
        ellipse(self.level, self.degrees_of_freedom())
    }

    /// Covariance of a vector from its changes, one row per block.
    pub fn covariance(&self, changes: &[Vec<f64>]) -> Mat<f64> {
        covariance(changes, &self.blocks.iter().map(|block| block.experiment).collect::<Vec<_>>())
    }

    /// The same for a system that is made from this one, for example `G(S)` from S; `map` must keep the coordinates of its
    /// states when its argument changes a little.
    ///
    /// # Errors
    /// Those of `map`.
    pub fn through(&self, map: impl Fn(&StateSpace<Discrete>) -> Result<StateSpace<Discrete>>) -> Result<Delta> {
        let model = map(&self.model)?;
        let blocks = self.blocks.iter().enumerate().map(|(j, block)| {
            let moved = map(&self.towards(&[(j, STEP)])?)?;
            Ok(BlockInfluence::between(block.experiment, &model, &moved).times(1.0 / STEP))
        });
        Ok(Delta { blocks: blocks.collect::<Result<_>>()?, model, level: self.level })
    }
}
