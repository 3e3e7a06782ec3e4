//! Checked and scaled copies of the records.

use super::delay::Delays;
use super::realisation::OutputPair;
use super::{ChannelScaling, Experiment, SubspaceOptions};
use crate::linalg::{check_finite, check_shape, regress};
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::borrow::Cow;

/// The records of one experiment in scaled units, one contiguous column per channel.
#[derive(Clone)]
pub(super) struct Signals {
    pub(super) u: Mat<f64>,
    pub(super) y: Mat<f64>,
    /// Known signals of a disturbance of the outputs, of unit rms; no columns where none is known.
    pub(super) w: Mat<f64>,
}

/// All experiments in scaled units.
#[derive(Clone)]
pub(super) struct Channels {
    pub(super) experiments: Vec<Signals>,
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    u_scale: Vec<f64>,
    pub(super) y_scale: Vec<f64>,
    /// Per experiment, of each known signal of a disturbance.
    w_scale: Vec<Vec<f64>>,
    pub(super) delays: Delays,
    /// Per experiment, the delay states at the first sample that is used, in the units of the record.
    pub(super) delayed: Vec<Vec<f64>>,
}

impl Channels {
    pub(super) fn new<'a>(
        experiments: &[Experiment<'a>],
        disturbances: &[MatRef<'a, f64>],
        options: &SubspaceOptions,
    ) -> Result<Self> {
        let (inputs, outputs) = check(experiments, options)?;
        check_disturbances(experiments, disturbances)?;
        let delays = Delays::new(&options.delays, inputs)?;
        let delayed = experiments.iter().map(|e| delays.states_at_start(e)).collect();
        let from_start = |m: MatRef<'a, f64>| m.subrows(delays.longest(), m.nrows() - delays.longest());
        let shifted: Vec<_> = experiments.iter().map(|e| delays.shift(e.u)).collect();
        let u: Vec<_> = shifted.iter().map(|u| u.as_ref()).collect();
        let y: Vec<_> = experiments.iter().map(|e| from_start(e.y)).collect();
        let disturbances: Vec<_> = disturbances.iter().map(|w| from_start(*w)).collect();
        let u_scale = scales("input", &u, options.scaling)?;
        // Lines larger than the rest must not set the weights of the outputs.
        let quiet = y.iter().zip(&disturbances).map(|(y, w)| without(*y, *w)).collect::<Result<Vec<_>>>()?;
        let quiet: Vec<_> = quiet.iter().map(|y| y.as_ref()).collect();
        let y_scale = scales("output", if quiet.is_empty() { &y } else { &quiet }, options.scaling)?;
        let of_signals = |w: &MatRef<'_, f64>| (0..w.ncols()).map(|j| rms_or_one(*w, j)).collect();
        let w_scale: Vec<Vec<f64>> = disturbances.iter().map(of_signals).collect();
        let signals = |e: usize| Signals {
            u: divide(u[e], &u_scale),
            y: divide(y[e], &y_scale),
            w: disturbances.get(e).map_or_else(|| Mat::zeros(u[e].nrows(), 0), |w| divide(*w, &w_scale[e])),
        };
        let experiments = (0..experiments.len()).map(signals).collect();
        Ok(Channels { experiments, inputs, outputs, u_scale, y_scale, w_scale, delays, delayed })
    }

    /// Number of known signals of a disturbance.
    pub(super) fn disturbances(&self) -> usize {
        self.w_scale.first().map_or(0, Vec::len)
    }

    /// Puts the coefficients of the known signals (signals x outputs, per experiment) back into the units of the record.
    pub(super) fn unscale_disturbances(&self, found: Vec<Mat<f64>>) -> Vec<Mat<f64>> {
        let one = |(a, scale): (Mat<f64>, &Vec<f64>)| {
            Mat::from_fn(a.nrows(), a.ncols(), |j, i| self.y_scale[i] * a[(j, i)] / scale[j])
        };
        found.into_iter().zip(&self.w_scale).map(one).collect()
    }

    /// A, C and a gain of a model without delays, in scaled units.
    pub(super) fn scale_predictor(
        &self,
        model: &StateSpace<Discrete>,
        gain: MatRef<'_, f64>,
    ) -> (OutputPair, Mat<f64>) {
        let (y, c) = (&self.y_scale, model.c());
        let c = Mat::from_fn(c.nrows(), c.ncols(), |i, j| c[(i, j)] / y[i]);
        let gain = Mat::from_fn(gain.nrows(), gain.ncols(), |i, j| gain[(i, j)] * y[j]);
        (OutputPair { a: model.a().to_owned(), c }, gain)
    }

    /// Refuses experiments that are too short for so many block rows of past and future.
    pub(super) fn check_lengths(&self, blocks: (usize, usize)) -> Result<()> {
        self.experiments.iter().enumerate().try_for_each(|(k, e)| check_length(k, e.u.nrows(), blocks, 0))
    }

    /// Puts the four matrices back into the units of the record.
    pub(super) fn unscale_model(
        &self,
        pair: &OutputPair,
        b: &Mat<f64>,
        d: &Mat<f64>,
        time: Discrete,
    ) -> Result<StateSpace<Discrete>> {
        let (b, c, d) = self.unscale(b, &pair.c, d);
        StateSpace::new(pair.a.clone(), b, c, d, time)
    }

    /// B, C and D in the units of the record.
    pub(super) fn unscale(&self, b: &Mat<f64>, c: &Mat<f64>, d: &Mat<f64>) -> (Mat<f64>, Mat<f64>, Mat<f64>) {
        let (u, y) = (&self.u_scale, &self.y_scale);
        (
            Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / u[j]),
            Mat::from_fn(c.nrows(), c.ncols(), |i, j| y[i] * c[(i, j)]),
            Mat::from_fn(d.nrows(), d.ncols(), |i, j| y[i] * d[(i, j)] / u[j]),
        )
    }

    /// The same inputs with other outputs, in scaled units.
    pub(super) fn with_outputs(&self, outputs: Vec<Mat<f64>>) -> Channels {
        let signals = |(e, y): (&Signals, Mat<f64>)| Signals { y, ..e.clone() };
        Channels { experiments: self.experiments.iter().zip(outputs).map(signals).collect(), ..self.clone() }
    }

    /// Inputs and outputs without what the known signals explain of them.
    pub(super) fn beyond_disturbances(&self) -> Result<Cow<'_, [Signals]>> {
        if self.disturbances() == 0 {
            return Ok(Cow::Borrowed(&self.experiments));
        }
        let rest = |e: &Signals| {
            let (u, y) = (without(e.u.as_ref(), e.w.as_ref())?, without(e.y.as_ref(), e.w.as_ref())?);
            Ok(Signals { w: Mat::zeros(u.nrows(), 0), u, y })
        };
        Ok(Cow::Owned(self.experiments.iter().map(rest).collect::<Result<_>>()?))
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
        let delay = options.delays.iter().copied().max().unwrap_or(0);
        check_length(k, u.nrows(), (past, horizon), delay)?;
    }
    Ok((m, p))
}

/// One matrix per experiment, or none at all; as many signals and finite values in each.
fn check_disturbances(experiments: &[Experiment<'_>], disturbances: &[MatRef<'_, f64>]) -> Result<()> {
    let Some(first) = disturbances.first() else { return Ok(()) };
    if disturbances.len() != experiments.len() {
        let (value, must) = (disturbances.len() as f64, "one per experiment, or none");
        return Err(Error::OutOfRange { what: "the number of known disturbances".into(), value, must });
    }
    for (k, (e, w)) in experiments.iter().zip(disturbances).enumerate() {
        let what = format!("the known disturbance of experiment {}", k + 1);
        check_shape(&what, *w, (e.u.nrows(), first.ncols()))?;
        check_finite(&what, *w)?;
    }
    Ok(())
}

/// Refuses an experiment without a Hankel column.
fn check_length(k: usize, samples: usize, (past, horizon): (usize, usize), delay: usize) -> Result<()> {
    let needed = past.saturating_add(horizon).saturating_add(delay);
    if samples >= needed {
        return Ok(());
    }
    let delayed = if delay > 0 { format!(" after a delay of {delay} samples") } else { String::new() };
    let what = format!("experiment {} with a horizon of {horizon} and a past of {past} block rows{delayed}", k + 1);
    Err(Error::TooFewSamples { what, found: samples, needed })
}

/// What known signals do not explain of a record.
fn without(y: MatRef<'_, f64>, w: MatRef<'_, f64>) -> Result<Mat<f64>> {
    Ok(y - w * regress("the known disturbance", w, y)?)
}

fn rms_or_one(record: MatRef<'_, f64>, j: usize) -> f64 {
    let rms = record.col(j).norm_l2() / (record.nrows() as f64).sqrt();
    if rms > 0.0 { rms } else { 1.0 }
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
