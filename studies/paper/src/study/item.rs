//! One nominal model: its controller, its loop, identification by every method, verification without noise.

use super::controller::{Design, design};
use super::method::StudyMethod;
use super::row::{RowStatus, StudyRow};
use super::settings::PaperSettings;
use crate::Result;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::cell::OnceCell;
use std::time::{Duration, Instant};
use youla::Mat;
use youla::control::closed_loop;
use youla::factor::YoulaSignals;
use youla::identify::direct::direct;
use youla::identify::hansen::{HansenModel, hansen};
use youla::identify::likelihood::{LikelihoodOptions, recommend};
use youla::identify::subspace::{self, InitialState, SubspaceOptions};
use youla::linalg::block;
use youla::lti::{Discrete, StateSpace, simulate};
use youla::reduce::reduce;
use youla::signal::RampedExcitation;
use youla::validate::fit;
use youla_greybox::hansen_pem::{HansenPemOptions, SchemeData, pem_from_hansen};
use youla_greybox::{GreyBoxModel, Problem, greybox};
use youla_twin::BearingStructure;
use youla_twin::rig::Bearing;

/// What distinguishes one loop from another.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Number, from 0.
    pub index: usize,
    /// First of two random streams of this item: estimation and verification.
    pub stream: u64,
    /// Degradation of the nominal model: `A_model = (1 - theta) A`, eq. (27).
    pub theta: f64,
    /// Output noise, um rms.
    pub noise: f64,
    /// Weights of the command that may be tried, in order.
    pub command_weights: Vec<f64>,
}

/// The rows of an item, and how long each took.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// The nominal model, then the methods in the order of the settings.
    pub rows: Vec<StudyRow>,
    /// Design and simulation, then as `rows`.
    pub durations: Vec<Duration>,
}

/// Runs one loop around the bearing `truth` and identifies it by every method.
///
/// The data are those of the linear rig at rest: the plant behind a zero-order hold, white noise on the outputs. Models are
/// compared with a second record without noise, from rest, by the fit (26). A method that finds no model, or an unstable one,
/// is an outcome.
///
/// # Errors
/// [`crate::Error::NoController`]; [`youla::Error::OutOfRange`] for settings without meaning.
pub fn evaluate(item: &Item, truth: &Bearing, time: Discrete, settings: &PaperSettings) -> Result<Evaluated> {
    let mut clock = Laps::start();
    // theta = 1 would leave nothing of A.
    let a_factor = (1.0 - item.theta).max(f64::EPSILON);
    let nominal = youla_twin::rig::degraded(&truth.plant()?, a_factor, 1.0)?.zoh(time)?;
    let plant = truth.plant()?.zoh(time)?;
    let design = design(&nominal, &plant, &item.command_weights, &settings.controller)?;
    let (samples, verification_samples) = (settings.study.samples, settings.study.verification_samples);
    let estimation = record(&design, &plant, samples, item.noise, settings, item.stream)?;
    let verification = record(&design, &plant, verification_samples, 0.0, settings, item.stream + 1)?;
    clock.lap();
    let start = truth.degraded(a_factor, 1.0)?;
    let (single, hansen) = (OnceCell::new(), OnceCell::new());
    let loop_data = LoopData { design: &design, estimation, verification, start, single, hansen };
    let methods = [StudyMethod::Nominal]
        .into_iter()
        .chain(settings.methods.iter().copied().filter(|m| *m != StudyMethod::Nominal));
    let rows = methods
        .map(|method| {
            let row = loop_data.row(item, method, settings);
            clock.lap();
            row
        })
        .collect();
    Ok(Evaluated { rows, durations: clock.laps })
}

/// Seconds of one part after the other.
struct Laps {
    last: Instant,
    laps: Vec<Duration>,
}

impl Laps {
    fn start() -> Self {
        Laps { last: Instant::now(), laps: Vec::new() }
    }

    fn lap(&mut self) {
        let now = Instant::now();
        self.laps.push(now - self.last);
        self.last = now;
    }
}

/// A record of the loop, from rest.
struct StudyRecord {
    u: Mat<f64>,
    y: Mat<f64>,
}

fn record(
    design: &Design,
    plant: &StateSpace<Discrete>,
    samples: usize,
    noise: f64,
    settings: &PaperSettings,
    stream: u64,
) -> Result<StudyRecord> {
    let alpha = excitation(&settings.study.excitation, samples, plant.time(), settings.seed, 2 * stream)?;
    let mut rng = generator(settings.seed, 2 * stream + 1);
    let n = Mat::from_fn(samples, 2, |_, _| noise * rng.sample::<f64, _>(StandardNormal));
    let closed = closed_loop(plant, &design.factors.j_k()?)?;
    let driving = block(&[&[alpha.as_ref(), n.as_ref()]]);
    let z = simulate(&closed, driving.as_ref(), &vec![0.0; closed.order()])?;
    Ok(StudyRecord { u: z.subcols(0, 2).to_owned(), y: z.subcols(2, 2).to_owned() })
}

/// alpha from its own random stream.
pub(super) fn excitation(
    signal: &RampedExcitation,
    samples: usize,
    time: Discrete,
    seed: u64,
    stream: u64,
) -> Result<Mat<f64>> {
    Ok(signal.generate(samples, 2, time, &mut generator(seed, stream))?)
}

/// The generator of one stream.
pub(super) fn generator(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

struct LoopData<'a> {
    design: &'a Design,
    estimation: StudyRecord,
    verification: StudyRecord,
    start: Bearing,
    /// The search from the nominal model, which several methods take part in.
    single: OnceCell<Result<GreyBoxModel, String>>,
    /// S and G(S), which several methods use.
    hansen: OnceCell<Result<HansenModel, String>>,
}

/// A model, the steps of the search that led to it, and what was done to it.
struct Found {
    model: StateSpace<Discrete>,
    steps: Option<usize>,
    note: String,
}

impl LoopData<'_> {
    fn row(&self, item: &Item, method: StudyMethod, settings: &PaperSettings) -> StudyRow {
        let judged = self.identify(method, settings).and_then(|found| self.judge(found).map_err(text));
        let (status, fit, steps, note) = match judged {
            Ok(outcome) => outcome,
            Err(reason) => (RowStatus::Refused, [f64::NAN; 2], None, reason),
        };
        StudyRow {
            item: item.index,
            theta: item.theta,
            noise: item.noise,
            command_weight: self.design.command_weight,
            peak_nominal: self.design.peak_nominal,
            peak_plant: self.design.peak_plant,
            method,
            status,
            fit,
            steps,
            note,
        }
    }

    fn judge(&self, found: Found) -> Result<(RowStatus, [f64; 2], Option<usize>, String)> {
        let status = if found.model.is_stable()? { RowStatus::Stable } else { RowStatus::Unstable };
        Ok((status, fit_on(&self.verification, &found.model)?, found.steps, found.note))
    }

    fn identify(&self, method: StudyMethod, settings: &PaperSettings) -> Result<Found, String> {
        let black_box = |model| Found { model, steps: None, note: String::new() };
        let from_s = |model, hansen: &HansenModel| Found { model, steps: None, note: reflected(hansen) };
        match method {
            StudyMethod::Nominal => Ok(black_box(self.design.factors.nominal().clone())),
            StudyMethod::Pem => self.single(settings).map(grey_box),
            StudyMethod::PemMultiStart => self.best_pem(settings).map(|found| grey_box(&found)),
            StudyMethod::Direct => direct(&self.experiment(), self.time(), &at_rest(&settings.direct))
                .map(|found| black_box(found.model))
                .map_err(text),
            StudyMethod::Hansen => self.hansen(settings).map(|found| from_s(found.plant.clone(), found)),
            StudyMethod::HansenReduced => {
                let found = self.hansen(settings)?;
                let reduced = reduce(&found.plant, &settings.reduction).map_err(text)?;
                Ok(from_s(reduced.model, found))
            }
            StudyMethod::HansenPem => self.hansen_pem(settings),
            StudyMethod::Auto => recommend(&self.experiment(), &[], None, self.time(), &LikelihoodOptions::default())
                .map(|found| black_box(found.plant))
                .map_err(text),
        }
    }

    fn time(&self) -> Discrete {
        self.design.factors.nominal().time()
    }

    fn experiment(&self) -> [subspace::Experiment<'_>; 1] {
        [subspace::Experiment::new(self.estimation.u.as_ref(), self.estimation.y.as_ref())]
    }

    fn pem(&self, start: &Bearing, settings: &PaperSettings) -> Result<GreyBoxModel, String> {
        let start = BearingStructure::parameters(start);
        greybox(&Problem::new(&BearingStructure, &self.experiment(), self.time()), &start, &settings.pem).map_err(text)
    }

    fn single(&self, settings: &PaperSettings) -> Result<&GreyBoxModel, String> {
        self.single.get_or_init(|| self.pem(&self.start, settings)).as_ref().map_err(String::clone)
    }

    /// The lowest criterion over all starts; a start from which nothing is found is left out.
    fn best_pem(&self, settings: &PaperSettings) -> Result<GreyBoxModel, String> {
        let mut best = self.single(settings).cloned();
        for factor in settings.experiments.start_factors.iter().filter(|factor| **factor != 1.0) {
            let start = self.start.degraded(*factor, 1.0).map_err(text);
            best = lower(start.and_then(|start| self.pem(&start, settings)), best);
        }
        best
    }

    fn signals(&self) -> Result<YoulaSignals, String> {
        self.design.factors.signals(self.estimation.u.as_ref(), self.estimation.y.as_ref()).map_err(text)
    }

    fn hansen(&self, settings: &PaperSettings) -> Result<&HansenModel, String> {
        let found = || hansen(&self.design.factors, &[self.signals()?], &at_rest(&settings.hansen)).map_err(text);
        self.hansen.get_or_init(found).as_ref().map_err(String::clone)
    }

    /// The prediction-error method from the projection of G(S) and from the nominal model, the lower criterion of both.
    fn hansen_pem(&self, settings: &PaperSettings) -> Result<Found, String> {
        let found = self.hansen(settings)?;
        let note = reflected(found);
        let options = HansenPemOptions { pem: settings.pem.clone(), ..Default::default() };
        let (factors, signals) = (&self.design.factors, [self.signals()?]);
        let from_projection = pem_from_hansen(
            found.clone(),
            SchemeData { factors, signals: &signals },
            &Problem::new(&BearingStructure, &self.experiment(), self.time()),
            None,
            &options,
        );
        let model = lower(from_projection.map(|found| found.model).map_err(text), self.single(settings).cloned())?;
        Ok(Found { note, ..grey_box(&model) })
    }
}

/// The records of the study begin at rest.
fn at_rest(options: &SubspaceOptions) -> SubspaceOptions {
    SubspaceOptions { initial_state: InitialState::Zero, ..options.clone() }
}

/// Fit (26) per axis on the noise-free record; minus infinity for a simulation that leaves the numbers.
fn fit_on(StudyRecord { u, y }: &StudyRecord, model: &StateSpace<Discrete>) -> Result<[f64; 2]> {
    match simulate(model, u.as_ref(), &vec![0.0; model.order()]) {
        Ok(predicted) => {
            let percent = fit(y.as_ref(), predicted.as_ref())?;
            Ok([percent[0], percent[1]])
        }
        Err(youla::Error::Diverged { .. }) => Ok([f64::NEG_INFINITY; 2]),
        Err(e) => Err(e.into()),
    }
}

/// The one with the lower criterion; one that there is rather than none.
pub(super) fn lower(
    one: Result<GreyBoxModel, String>,
    other: Result<GreyBoxModel, String>,
) -> Result<GreyBoxModel, String> {
    match (&one, &other) {
        (Ok(a), Ok(b)) if a.cost < b.cost => one,
        (Ok(_), Err(_)) => one,
        _ => other,
    }
}

pub(super) fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn grey_box(found: &GreyBoxModel) -> Found {
    Found { model: found.model.clone(), steps: Some(found.iterations), note: String::new() }
}

/// What was done to the poles of S.
fn reflected(found: &HansenModel) -> String {
    match found.deviation.stability.moved.len() {
        0 => String::new(),
        poles => format!("{poles} poles of S reflected"),
    }
}
