//! What one pass over the records tells of each channel: that it is finite and moves, its mean, spread and scale.

use super::batch::Batch;
use super::realisation::OutputPair;
use super::{ChannelScaling, Experiment, SubspaceOptions};
use crate::linalg::check_shape;
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Result};
use faer::Mat;
use rayon::prelude::*;

/// Samples of a piece of statistics.
const PIECE: usize = 1 << 14;

/// Number, length and scales of the channels.
pub(super) struct Channels {
    pub(super) inputs: usize,
    pub(super) outputs: usize,
    /// Samples of each experiment.
    pub(super) lengths: Vec<usize>,
    /// By which the channels `[u; y]` are divided.
    pub(super) scale: Vec<f64>,
    /// `sqrt(sum (y - mean y)^2)` of the scaled outputs over all experiments.
    pub(super) spread: Vec<f64>,
}

impl Channels {
    /// Refuses channels that are constant throughout.
    pub(super) fn new(
        inputs: usize,
        statistics: Statistics,
        lengths: Vec<usize>,
        scaling: ChannelScaling,
    ) -> Result<Self> {
        let found = statistics.channels;
        for (j, moments) in found.iter().enumerate() {
            if moments.constant {
                let (kind, j) = if j < inputs { ("input", j) } else { ("output", j - inputs) };
                let what = format!("{kind} channel {}", j + 1);
                return Err(Error::ConstantChannel { what, value: moments.first });
            }
        }
        let scale: Vec<f64> = match scaling {
            ChannelScaling::None => vec![1.0; found.len()],
            ChannelScaling::Rms => found.iter().map(Moments::rms).collect(),
        };
        let spread = (inputs..found.len()).map(|j| found[j].spread / scale[j]).collect();
        Ok(Channels { inputs, outputs: found.len() - inputs, lengths, scale, spread })
    }

    /// Scales of the outputs.
    pub(super) fn y_scale(&self) -> &[f64] {
        &self.scale[self.inputs..]
    }

    /// Puts the four matrices back into the units of the record.
    pub(super) fn unscale_model(
        &self,
        pair: OutputPair,
        b: Mat<f64>,
        d: Mat<f64>,
        time: Discrete,
    ) -> Result<StateSpace<Discrete>> {
        let (u, y) = self.scale.split_at(self.inputs);
        let b = Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / u[j]);
        let c = Mat::from_fn(pair.c.nrows(), pair.c.ncols(), |i, j| y[i] * pair.c[(i, j)]);
        let d = Mat::from_fn(d.nrows(), d.ncols(), |i, j| y[i] * d[(i, j)] / u[j]);
        StateSpace::new(pair.a, b, c, d, time)
    }
}

/// Moments of some samples of one channel; norms instead of their squares, which large numbers would overflow.
#[derive(Clone, Copy)]
struct Moments {
    first: f64,
    constant: bool,
    samples: f64,
    mean: f64,
    /// `sqrt(sum (v - mean)^2)`.
    spread: f64,
}

impl Moments {
    /// Of column c of values with `channels` columns; not finite where a value is not.
    fn of(values: &[f64], channels: usize, c: usize) -> Moments {
        let column = || values.iter().skip(c).step_by(channels);
        let (first, samples) = (values[c], (values.len() / channels) as f64);
        let (peak, constant) = column().fold((0.0_f64, true), |(p, same), v| (p.max(v.abs()), same && *v == first));
        let peak = peak.max(1e-300);
        let (inverse, shift) = (1.0 / peak, first / peak);
        let (sum, squares) = column().fold((0.0, 0.0), |(sum, squares), v| {
            let distance = v * inverse - shift;
            (sum + distance, squares + distance * distance)
        });
        let mean = sum / samples;
        let spread = (squares - sum * mean).max(if squares.is_finite() { 0.0 } else { f64::NAN }).sqrt();
        Moments { first, constant, samples, mean: first + peak * mean, spread: peak * spread }
    }

    fn and(self, later: Moments) -> Moments {
        let samples = self.samples + later.samples;
        let apart = later.mean - self.mean;
        let between = apart.abs() * (self.samples / samples).sqrt() * later.samples.sqrt();
        Moments {
            first: self.first,
            constant: self.constant && later.constant,
            samples,
            mean: self.mean + apart * (later.samples / samples),
            spread: self.spread.hypot(later.spread).hypot(between),
        }
    }

    fn rms(&self) -> f64 {
        (self.spread / self.samples.sqrt()).hypot(self.mean)
    }
}

/// Moments of all channels over what has been read.
pub(super) struct Statistics {
    inputs: usize,
    channels: Vec<Moments>,
    /// Whether a channel stays the same within each experiment is asked for; its first value may differ.
    current: Option<usize>,
    firsts: Vec<f64>,
    /// Block rows of past and future.
    blocks: (usize, usize),
}

impl Statistics {
    pub(super) fn new(inputs: usize, options: &SubspaceOptions) -> Self {
        let blocks = (options.past(), options.horizon);
        Statistics { inputs, channels: Vec::new(), current: None, firsts: Vec::new(), blocks }
    }

    /// Takes in a batch; refuses a value that is not finite and an experiment that is too short.
    pub(super) fn add(&mut self, batch: &Batch) -> Result<()> {
        let q = batch.channels;
        for segment in &batch.segments {
            let (past, horizon) = self.blocks;
            let found = segment.start + segment.samples();
            let fresh = &batch.values(segment)[segment.repeated * q..];
            let pieces: Vec<Vec<Moments>> =
                fresh.par_chunks(PIECE * q).map(|piece| (0..q).map(|c| Moments::of(piece, q, c)).collect()).collect();
            if pieces.iter().flatten().any(|m| !(m.mean.is_finite() && m.spread.is_finite())) {
                self.check_finite(fresh, q, segment.experiment, segment.start + segment.repeated)?;
            }
            if segment.ends && found < past + horizon {
                let k = segment.experiment + 1;
                let what = format!("experiment {k} with a horizon of {horizon} and a past of {past} block rows");
                return Err(Error::TooFewSamples { what, found, needed: past + horizon });
            }
            pieces.into_iter().for_each(|piece| self.join(segment.experiment, piece));
        }
        Ok(())
    }

    fn join(&mut self, experiment: usize, piece: Vec<Moments>) {
        if self.current != Some(experiment) {
            self.current = Some(experiment);
            self.firsts = piece.iter().map(|m| m.first).collect();
        }
        if self.channels.is_empty() {
            self.channels = piece;
            return;
        }
        for ((all, mut later), first) in self.channels.iter_mut().zip(piece).zip(&self.firsts) {
            later.constant &= later.first == *first;
            *all = all.and(later);
        }
    }

    fn check_finite(&self, values: &[f64], q: usize, experiment: usize, start: usize) -> Result<()> {
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(k) => {
                let (row, c) = (start + k / q + 1, k % q);
                let (kind, column) = if c < self.inputs { ("input", c + 1) } else { ("output", c + 1 - self.inputs) };
                Err(Error::NotFinite {
                    what: format!("the {kind} record of experiment {}", experiment + 1),
                    row,
                    column,
                })
            }
        }
    }
}

/// Numbers of channels and lengths of records in memory.
pub(super) fn check_shapes(experiments: &[Experiment<'_>]) -> Result<()> {
    at_least("the number of experiments", experiments.len(), 1, "at least 1")?;
    let (m, p) = (experiments[0].u.ncols(), experiments[0].y.ncols());
    check_ports(m, p)?;
    for (k, Experiment { u, y }) in experiments.iter().enumerate() {
        let named = |what: &str| format!("the {what} record of experiment {}", k + 1);
        check_shape(&named("input"), *u, (u.nrows(), m))?;
        check_shape(&named("output"), *y, (u.nrows(), p))?;
    }
    Ok(())
}

/// Refuses records without inputs or outputs.
pub(super) fn check_ports(inputs: usize, outputs: usize) -> Result<()> {
    at_least("the number of inputs", inputs, 1, "at least 1")?;
    at_least("the number of outputs", outputs, 1, "at least 1")
}

/// Refuses a horizon or past without meaning.
pub(super) fn check_blocks(options: &SubspaceOptions) -> Result<()> {
    at_least("the horizon", options.horizon, 2, "at least 2 block rows")?;
    at_least("the past", options.past(), 1, "at least 1 block row")
}

fn at_least(what: &str, value: usize, least: usize, must: &'static str) -> Result<()> {
    if value >= least { Ok(()) } else { Err(Error::OutOfRange { what: what.into(), value: value as f64, must }) }
}
