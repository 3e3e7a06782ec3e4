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

    /// Puts the four matrices back into the units of the record.
    pub(super) fn unscale_model(
        &self,
        pair: OutputPair,
        b: Mat<f64>,
        d: Mat<f64>,
        time: Discrete,
    ) -> Result<StateSpace<Discrete>> {
        let (b, c, d) = self.unscale(b, pair.c, d);
        StateSpace::new(pair.a, b, c, d, time)
    }

    /// B, C and D in the units of the record.
    pub(super) fn unscale(&self, b: Mat<f64>, c: Mat<f64>, d: Mat<f64>) -> (Mat<f64>, Mat<f64>, Mat<f64>) {
        let (u, y) = (&self.u_scale, &self.y_scale);
        (
            Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / u[j]),
            Mat::from_fn(c.nrows(), c.ncols(), |i, j| y[i] * c[(i, j)]),
            Mat::from_fn(d.nrows(), d.ncols(), |i, j| y[i] * d[(i, j)] / u[j]),
        )
    }

    /// The same inputs with other outputs, in scaled units.
    pub(super) fn with_outputs(&self, outputs: Vec<Mat<f64>>) -> Channels {
        let (u_scale, y_scale) = (self.u_scale.clone(), self.y_scale.clone());
        let experiments = self.experiments.iter().zip(outputs).map(|(e, y)| Signals { u: e.u.clone(), y }).collect();
        Channels { experiments, inputs: self.inputs, outputs: self.outputs, u_scale, y_scale }
    }
}

/// Shapes, lengths and values; returns the numbers of inputs and outputs.
fn check(experiments: &[Experiment<'_>], options: &SubspaceOptions) -> Result<(usize, usize)> {
    let (past, horizon) = (options.past(), options.horizon);
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
        if u.nrows() < past + horizon {
            let what = format!("experiment {} with a horizon of {horizon} and a past of {past} block rows", k + 1);
            return Err(Error::TooFewSamples { what, found: u.nrows(), needed: past + horizon });
        }
    }
    Ok((m, p))
}

/// Refuses a horizon or past without meaning.
pub(super) fn check_blocks(options: &SubspaceOptions) -> Result<()> {
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
