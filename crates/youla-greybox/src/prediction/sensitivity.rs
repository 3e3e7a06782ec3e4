//! How the outputs depend on parameters and initial state: one recursion for all sensitivities.
//!
//! With the state x of the model, `v = [x; u]` and the derivatives of the sampled matrices,
//! ```text
//! x_theta+ = Ad x_theta + [dAd dBd] v,    y_theta = C x_theta + [dC dD] v,      x_theta(0) = 0, or that of the steady state
//! x_0+     = Ad x_0,                      y_0     = C x_0,                      x_0(0) = I
//! ```
//! so all sensitivities are columns of one matrix (n x columns) under one Ad and share one v (`sensitivity_bank.rs`). The rows
//! `[y_0 y_theta e]` are folded into their triangular factor piece by piece, so that memory does not grow with the record.

use crate::prediction::sampled::SampledSlope;
use crate::prediction::sensitivity_bank::{Bank, InitialCondition};
use crate::prediction::small_qr::{SmallQr, dot};
use crate::{Error, Result};
use faer::Mat;
use pulp::{Arch, Simd, WithSimd};
use youla::lti::{Discrete, Simulator, StateSpace};

/// Samples folded in at a time; small enough to stay in the cache.
pub(crate) const PIECE: usize = 128;

/// The records of one experiment, sample after sample.
pub(crate) struct Samples {
    /// m values per sample.
    pub(crate) u: Vec<f64>,
    /// p values per sample.
    pub(crate) y: Vec<f64>,
    pub(crate) count: usize,
}

/// The triangular factor over `[y_0 | y_theta | e]` with the residual `e = y - yhat` of the simulated model.
///
/// # Errors
/// [`youla::Error::Diverged`] where the recursion leaves the range of the numbers.
pub(crate) fn condense(
    samples: &Samples,
    system: &StateSpace<Discrete>,
    slopes: &[SampledSlope],
    begin: &InitialCondition<'_>,
) -> Result<Mat<f64>> {
    let mut triangle = SmallQr::new(begin.estimated + slopes.len() + 1);
    rows(samples, system, slopes, begin, &mut triangle)?;
    Ok(triangle.into_factor())
}

/// What is done with the rows `[y_0 | y_theta | e]`.
pub(crate) trait RowSink {
    /// Takes `count` rows of at most [`PIECE`] samples, given by columns, and may use them up.
    fn take(&mut self, piece: &mut [f64], count: usize);
}

impl RowSink for SmallQr {
    #[inline(always)]
    fn take(&mut self, piece: &mut [f64], count: usize) {
        self.fold(piece, count);
    }
}

impl<F: FnMut(&mut [f64], usize)> RowSink for F {
    #[inline(always)]
    fn take(&mut self, piece: &mut [f64], count: usize) {
        self(piece, count);
    }
}

/// Hands out the rows `[y_0 | y_theta | e]` of an experiment piece by piece.
///
/// # Errors
/// [`youla::Error::Diverged`] where the recursion leaves the range of the numbers.
pub(crate) fn rows(
    samples: &Samples,
    system: &StateSpace<Discrete>,
    slopes: &[SampledSlope],
    begin: &InitialCondition<'_>,
    take: &mut impl RowSink,
) -> Result<()> {
    Arch::new().dispatch(Rows { samples, system, slopes, begin, take })
}

/// The arguments of [`rows`], for the widest instructions of the processor.
struct Rows<'a, T> {
    samples: &'a Samples,
    system: &'a StateSpace<Discrete>,
    slopes: &'a [SampledSlope],
    begin: &'a InitialCondition<'a>,
    take: &'a mut T,
}

impl<T: RowSink> WithSimd for Rows<'_, T> {
    type Output = Result<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Rows { samples, system, slopes, begin, take } = self;
        let (n, m, p) = (system.order(), system.inputs(), system.outputs());
        let columns = begin.estimated + slopes.len();
        let simulator = Simulator::new(system);
        let mut state = simulator.start(begin.x0)?;
        let mut bank = Bank::new(system, slopes, begin);
        let mut signals = vec![0.0; n + m];
        let mut piece = vec![0.0; PIECE * p * (columns + 1)];
        for first in (0..samples.count).step_by(PIECE) {
            let count = PIECE.min(samples.count - first);
            let rows = count * p;
            let piece = &mut piece[..rows * (columns + 1)];
            for k in 0..count {
                let (u, y) = (&samples.u[(first + k) * m..][..m], &samples.y[(first + k) * p..][..p]);
                signals[..n].copy_from_slice(state.x());
                signals[n..].copy_from_slice(u);
                bank.step(simd, &signals, |i, column, value| piece[column * rows + k * p + i] = value);
                for (i, (y, model)) in y.iter().zip(simulator.step(&mut state, u)).enumerate() {
                    piece[columns * rows + k * p + i] = y - model;
                }
            }
            if !dot(piece, piece).is_finite() {
                return Err(diverged(first + 1, system));
            }
            bank.flush_subnormals();
            take.take(piece, rows);
        }
        Ok(())
    }
}

/// The sum of squares of the residual of the model started at `x0`.
///
/// # Errors
/// [`youla::Error::Diverged`] where the simulation leaves the range of the numbers.
pub(crate) fn sum_of_squares(samples: &Samples, system: &StateSpace<Discrete>, x0: &[f64]) -> Result<f64> {
    let (m, p) = (system.inputs(), system.outputs());
    let simulator = Simulator::new(system);
    let mut state = simulator.start(x0)?;
    let mut sum = 0.0;
    for k in 0..samples.count {
        let model = simulator.step(&mut state, &samples.u[k * m..][..m]);
        let residuals = samples.y[k * p..][..p].iter().zip(model).map(|(y, model)| y - model);
        sum += residuals.map(|e| e.powi(2)).sum::<f64>();
        if !sum.is_finite() {
            return Err(diverged(k + 1, system));
        }
    }
    Ok(sum)
}

/// The residual of the model started at `x0`, sample after sample.
///
/// # Errors
/// [`youla::Error::Diverged`] where the simulation leaves the range of the numbers.
pub(crate) fn residuals(samples: &Samples, system: &StateSpace<Discrete>, x0: &[f64]) -> Result<Vec<f64>> {
    let (m, p) = (system.inputs(), system.outputs());
    let simulator = Simulator::new(system);
    let mut state = simulator.start(x0)?;
    let mut residuals = Vec::with_capacity(samples.y.len());
    for k in 0..samples.count {
        let model = simulator.step(&mut state, &samples.u[k * m..][..m]);
        residuals.extend(samples.y[k * p..][..p].iter().zip(model).map(|(y, model)| y - model));
    }
    match residuals.iter().position(|e| !e.is_finite()) {
        Some(bad) => Err(diverged(bad / p + 1, system)),
        None => Ok(residuals),
    }
}

fn diverged(sample: usize, system: &StateSpace<Discrete>) -> Error {
    let pole = system.worst_pole().ok().flatten();
    Error::Method(youla::Error::Diverged { what: "the simulation of the model to be fitted".into(), sample, pole })
}
