//! The records as the method sees them: views with the scale of each channel, and scaled copies where something was done to
//! them or is to be done.

use crate::identify::subspace::output_pair::OutputPair;
use crate::identify::subspace::records::delay::Delays;
use crate::identify::subspace::records::experiment::Experiment;
use crate::identify::subspace::records::statistics::Statistics;
use crate::identify::subspace::records::view::{Signals, View};
use crate::identify::subspace::{ChannelScaling, InitialState, SubspaceOptions};
use crate::linalg::{check_finite, check_shape, regress};
use crate::lti::{Discrete, StateSpace};
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::borrow::Cow;

/// Where the samples are.
#[derive(Clone)]
enum Storage<'a> {
    /// With the caller, in his units.
    Borrowed(Vec<View<'a>>),
    /// Here, in scaled units.
    Scaled(Vec<Signals>),
}

/// All experiments.
#[derive(Clone)]
pub(crate) struct Channels<'a> {
    held: Storage<'a>,
    pub(crate) inputs: usize,
    pub(crate) outputs: usize,
    /// By which the channels of `[u; y]` are divided.
    scale: Vec<f64>,
    /// Per experiment, of each known signal of a disturbance.
    w_scale: Vec<Vec<f64>>,
    /// `sqrt(sum (y - mean y)^2)` of the scaled outputs over all experiments.
    spread: Vec<f64>,
    pub(crate) delays: Delays,
    /// Per experiment, the delay states at the first sample that is used, in the units of the record.
    pub(crate) delayed: Vec<Vec<f64>>,
}

impl<'a> Channels<'a> {
    pub(crate) fn new(experiments: &[Experiment<'a>], options: &SubspaceOptions) -> Result<Self> {
        check_blocks(options)?;
        let (inputs, outputs) = check_shapes(experiments)?;
        let disturbed = check_disturbances(experiments)?;
        let delays = Delays::new(&options.delays, inputs)?;
        let mut statistics = Statistics::new(inputs);
        for (k, Experiment { u, y, .. }) in experiments.iter().enumerate() {
            check_length(k, u.nrows(), least_blocks(options), delays.longest())?;
            statistics.add(View::of(*u, *y), k)?;
        }
        let given: Vec<View<'a>> = experiments.iter().map(|e| View::of(e.u, e.y)).collect();
        if !disturbed && delays.longest() == 0 {
            let channels = Channels::read((inputs, outputs), statistics, given.len(), options.scaling)?;
            return Ok(Channels { held: Storage::Borrowed(given), ..channels });
        }
        Channels::made(experiments, disturbed, delays, options)
    }

    /// Scales and numbers of channels, before any record is held.
    fn read(
        (inputs, outputs): (usize, usize),
        statistics: Statistics,
        experiments: usize,
        scaling: ChannelScaling,
    ) -> Result<Self> {
        let scale = statistics.scales(scaling)?;
        let spread = (inputs..inputs + outputs).map(|j| statistics.spread(j) / scale[j]).collect();
        let delays = Delays::new(&[], inputs)?;
        let held = Storage::Borrowed(Vec::new());
        let (w_scale, delayed) = (Vec::new(), vec![Vec::new(); experiments]);
        Ok(Channels { held, inputs, outputs, scale, w_scale, spread, delays, delayed })
    }

    /// Copies from which the delays are taken, with the known signals beside them.
    fn made(
        experiments: &[Experiment<'a>],
        disturbed: bool,
        delays: Delays,
        options: &SubspaceOptions,
    ) -> Result<Self> {
        let inputs = experiments[0].u.ncols();
        let delayed = experiments.iter().map(|e| delays.states_at_start(e)).collect();
        let from_start = |m: MatRef<'a, f64>| m.subrows(delays.longest(), m.nrows() - delays.longest());
        let u: Vec<_> = experiments.iter().map(|e| delays.shift(e.u)).collect();
        let y: Vec<_> = experiments.iter().map(|e| from_start(e.y)).collect();
        let w: Vec<_> = experiments.iter().filter(|_| disturbed).map(|e| from_start(e.known())).collect();
        // Lines larger than the rest must not set the weights of the outputs.
        let quiet = y.iter().zip(&w).map(|(y, w)| without(*y, *w)).collect::<Result<Vec<_>>>()?;
        let mut statistics = Statistics::new(inputs);
        for e in 0..y.len() {
            statistics.add(View::of(u[e].as_ref(), quiet.get(e).map_or(y[e], |y| y.as_ref())), e)?;
        }
        let channels = Channels::read((inputs, y[0].ncols()), statistics, y.len(), options.scaling)?;
        let w_scale: Vec<Vec<f64>> = w.iter().map(|w| (0..w.ncols()).map(|j| rms_or_one(*w, j)).collect()).collect();
        let (u_scale, y_scale) = channels.scale.split_at(inputs);
        let signals = |e: usize| Signals {
            u: divide(u[e].as_ref(), u_scale),
            y: divide(y[e], y_scale),
            w: w.get(e).map_or_else(|| Mat::zeros(y[e].nrows(), 0), |w| divide(*w, &w_scale[e])),
        };
        let held = Storage::Scaled((0..y.len()).map(signals).collect());
        Ok(Channels { held, w_scale, delays, delayed, ..channels })
    }

    /// All samples, divided by [`Self::scale_of_views`] still.
    pub(crate) fn views(&self) -> Vec<View<'_>> {
        match &self.held {
            Storage::Borrowed(given) => given.clone(),
            Storage::Scaled(made) => made.iter().map(Signals::view).collect(),
        }
    }

    /// By what the channels of the views are larger than those of the scaled records.
    pub(crate) fn scale_of_views(&self) -> Vec<f64> {
        match &self.held {
            Storage::Borrowed(_) => self.scale.clone(),
            Storage::Scaled(_) => vec![1.0; self.scale.len()],
        }
    }

    /// Scaled copies of all samples.
    pub(crate) fn scaled(&self) -> Cow<'_, [Signals]> {
        match &self.held {
            Storage::Scaled(made) => Cow::Borrowed(made),
            Storage::Borrowed(given) => {
                let (u_scale, y_scale) = self.scale.split_at(self.inputs);
                let copy =
                    |v: &View<'_>| Signals { u: divide(v.u, u_scale), y: divide(v.y, y_scale), w: v.w.to_owned() };
                Cow::Owned(given.iter().map(copy).collect())
            }
        }
    }

    /// Scales of the outputs.
    pub(crate) fn y_scale(&self) -> &[f64] {
        &self.scale[self.inputs..]
    }

    /// `sqrt(sum (y - mean y)^2)` of each scaled output without disturbances of these coefficients, so that they do not count
    /// as the model's merit.
    pub(crate) fn spread(&self, disturbances: &[Mat<f64>]) -> Result<Vec<f64>> {
        if self.disturbances() == 0 {
            return Ok(self.spread.clone());
        }
        let mut statistics = Statistics::new(self.inputs);
        for (e, (signals, a)) in self.scaled().iter().zip(disturbances).enumerate() {
            statistics.add(View::of(signals.u.as_ref(), (&signals.y - &signals.w * a).as_ref()), e)?;
        }
        Ok((self.inputs..self.scale.len()).map(|j| statistics.spread(j)).collect())
    }

    /// Number of known signals of a disturbance.
    pub(crate) fn disturbances(&self) -> usize {
        self.w_scale.first().map_or(0, Vec::len)
    }

    /// Puts the coefficients of the known signals (signals x outputs, per experiment) back into the units of the record.
    pub(crate) fn unscale_disturbances(&self, found: Vec<Mat<f64>>) -> Vec<Mat<f64>> {
        let one = |(a, scale): (Mat<f64>, &Vec<f64>)| {
            Mat::from_fn(a.nrows(), a.ncols(), |j, i| self.y_scale()[i] * a[(j, i)] / scale[j])
        };
        found.into_iter().zip(&self.w_scale).map(one).collect()
    }

    /// Refuses experiments that are too short for so many block rows of past and future.
    pub(crate) fn check_lengths(&self, blocks: (usize, usize)) -> Result<()> {
        self.views().iter().enumerate().try_for_each(|(k, v)| check_length(k, v.samples(), blocks, 0))
    }

    /// Puts the four matrices back into the units of the record.
    pub(crate) fn unscale_model(
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
    pub(crate) fn unscale(&self, b: &Mat<f64>, c: &Mat<f64>, d: &Mat<f64>) -> (Mat<f64>, Mat<f64>, Mat<f64>) {
        let (u, y) = self.scale.split_at(self.inputs);
        (
            Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / u[j]),
            Mat::from_fn(c.nrows(), c.ncols(), |i, j| y[i] * c[(i, j)]),
            Mat::from_fn(d.nrows(), d.ncols(), |i, j| y[i] * d[(i, j)] / u[j]),
        )
    }
}

/// Numbers of inputs and outputs of records in memory, which must not differ between them.
pub(crate) fn check_shapes(experiments: &[Experiment<'_>]) -> Result<(usize, usize)> {
    at_least("the number of experiments", experiments.len(), 1, "at least 1")?;
    let (m, p) = (experiments[0].u.ncols(), experiments[0].y.ncols());
    check_ports(m, p)?;
    for (k, Experiment { u, y, .. }) in experiments.iter().enumerate() {
        let named = |what: &str| format!("the {what} record of experiment {}", k + 1);
        check_shape(&named("input"), *u, (u.nrows(), m))?;
        check_shape(&named("output"), *y, (u.nrows(), p))?;
    }
    Ok((m, p))
}

/// Refuses records without inputs or outputs.
pub(crate) fn check_ports(inputs: usize, outputs: usize) -> Result<()> {
    at_least("the number of inputs", inputs, 1, "at least 1")?;
    at_least("the number of outputs", outputs, 1, "at least 1")
}

/// Block rows that each experiment must hold, whatever horizon is found.
pub(crate) fn least_blocks(options: &SubspaceOptions) -> (usize, usize) {
    options.block_rows()
}

/// Refuses an experiment without a Hankel column.
pub(crate) fn check_length(k: usize, samples: usize, (past, horizon): (usize, usize), delay: usize) -> Result<()> {
    let needed = past.saturating_add(horizon).saturating_add(delay);
    if samples >= needed {
        return Ok(());
    }
    let delayed = if delay > 0 { format!(" after a delay of {delay} samples") } else { String::new() };
    let what = format!("experiment {} with a horizon of {horizon} and a past of {past} block rows{delayed}", k + 1);
    Err(Error::TooFewSamples { what, found: samples, needed })
}

/// As many known signals in each experiment, finite and of its length; whether there are any.
fn check_disturbances(experiments: &[Experiment<'_>]) -> Result<bool> {
    let signals = experiments[0].known().ncols();
    for (k, e) in experiments.iter().enumerate() {
        let what = format!("the known disturbance of experiment {}", k + 1);
        check_shape(&what, e.known(), (e.u.nrows(), signals))?;
        check_finite(&what, e.known())?;
    }
    Ok(experiments.iter().any(|e| e.disturbance.is_some()))
}

/// What known signals do not explain of a record.
fn without(y: MatRef<'_, f64>, w: MatRef<'_, f64>) -> Result<Mat<f64>> {
    Ok(y - w * regress("the known disturbance", w, y)?)
}

fn rms_or_one(record: MatRef<'_, f64>, j: usize) -> f64 {
    let rms = record.col(j).norm_l2() / (record.nrows() as f64).sqrt();
    if rms > 0.0 { rms } else { 1.0 }
}

/// Refuses a horizon, past or initial state without meaning.
pub(crate) fn check_blocks(options: &SubspaceOptions) -> Result<()> {
    if options.initial_state == InitialState::SteadyState {
        return Err(Error::Unsupported {
            what: "initial_state = \"steady-state\" for a black box",
            instead: "it serves physical structures only; take \"estimated\" or \"zero\"",
        });
    }
    at_least("the horizon", options.horizon, 2, "at least 2 block rows")?;
    at_least("the past", options.block_rows().0, 1, "at least 1 block row")
}

fn at_least(what: &str, value: usize, least: usize, must: &'static str) -> Result<()> {
    if value >= least { Ok(()) } else { Err(Error::OutOfRange { what: what.into(), value: value as f64, must }) }
}

fn divide(record: MatRef<'_, f64>, scale: &[f64]) -> Mat<f64> {
    Mat::from_fn(record.nrows(), record.ncols(), |i, j| record[(i, j)] / scale[j])
}
