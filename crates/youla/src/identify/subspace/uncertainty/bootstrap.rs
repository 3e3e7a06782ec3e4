//! The bootstrap: the estimate with its noise model is simulated with resampled one-step residuals, and identified again.
//!
//! ```text
//! e(k) = y(k) - C x(k) - D u(k),   x+ = (A - K C) x + (B - K D) u + K y      residuals, then centred
//! x+ = A x + B u + K e*,   y* = C x + D u + e*                              e* drawn from them with replacement, u as given
//! ```
//! Intervals are percentiles over the records so simulated (Efron, Tibshirani, An introduction to the bootstrap, 1993,
//! chapters 8 and 13). Each record has a random stream of its own, so that the result does not depend on the threads.

use super::super::output_error::{Base, without_disturbances};
use super::super::sensitivity::simulate;
use super::super::view::Signals;
use super::super::{Order, Stability, SubspaceData, SubspaceOptions};
use super::band::{ModeBand, ResponseBand};
use super::student::ellipse;
use super::{NoUncertainty, UncertaintyOptions};
use crate::linalg::block;
use crate::lti::{Discrete, FrequencyResponse, Mode, StateSpace, frequency_response};
use crate::statistics::quantile;
use crate::{Mat, Result, c64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::borrow::Cow;

/// Models of resampled records.
#[derive(Debug, Clone)]
pub struct Bootstrap {
    /// The estimate.
    pub model: StateSpace<Discrete>,
    /// Models of the resampled records; unstable ones are among them.
    pub replicates: Vec<StateSpace<Discrete>>,
    /// How many of them are unstable.
    pub unstable: usize,
    /// Records that gave no model.
    pub failed: usize,
    /// Level of intervals and regions.
    pub level: f64,
}

pub(super) fn run(
    data: &SubspaceData<'_>,
    options: &SubspaceOptions,
    base: &Base,
    gain: &Mat<f64>,
    model: &StateSpace<Discrete>,
) -> Result<Bootstrap, NoUncertainty> {
    if !base.stable {
        return Err(NoUncertainty::Unstable);
    }
    let generator = Generator::new(data, base, gain);
    let again = SubspaceOptions {
        order: Order::Fixed(model.order()),
        stability: Stability::Allow,
        uncertainty: UncertaintyOptions::default(),
        ..options.clone()
    };
    let UncertaintyOptions { seed, replicates, level, .. } = options.uncertainty;
    let found: Vec<Option<(StateSpace<Discrete>, bool)>> = (0..replicates as u64)
        .into_par_iter()
        .map(|replicate| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(replicate);
            let found = data.with_outputs(generator.outputs(&mut rng)).and_then(|data| data.identify(&again)).ok()?;
            Some((found.model, found.stability.stable))
        })
        .collect();
    let failed = found.iter().filter(|f| f.is_none()).count();
    let unstable = found.iter().flatten().filter(|f| !f.1).count();
    if failed > replicates / 2 {
        let reason = format!("{failed} of {replicates} resampled records gave no model");
        return Err(NoUncertainty::Failed(reason));
    }
    let replicates = found.into_iter().flatten().map(|f| f.0).collect();
    let model = data.channels.delays.put_before(model.clone());
    let model = model.map_err(|error| NoUncertainty::Failed(error.to_string()))?;
    Ok(Bootstrap { model, replicates, unstable, failed, level })
}

/// The innovation model in scaled units with its residuals.
struct Generator<'a> {
    experiments: Cow<'a, [Signals]>,
    base: &'a Base,
    ab: Mat<f64>,
    cd: Mat<f64>,
    /// Centred residuals of all experiments.
    residuals: Mat<f64>,
}

impl<'a> Generator<'a> {
    fn new(data: &'a SubspaceData<'_>, base: &'a Base, gain: &Mat<f64>) -> Self {
        let (pair, p) = (&base.pair, base.pair.c.nrows());
        let b = base.b();
        let predictor = block(&[&[(&pair.a - gain * &pair.c).as_ref(), (&b - gain * &base.d).as_ref(), gain.as_ref()]]);
        let seen = block(&[&[pair.c.as_ref(), base.d.as_ref(), Mat::zeros(p, p).as_ref()]]);
        let experiments = data.channels.scaled();
        let outputs = without_disturbances(&experiments, &base.disturbances);
        let parts: Vec<Mat<f64>> = experiments
            .iter()
            .zip(&outputs)
            .zip(&base.initial_states)
            .map(|((e, y), x0)| {
                let driving = block(&[&[e.u.as_ref(), y.as_ref()]]);
                y - simulate(predictor.as_ref(), seen.as_ref(), x0, driving.as_ref())
            })
            .collect();
        let stacked: Vec<[faer::MatRef<'_, f64>; 1]> = parts.iter().map(|part| [part.as_ref()]).collect();
        let rows: Vec<&[faer::MatRef<'_, f64>]> = stacked.iter().map(|part| part.as_slice()).collect();
        let mut residuals = block(&rows);
        for i in 0..residuals.ncols() {
            let mean = residuals.col(i).iter().sum::<f64>() / residuals.nrows() as f64;
            residuals.col_mut(i).iter_mut().for_each(|v| *v -= mean);
        }
        let ab = block(&[&[pair.a.as_ref(), b.as_ref(), gain.as_ref()]]);
        let cd = block(&[&[pair.c.as_ref(), base.d.as_ref(), Mat::<f64>::identity(p, p).as_ref()]]);
        Generator { experiments, base, ab, cd, residuals }
    }

    /// Outputs of every experiment with fresh noise; without disturbances, which the method takes out again in any case.
    fn outputs(&self, rng: &mut ChaCha8Rng) -> Vec<Mat<f64>> {
        self.experiments
            .iter()
            .zip(&self.base.initial_states)
            .map(|(e, x0)| {
                let drawn: Vec<usize> = (0..e.u.nrows()).map(|_| rng.random_range(0..self.residuals.nrows())).collect();
                let noise = Mat::from_fn(drawn.len(), e.y.ncols(), |k, i| self.residuals[(drawn[k], i)]);
                let driving = block(&[&[e.u.as_ref(), noise.as_ref()]]);
                simulate(self.ab.as_ref(), self.cd.as_ref(), x0, driving.as_ref())
            })
            .collect()
    }
}

impl Bootstrap {
    /// The same for a system that is made from this one; a replicate for which `map` fails counts as failed.
    ///
    /// # Errors
    /// Those of `map` for the estimate itself.
    pub fn through(&self, map: impl Fn(&StateSpace<Discrete>) -> Result<StateSpace<Discrete>>) -> Result<Bootstrap> {
        let replicates: Vec<_> = self.replicates.iter().filter_map(|replicate| map(replicate).ok()).collect();
        let failed = self.failed + self.replicates.len() - replicates.len();
        let unstable = replicates.iter().filter(|r| !r.is_stable().unwrap_or(false)).count();
        Ok(Bootstrap { model: map(&self.model)?, replicates, unstable, failed, level: self.level })
    }

    /// The frequency response at the angular frequencies `omega`, rad/s, with its regions: percentiles of the magnitude, and
    /// the covariance of the replicates about their mean.
    ///
    /// # Errors
    /// As [`frequency_response`].
    pub fn response(&self, omega: &[f64]) -> Result<ResponseBand> {
        let response = frequency_response(&self.model, omega)?;
        let drawn: Vec<FrequencyResponse> =
            self.replicates.par_iter().filter_map(|r| frequency_response(r, omega).ok()).collect();
        let all: Vec<Vec<c64>> = drawn.iter().map(values).collect();
        let places = values(&response).len();
        let of = |place: usize| all.iter().map(|r| r[place]).collect::<Vec<c64>>();
        let covariance = (0..places).map(|place| covariance(&of(place))).collect();
        let magnitude =
            (0..places).map(|place| interval(of(place).iter().map(|g| g.norm()).collect(), self.level)).collect();
        let gains = self.gains(&response, &drawn)?;
        let ellipse = ellipse(self.level, all.len() as f64 - 1.0);
        Ok(ResponseBand { response, covariance, magnitude, gains, ellipse })
    }

    /// The singular values of a response with percentiles over those of the replicates, rank by rank.
    fn gains(&self, response: &FrequencyResponse, drawn: &[FrequencyResponse]) -> Result<Vec<Vec<[f64; 3]>>> {
        let drawn: Vec<Vec<Vec<f64>>> = drawn.iter().map(FrequencyResponse::gains).collect::<Result<_>>()?;
        let bounds = |k: usize, j: usize, value: f64| {
            let [low, high] = interval(drawn.iter().map(|d| d[k][j]).collect(), self.level);
            [value, low, high]
        };
        let found = response.gains()?.into_iter().enumerate();
        Ok(found.map(|(k, at)| at.into_iter().enumerate().map(|(j, value)| bounds(k, j, value)).collect()).collect())
    }

    /// The modes in the order of [`StateSpace::modes`], with percentiles over the nearest modes of the replicates.
    ///
    /// # Errors
    /// [`crate::Error::NoConvergence`] of the eigenvalues.
    pub fn modes(&self) -> Result<Vec<ModeBand>> {
        let modes = self.model.modes()?;
        let matched: Vec<Vec<Option<Mode>>> =
            self.replicates.iter().filter_map(|r| Some(match_modes(&modes, &r.modes().ok()?))).collect();
        let band = |(k, mode): (usize, &Mode)| {
            let of =
                |value: fn(&Mode) -> f64| matched.iter().filter_map(|m| m[k].as_ref().map(value)).collect::<Vec<f64>>();
            let (hz, zeta) = (of(|m| m.hz), of(|m| m.zeta));
            ModeBand {
                mode: *mode,
                hz_deviation: deviation(&hz),
                zeta_deviation: deviation(&zeta),
                hz: interval(hz, self.level),
                zeta: interval(zeta, self.level),
            }
        };
        Ok(modes.iter().enumerate().map(band).collect())
    }
}

/// The mode of a replicate for each mode of the estimate: pairs in the order of the distance of their poles.
fn match_modes(modes: &[Mode], of_replicate: &[Mode]) -> Vec<Option<Mode>> {
    let distance = |(i, j): &(usize, usize)| (modes[*i].pole - of_replicate[*j].pole).norm();
    let mut pairs: Vec<(usize, usize)> =
        (0..modes.len()).flat_map(|i| (0..of_replicate.len()).map(move |j| (i, j))).collect();
    pairs.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    let (mut found, mut taken) = (vec![None; modes.len()], vec![false; of_replicate.len()]);
    for (i, j) in pairs {
        if found[i].is_none() && !taken[j] {
            (found[i], taken[j]) = (Some(of_replicate[j]), true);
        }
    }
    found
}

fn values(response: &FrequencyResponse) -> Vec<c64> {
    response.iter().flat_map(|at| at.col_iter().flat_map(|c| c.iter().copied()).collect::<Vec<_>>()).collect()
}

fn covariance(values: &[c64]) -> [f64; 3] {
    let count = values.len() as f64;
    let mean = values.iter().fold(c64::new(0.0, 0.0), |sum, v| sum + *v) * (1.0 / count);
    let mut sum = [0.0; 3];
    for d in values.iter().map(|v| *v - mean) {
        sum = [sum[0] + d.re * d.re, sum[1] + d.re * d.im, sum[2] + d.im * d.im];
    }
    sum.map(|s| s / (count - 1.0))
}

pub(super) fn deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt()
}

/// Percentiles.
pub(super) fn interval(mut values: Vec<f64>, level: f64) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [0.5 * (1.0 - level), 0.5 * (1.0 + level)].map(|share| quantile(&values, share))
}
