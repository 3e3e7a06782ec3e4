//! Checked and scaled copies of the records.

use super::realisation::OutputPair;
use super::{ChannelScaling, Experiment, SubspaceOptions};
use crate::linalg::{check_finite, check_shape};
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Result};
use faer::{Mat, MatRef};

/// The records of one experiment in scaled units, one contiguous column per channel.
pub(super) struct Signals {
    pub(super) u: Mat<f64>,
    pub(super) y: Mat<f64>,
}

/// All experiments in scaled units.
pub(super) struct Channels {
    pub(super) experiments: Vec<Signals>,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    u_scale: Vec<f64>,
    pub(super) y_scale: Vec<f64>,
}

impl Channels {
    pub(super) fn new(experiments: &[Experiment<'_>], options: &SubspaceOptions) -> Result<Self> {
        let (inputs, outputs) = check(experiments, options)?;
        let u: Vec<_> = experiments.iter().map(|e| e.u).collect();
        let y: Vec<_> = experiments.iter().map(|e| e.y).collect();
        let u_scale = scales("input", &u, options.scaling)?;
        let y_scale = scales("output", &y, options.scaling)?;
        let experiments =
            u.iter().zip(&y).map(|(u, y)| Signals { u: divide(*u, &u_scale), y: divide(*y, &y_scale) }).collect();
        Ok(Channels { experiments, inputs, outputs, u_scale, y_scale })
    }

    /// Refuses experiments that are too short for so many block rows of past and future.
    pub(super) fn check_lengths(&self, blocks: (usize, usize)) -> Result<()> {
        self.experiments.iter().enumerate().try_for_each(|(k, e)| check_length(k, e.u.nrows(), blocks))
    }

    /// Puts the four matrices back into the units of the record.
    pub(super) fn unscale_model(
        &self,
        pair: OutputPair,
        b: Mat<f64>,
        d: Mat<f64>,
        time: Discrete,
    ) -> Result<StateSpace<Discrete>> {
        let (u, y) = (&self.u_scale, &self.y_scale);
        let b = Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / u[j]);
        let c = Mat::from_fn(pair.c.nrows(), pair.c.ncols(), |i, j| y[i] * pair.c[(i, j)]);
        let d = Mat::from_fn(d.nrows(), d.ncols(), |i, j| y[i] * d[(i, j)] / u[j]);
        StateSpace::new(pair.a, b, c, d, time)
    }
}

/// Shapes, lengths and values; returns the numbers of inputs and outputs.
fn check(experiments: &[Experiment<'_>], options: &SubspaceOptions) -> Result<(usize, usize)> {
    let (past, horizon) = match options.automatic_horizon {
        Some(automatic) => (automatic.max, 1),
        None => (options.past(), options.horizon),
    };
    check_blocks(options)?;
    at_least("the number of experiments", experiments.len(), 1, "at least 1")?;
    let (m, p) = (experiments[0].u.ncols(), experiments[0].y.ncols());
    at_least("the number of inputs", m, 1, "at least 1")?;
    at_least("the number of outputs", p, 1, "at least 1")?;
    for (k, Experiment { u, y }) in experiments.iter().enumerate() {
        let named = |what: &str| format!("the {what} record of experiment {}", k + 1);
        check_shape(&named("input"), *u, (u.nrows(), m))?;
        check_shape(&named("output"), *y, (u.nrows(), p))?;
        check_finite(&named("input"), *u)?;
        check_finite(&named("output"), *y)?;
        check_length(k, u.nrows(), (past, horizon))?;
    }
    Ok((m, p))
}

/// Refuses an experiment without a Hankel column.
fn check_length(k: usize, samples: usize, (past, horizon): (usize, usize)) -> Result<()> {
    if samples < past + horizon {
        let what = format!("experiment {} with a horizon of {horizon} and a past of {past} block rows", k + 1);
        return Err(Error::TooFewSamples { what, found: samples, needed: past + horizon });
    }
    Ok(())
}

/// Refuses a horizon or past without meaning.
pub(super) fn check_blocks(options: &SubspaceOptions) -> Result<()> {
    if let Some(automatic) = options.automatic_horizon {
        return at_least("the largest past", automatic.max, 1, "at least 1 block row");
    }
    at_least("the horizon", options.horizon, 2, "at least 2 block rows")?;
    at_least("the past", options.past(), 1, "at least 1 block row")
}

fn at_least(what: &str, value: usize, least: usize, must: &'static str) -> Result<()> {
    if value >= least { Ok(()) } else { Err(Error::OutOfRange { what: what.into(), value: value as f64, must }) }
}

/// The scale of each channel; refuses channels that are constant throughout.
fn scales(kind: &str, records: &[MatRef<'_, f64>], scaling: ChannelScaling) -> Result<Vec<f64>> {
    (0..records[0].ncols())
        .map(|j| {
            let columns = || records.iter().map(|r| r.col(j));
            let constant = |record: faer::ColRef<'_, f64>| record.iter().all(|v| *v == record[0]);
            if columns().all(constant) {
                let what = format!("{kind} channel {}", j + 1);
                return Err(Error::ConstantChannel { what, value: records[0][(0, j)] });
            }
            let samples: usize = records.iter().map(|r| r.nrows()).sum();
            let rms = columns().map(|c| c.norm_l2()).fold(0.0, f64::hypot) / (samples as f64).sqrt();
            Ok(match scaling {
                ChannelScaling::None => 1.0,
                ChannelScaling::Rms => rms,
            })
        })
        .collect()
}

fn divide(record: MatRef<'_, f64>, scale: &[f64]) -> Mat<f64> {
    Mat::from_fn(record.nrows(), record.ncols(), |i, j| record[(i, j)] / scale[j])
}
