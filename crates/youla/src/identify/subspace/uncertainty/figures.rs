//! What the uncertainty of an estimate makes of any figure of it, and models that are drawn from it.
//!
//! Delta method: with the change `d_j` of the figures for twice the weight of block j, by differences through the figures
//! themselves. A model that is drawn is `M + r sum_j g_j dM_j` with normal g_j of the covariance that [`super::Delta`] states
//! (`g_j = (e_j + e_{j+1}) / sqrt 2` within an experiment) and a common `r^2 = nu / chi^2_nu` for the degrees of freedom, so that
//! it follows Student's distribution of several variables (Kotz, Nadarajah, Multivariate t Distributions, 2004, section 1.1).

use super::bootstrap::interval;
use super::delta::STEP;
use super::{Bootstrap, Delta, Uncertainty};
use crate::lti::{Discrete, StateSpace};
use crate::{Mat, Result};
use faer::Scale;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rayon::prelude::*;

/// A figure with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Interval {
    /// Of the estimate.
    pub value: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Bounds at the level of the uncertainty.
    pub bounds: [f64; 2],
}

/// A model that is drawn.
#[derive(Debug, Clone)]
pub struct Draw {
    /// The model.
    pub model: StateSpace<Discrete>,
    /// How far out it lies: the models within a region are those of the smallest values.
    pub distance: f64,
}

impl Uncertainty {
    /// Intervals of figures that follow from the model, in the order in which `of` gives them; empty where there is no
    /// uncertainty. Blocks or replicates in parallel. Delta: `of` must be differentiable at the estimate.
    ///
    /// # Errors
    /// Those of `of` for the estimate and, with the delta method, for models near it.
    pub fn intervals<F>(&self, of: F) -> Result<Vec<Interval>>
    where
        F: Fn(&StateSpace<Discrete>) -> Result<Vec<f64>> + Sync,
    {
        match self {
            Uncertainty::Delta(delta) => delta.intervals(of),
            Uncertainty::Bootstrap(bootstrap) => bootstrap.intervals(of),
            Uncertainty::Refused { .. } => Ok(Vec::new()),
        }
    }

    /// Models as the estimate could have come out, in the order of drawing: `count` from the normal approximation of the delta
    /// method, or all replicates of the bootstrap. None where there is no uncertainty.
    pub fn draws(&self, count: usize, seed: u64) -> Vec<Draw> {
        match self {
            Uncertainty::Delta(delta) => delta.draws(count, seed),
            Uncertainty::Bootstrap(bootstrap) => bootstrap.draws(),
            Uncertainty::Refused { .. } => Vec::new(),
        }
    }

    /// Level of its intervals; `None` where there is none.
    pub fn level(&self) -> Option<f64> {
        match self {
            Uncertainty::Delta(delta) => Some(delta.level),
            Uncertainty::Bootstrap(bootstrap) => Some(bootstrap.level),
            Uncertainty::Refused { .. } => None,
        }
    }
}

impl Delta {
    fn intervals<F>(&self, of: F) -> Result<Vec<Interval>>
    where
        F: Fn(&StateSpace<Discrete>) -> Result<Vec<f64>> + Sync,
    {
        let values = of(&self.model)?;
        let changes: Vec<Result<Vec<f64>>> = (0..self.blocks.len())
            .into_par_iter()
            .map(|j| {
                let moved = of(&self.towards(&[(j, STEP)])?)?;
                Ok(moved.iter().zip(&values).map(|(m, v)| (m - v) / STEP).collect())
            })
            .collect();
        let covariance = self.covariance(&changes.into_iter().collect::<Result<Vec<_>>>()?);
        let student = self.student();
        let interval = |(k, value): (usize, &f64)| {
            let deviation = covariance[(k, k)].max(0.0).sqrt();
            Interval { value: *value, deviation, bounds: [value - student * deviation, value + student * deviation] }
        };
        Ok(values.iter().enumerate().map(interval).collect())
    }

    fn draws(&self, count: usize, seed: u64) -> Vec<Draw> {
        let draw = |k: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(k);
            let (weights, distance) = self.weights(&mut rng)?;
            let weights: Vec<(usize, f64)> = weights.into_iter().enumerate().collect();
            Some(Draw { model: self.towards(&weights).ok()?, distance })
        };
        (0..count as u64).into_par_iter().filter_map(draw).collect()
    }

    /// A weight for every block, and the length of the normal vector behind them.
    fn weights(&self, rng: &mut ChaCha8Rng) -> Option<(Vec<f64>, f64)> {
        let (count, nu) = (self.blocks.len(), self.degrees_of_freedom());
        let mut square = 0.0;
        let mut normal = |rng: &mut ChaCha8Rng| {
            let e: f64 = rng.sample(StandardNormal);
            square += e * e;
            e
        };
        let mut weights = Vec::with_capacity(count);
        let mut before = normal(rng);
        for j in 0..count {
            let new_experiment = j > 0 && self.blocks[j].experiment != self.blocks[j - 1].experiment;
            if new_experiment {
                before = normal(rng);
            }
            let next = normal(rng);
            weights.push((before + next) / 2f64.sqrt());
            before = next;
        }
        let spread = (nu / ChiSquared::new(nu).ok()?.sample(rng)).sqrt();
        let scale = spread * (count as f64 / (count as f64 - 1.0)).sqrt();
        weights.iter_mut().for_each(|w| *w *= scale);
        Some((weights, spread * square.sqrt()))
    }

    /// The model moved by shares of the influences of blocks.
    pub(super) fn towards(&self, weights: &[(usize, f64)]) -> Result<StateSpace<Discrete>> {
        let m = &self.model;
        let [mut a, mut b, mut c, mut d] = [m.a(), m.b(), m.c(), m.d()].map(|x| x.to_owned());
        for (j, method) in weights {
            let block = &self.blocks[*j];
            let add = |to: &mut Mat<f64>, change: &Mat<f64>| *to += change * Scale(*method);
            add(&mut a, &block.a);
            add(&mut b, &block.b);
            add(&mut c, &block.c);
            add(&mut d, &block.d);
        }
        StateSpace::new(a, b, c, d, m.time())
    }
}

impl Bootstrap {
    /// Percentiles over the replicates for which `of` gives figures.
    fn intervals<F>(&self, of: F) -> Result<Vec<Interval>>
    where
        F: Fn(&StateSpace<Discrete>) -> Result<Vec<f64>> + Sync,
    {
        let values = of(&self.model)?;
        let all: Vec<Vec<f64>> = self.replicates.par_iter().filter_map(|r| of(r).ok()).collect();
        let figure = |(k, value): (usize, &f64)| {
            let sample: Vec<f64> = all.iter().filter_map(|r| r.get(k).copied()).collect();
            let deviation = super::bootstrap::deviation(&sample);
            Interval { value: *value, deviation, bounds: interval(sample, self.level) }
        };
        Ok(values.iter().enumerate().map(figure).collect())
    }

    /// The replicates; their distance is the largest change of the response over a few frequencies, relative to its size.
    fn draws(&self) -> Vec<Draw> {
        self.replicates
            .iter()
            .map(|r| Draw { model: r.clone(), distance: self.distance(r).unwrap_or(f64::INFINITY) })
            .collect()
    }

    fn distance(&self, replicate: &StateSpace<Discrete>) -> Result<f64> {
        let nyquist = std::f64::consts::PI / self.model.time().ts();
        let omega: Vec<f64> = (1..=32).map(|k| nyquist * f64::from(k) / 33.0).collect();
        let of = |model| crate::lti::frequency_response(model, &omega);
        let (estimate, drawn) = (of(&self.model)?, of(replicate)?);
        let size = estimate.iter().map(|g| g.norm_l2()).fold(0.0, f64::max);
        Ok(estimate.iter().zip(drawn.iter()).map(|(g, h)| (g - h).norm_l2()).fold(0.0, f64::max) / size)
    }
}
