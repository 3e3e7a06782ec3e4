//! What single precision costs, by computing the generated code in both precisions in the same order of operations.
//!
//! A sum or product of two numbers of 24 bits, taken in double precision and rounded, is the sum or product that single precision
//! gives: 53 >= 2 x 24 + 2 bits. Source: S. A. Figueroa, "When is double rounding innocuous?", ACM SIGNUM Newsletter 30(3), 1995.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use youla::{Mat, MatRef};

/// Seed of the test sequence.
pub(super) const SEED: u64 = 1;
/// Its samples.
pub(super) const SAMPLES: usize = 1000;
/// Growth at which the sequence of an unstable model ends.
const GROWTH: f64 = 1e3;

/// Difference of single to double precision over a seeded sequence of white noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleError {
    /// Largest difference of an output, over the largest value of that output in double precision; `None` where an entry is beyond
    /// the range of single precision.
    pub relative: Option<f64>,
    /// Samples of the sequence.
    pub samples: usize,
    /// Seed of the sequence.
    pub seed: u64,
}

impl SingleError {
    /// From the outputs in both precisions, samples x outputs.
    pub(super) fn between(double: MatRef<'_, f64>, single: MatRef<'_, f64>) -> Self {
        let largest = |m: MatRef<'_, f64>, j: usize| m.col(j).iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let mut relative = Some(0.0);
        let difference = double - single;
        for j in 0..double.ncols() {
            let (error, scale) = (largest(difference.as_ref(), j), largest(double, j));
            let part = if scale > 0.0 { error / scale } else { error };
            let finite = single.col(j).iter().all(|x| x.is_finite());
            relative = relative.filter(|_| finite).map(|so_far: f64| so_far.max(part));
        }
        SingleError { relative, samples: double.nrows(), seed: SEED }
    }

    /// For a comment.
    pub(super) fn sentence(&self) -> String {
        let SingleError { samples, seed, .. } = self;
        match self.relative {
            Some(relative) => format!(
                "differs from double by at most {relative:.1e} of the largest value of an output ({samples} samples, seed {seed})"
            ),
            None => "cannot be used: an entry or a value is beyond its range".to_owned(),
        }
    }
}

/// Samples over which a mode that grows by `radius` a sample grows by [`GROWTH`], at most [`SAMPLES`].
pub(super) fn samples_for(radius: f64) -> usize {
    let until = (GROWTH.ln() / radius.ln()).floor();
    if radius > 1.0 && until < SAMPLES as f64 { (until as usize).max(2) } else { SAMPLES }
}

/// White noise, samples x channels.
pub(super) fn noise(samples: usize, channels: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut out = Mat::zeros(samples, channels);
    for k in 0..samples {
        (0..channels).for_each(|j| out[(k, j)] = rng.sample(StandardNormal));
    }
    out
}

/// A precision: what it makes of a number.
pub(super) type Round = fn(f64) -> f64;

/// Double precision.
pub(super) const DOUBLE: Round = |x| x;
/// Single precision.
pub(super) const SINGLE: Round = |x| f64::from(x as f32);

/// `sum += matrix x`, term by term as the generated loops do.
pub(super) fn add(sum: &mut [f64], matrix: MatRef<'_, f64>, x: &[f64], round: Round) {
    for (i, sum) in sum.iter_mut().enumerate() {
        for (j, x) in x.iter().enumerate() {
            *sum = round(*sum + round(round(matrix[(i, j)]) * x));
        }
    }
}
