//! The records and the start of one item.

use super::super::controller::{Design, design};
use super::super::item::{LoopRecord, generator, record};
use super::super::monte_carlo::monte_carlo;
use super::case::StartCase;
use super::settings::StartsSettings;
use crate::BearingStructure;
use crate::Result;
use crate::rig::degraded;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use youla::Mat;
use youla::lti::{Discrete, StateSpace, simulate};
use youla::signal::{Excitation, SquareWaves};

/// Stream of what is drawn for a start in open loop; records are drawn from the streams after it.
const OPEN: u64 = 1 << 41;
/// Streams of an item, one for each case in open loop.
const STREAMS: u64 = 32;
/// Amplitude of all square waves, V.
const AMPLITUDE: f64 = 0.5;
/// Frequencies of the periodic square waves, Hz.
const PERIODIC: [f64; 2] = [50.0, 70.0];
/// Part of the damping of the bearing that is left.
const LIGHT: f64 = 0.05;

/// What a search starts from and is compared with.
pub(super) struct Problem {
    pub(super) time: Discrete,
    /// True parameters.
    pub(super) truth: Vec<f64>,
    /// Where a search starts.
    pub(super) start: Vec<f64>,
    /// theta of the nominal model, or how far off the start is.
    pub(super) setting: f64,
    pub(super) estimation: LoopRecord,
    pub(super) verification: LoopRecord,
    /// The controller in closed loop.
    pub(super) design: Option<Design>,
}

impl Problem {
    /// Item number `index` of a case.
    ///
    /// # Errors
    /// [`youla::Error::NoController`]; those of settings without meaning.
    pub(super) fn new(case: StartCase, index: usize, settings: &StartsSettings) -> Result<Self> {
        if case.in_loop() { in_loop(case, index, settings) } else { open(case, index, settings) }
    }
}

/// theta of item number `index`, before anything is computed.
pub(super) fn theta_of(case: StartCase, index: usize, settings: &StartsSettings) -> f64 {
    monte_carlo(&paper_of(case, settings), 0.0, index).theta
}

/// The settings of the paper for the loops of a case.
fn paper_of(case: StartCase, settings: &StartsSettings) -> super::super::settings::PaperSettings {
    let mut paper = settings.paper.clone();
    paper.study.theta = [0.0, 0.95];
    if case == StartCase::SlowSquares {
        paper.study.theta = [0.6, 0.95];
        let slow = SquareWaves { amplitude: AMPLITUDE, hold_min: 5, hold_max: 60 };
        paper.study.excitation.excitation = Excitation::SquareWaves(slow);
    }
    paper
}

fn in_loop(case: StartCase, index: usize, settings: &StartsSettings) -> Result<Problem> {
    let (paper, bearing) = (paper_of(case, settings), &settings.bearing);
    let noise = if case == StartCase::Loop10 { 1.0 } else { 0.2 };
    let item = monte_carlo(&paper, noise, index);
    let (time, a_factor) = (Discrete::new(settings.sample_time)?, 1.0 - item.theta);
    let plant = bearing.plant()?.zoh(time)?;
    let nominal = degraded(&bearing.plant()?, a_factor, 1.0)?.zoh(time)?;
    let design = design(&nominal, &plant, &item.command_weights, &paper.controller)?;
    let study = &paper.study;
    Ok(Problem {
        time,
        truth: BearingStructure::parameters(bearing),
        start: BearingStructure::parameters(&bearing.degraded(a_factor, 1.0)?),
        setting: item.theta,
        estimation: record(&design, &plant, study.samples, noise, &paper, item.stream)?,
        verification: record(&design, &plant, study.verification_samples, 0.0, &paper, item.stream + 1)?,
        design: Some(design),
    })
}

fn open(case: StartCase, index: usize, settings: &StartsSettings) -> Result<Problem> {
    let time = Discrete::new(settings.sample_time)?;
    let mut bearing = settings.bearing;
    if case == StartCase::LightDamping {
        bearing.damping = bearing.damping.map(|row| row.map(|v| LIGHT * v));
    }
    let (truth, plant) = (BearingStructure::parameters(&bearing), bearing.plant()?.zoh(time)?);
    let place = StartCase::ALL.iter().position(|c| *c == case).unwrap_or_default() as u64;
    let stream = OPEN + STREAMS * index as u64 + 4 * place;
    let mut rng = generator(settings.paper.seed, stream);
    let (start, setting) = start(case, &truth, &mut rng);
    let study = &settings.paper.study;
    let mut rng = generator(settings.paper.seed, stream + 1);
    let u = if case == StartCase::Periodic {
        periodic(study.samples, time, &mut rng)
    } else {
        rich(study.samples, time, &mut rng)?
    };
    let mut rng = generator(settings.paper.seed, stream + 2);
    let y = noisy(&respond(&plant, &u)?, settings.open_loop_noise, &mut rng);
    let verified = rich(study.verification_samples, time, &mut generator(settings.paper.seed, stream + 3))?;
    let verification = LoopRecord { y: respond(&plant, &verified)?, u: verified };
    Ok(Problem { time, truth, start, setting, estimation: LoopRecord { u, y }, verification, design: None })
}

/// Parameters off the truth, and by how much.
fn start(case: StartCase, truth: &[f64], rng: &mut impl Rng) -> (Vec<f64>, f64) {
    let mut within = |[low, high]: [f64; 2]| low * (high / low).powf(rng.random::<f64>());
    if case == StartCase::FarStart {
        let factors: Vec<f64> = truth.iter().map(|_| within([0.125, 8.0])).collect();
        let furthest = factors.iter().map(|f| f.max(1.0 / f)).fold(1.0, f64::max);
        return (truth.iter().zip(&factors).map(|(v, f)| v * f).collect(), furthest);
    }
    let factor = within(if case == StartCase::Periodic { [0.2, 0.4] } else { [0.4, 2.0] });
    (truth.iter().map(|v| factor * v).collect(), factor)
}

fn rich(samples: usize, time: Discrete, rng: &mut impl Rng) -> Result<Mat<f64>> {
    let waves = SquareWaves { amplitude: AMPLITUDE, hold_min: 5, hold_max: 20 };
    Ok(Excitation::SquareWaves(waves).generate(samples, 2, time, rng)?)
}

/// One period and a random phase per input.
fn periodic(samples: usize, time: Discrete, rng: &mut impl Rng) -> Mat<f64> {
    let phase: [f64; 2] = [rng.random(), rng.random()];
    let turns = |k: usize, j: usize| (PERIODIC[j] * k as f64 * time.ts() + phase[j]).fract();
    Mat::from_fn(samples, 2, |k, j| if turns(k, j) < 0.5 { AMPLITUDE } else { -AMPLITUDE })
}

fn respond(plant: &StateSpace<Discrete>, u: &Mat<f64>) -> Result<Mat<f64>> {
    Ok(simulate(plant, u.as_ref(), &vec![0.0; plant.order()])?)
}

/// With white noise of a share of the rms of each output.
fn noisy(clean: &Mat<f64>, share: f64, rng: &mut impl Rng) -> Mat<f64> {
    let rms: Vec<f64> = clean.col_iter().map(|y| y.norm_l2() / (clean.nrows() as f64).sqrt()).collect();
    Mat::from_fn(clean.nrows(), clean.ncols(), |k, j| {
        clean[(k, j)] + share * rms[j] * rng.sample::<f64, _>(StandardNormal)
    })
}
