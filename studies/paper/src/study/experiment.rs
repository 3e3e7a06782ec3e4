//! One experiment of Table 1: closed-loop records of the digital twin, and the models of all methods.

use super::controller::{Design, design_with};
use super::item::{excitation, generator, lower, text};
use super::method::StudyMethod;
use super::settings::PaperSettings;
use crate::study::{ExcitationReport, ExcitationReportOptions, describe_excitation};
use crate::{Error, Result};
use rand::RngExt;
use rayon::prelude::*;
use std::time::Instant;
use youla::control::real_time_controller;
use youla::factor::YoulaSignals;
use youla::identify::hansen::{HansenModel, hansen};
use youla::identify::subspace::{self, InitialState, SubspaceOptions};
use youla::lti::{Discrete, Mode, StateSpace, simulate};
use youla::reduce::reduce;
use youla::signal::{Welch, without_harmonics};
use youla::validate::{certify, fit, predict_open_loop};
use youla::{Mat, MatRef};
use youla_greybox::hansen_pem::{HansenPemOptions, SchemeData, pem_from_hansen};
use youla_greybox::{GreyBoxModel, GreyBoxOptions, Problem, Stop, greybox};
use youla_twin::BearingStructure;
use youla_twin::rig::{Bearing, BearingRig, ExperimentRecord, Fidelity, ObserverLoop, RigParameters, run_experiment};

/// How an experiment differs from the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Key in files.
    pub key: &'static str,
    /// In words.
    pub title: String,
    /// Factor on all entries of A of the nominal model.
    pub a_factor: f64,
    /// Factor on all entries of B of the nominal model.
    pub b_factor: f64,
    /// The rig.
    pub fidelity: Fidelity,
    /// The figure of the paper that shows it.
    pub figure: usize,
    /// Published fits, percent, horizontal and vertical, of the nominal model, PEM, G(S) and G_red(S).
    pub published: [[f64; 2]; 4],
}

/// Records, models and evidence.
#[derive(Debug, Clone)]
pub struct StudyExperiment {
    /// What was done.
    pub case: Case,
    /// The controller; its margin with the true plant is that with the linear part of the rig.
    pub design: Design,
    /// The record that the models are identified from.
    pub estimation: ExperimentRecord,
    /// The record that they are compared with.
    pub verification: ExperimentRecord,
    /// What alpha of the estimation record excites, for the horizon of S.
    pub excitation: ExcitationReport,
    /// Samples at the start of both that are not used.
    pub settle: usize,
    /// One per method, in the order of Table 1.
    pub models: Vec<ExperimentModel>,
    /// The prediction-error method from several starts.
    pub starts: Vec<Start>,
    /// Poles of S that were reflected at the unit circle.
    pub reflected: usize,
    /// beta of the verification record, and what S makes of its alpha; from sample `settle` on.
    pub beta: Option<[Mat<f64>; 2]>,
}

/// A model of one experiment.
#[derive(Debug, Clone)]
pub struct ExperimentModel {
    /// The method.
    pub method: StudyMethod,
    /// The model, or why there is none.
    pub model: Result<StateSpace<Discrete>, String>,
    /// Fit (26) on the verification record, percent; NaN without a model.
    pub fit: [f64; 2],
    /// The predicted output from sample `settle` on; empty without a model.
    pub predicted: Mat<f64>,
    /// Whether the model is stable.
    pub stable: bool,
    /// Whether the controller of the experiment stabilises the model.
    pub stabilised: bool,
    /// Its modes.
    pub modes: Vec<Mode>,
    /// Seconds that its identification took.
    pub seconds: f64,
}

/// One run of the prediction-error method.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Factor on A of the nominal model where it started.
    pub factor: f64,
    /// The criterion where it ended: half the sum of squares of the residuals.
    pub cost: f64,
    /// Fit (26) on the verification record, percent.
    pub fit: [f64; 2],
    /// Steps.
    pub steps: usize,
    /// Why it ended.
    pub stop: Stop,
}

/// What the models are found from and compared with, without the samples at the start.
struct Data<'a> {
    settings: &'a PaperSettings,
    design: &'a Design,
    start: Bearing,
    /// Estimation, without the lines of the speed.
    u: Mat<f64>,
    y: Mat<f64>,
    signals: YoulaSignals,
    /// Verification, as measured.
    verification_u: Mat<f64>,
    verification_y: Mat<f64>,
    initial_state: InitialState,
}

/// Runs one experiment around a nominal bearing that was identified before. `stream` is the first of four random streams.
///
/// # Errors
/// Those of the design and of the rig; a method that finds no model is an outcome.
pub(super) fn run(
    case: Case,
    nominal: &Bearing,
    parameters: &RigParameters,
    settings: &PaperSettings,
    stream: u64,
) -> Result<StudyExperiment> {
    let start = nominal.degraded(case.a_factor, case.b_factor)?;
    let rig = BearingRig::new(parameters, case.fidelity, 0)?;
    let time = youla_twin::rig::SimulatedRig::time(&rig);
    let model = start.plant()?.zoh(time)?;
    let weight = settings.experiments.command_weight;
    let design = design_with(&model, &rig.true_plant()?, weight, &settings.controller)?;
    let lengths = [settings.experiments.samples, settings.experiments.verification_samples];
    let record = |k: usize| closed_loop_record(&case, &design, parameters, settings, lengths[k], stream + 2 * k as u64);
    let (estimation, verification) = (record(0)?, record(1)?);
    let turning = matches!(case.fidelity, Fidelity::Rotating { .. });
    let settle = if turning { settings.experiments.settle } else { 0 };
    for record in [&estimation, &verification] {
        require_rest(record, settle)?;
    }
    let data = data(settings, &design, start, [&estimation, &verification], settle, turning)?;
    let single = timed(|| data.pem(1.0));
    let starts = data.starts(&single.0);
    let pem = |(_, found): &(Start, GreyBoxModel)| found.model.clone();
    let hansen = timed(|| data.hansen());
    let reduced = timed(|| reduce(&hansen.0.as_ref().map_err(String::clone)?.plant, &settings.reduction).map_err(text));
    let projected = timed(|| data.hansen_pem(hansen.0.as_ref().map_err(String::clone)?.clone(), &single.0));
    let best = starts.iter().min_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
    let models = vec![
        data.judge(StudyMethod::Nominal, Ok(design.factors.nominal().clone()), 0.0)?,
        data.judge(StudyMethod::Pem, single.0.map(|found| found.model), single.1)?,
        data.judge(StudyMethod::PemMultiStart, best.map(pem).ok_or_else(|| "no start led to a model".into()), 0.0)?,
        data.judge(StudyMethod::Hansen, hansen.0.as_ref().map(|h| h.plant.clone()).map_err(String::clone), hansen.1)?,
        data.judge(StudyMethod::HansenReduced, reduced.0.map(|r| r.model), reduced.1)?,
        data.judge(StudyMethod::HansenPem, projected.0.map(|found| found.model), single.1 + hansen.1 + projected.1)?,
    ];
    let excitation = described(&estimation, settings)?;
    let reflected = hansen.0.as_ref().map_or(0, |found| found.deviation.stability.moved.len());
    let beta = hansen.0.ok().map(|found| data.beta(&found)).transpose()?;
    let starts = starts.into_iter().map(|(start, _)| start).collect();
    Ok(StudyExperiment { case, design, estimation, verification, excitation, settle, models, starts, reflected, beta })
}

/// Fails for a record that ended, because the rotor touched, before it can be used.
fn require_rest(record: &ExperimentRecord, settle: usize) -> Result<()> {
    let found = record.y.nrows();
    if found > settle {
        return Ok(());
    }
    let what = format!("the record, which ended where the rotor touched, with {settle} samples at its start not used");
    Err(Error::Method(youla::Error::TooFewSamples { what, found, needed: settle + 1 }))
}

/// Persistency up to the block rows that the identification of S needs.
fn described(record: &ExperimentRecord, settings: &PaperSettings) -> Result<ExcitationReport> {
    let (past, future) = settings.hansen.block_rows();
    let order = past.saturating_add(future);
    // At least eight half-overlapping windows, of a record of 20 000 samples those of the default.
    let welch = Welch::default();
    let window = welch.window.min(record.alpha.nrows() / 4).max(2);
    let welch = Welch { window, ..welch };
    let options = ExcitationReportOptions { wanted_order: order, highest_order: order, welch };
    describe_excitation(record.alpha.as_ref(), record.time, &options)
}

/// The rig under the controller that firmware would run.
fn closed_loop_record(
    case: &Case,
    design: &Design,
    parameters: &RigParameters,
    settings: &PaperSettings,
    samples: usize,
    stream: u64,
) -> Result<ExperimentRecord> {
    let nominal = design.factors.nominal();
    let mut rig = BearingRig::new(parameters, case.fidelity, generator(settings.seed, stream).random())?;
    let controller =
        real_time_controller::<6, 2, 2>(nominal, design.state_feedback.as_ref(), design.observer_gain.as_ref())?;
    let mut controller = ObserverLoop { controller, state: youla_rt::State::at_rest() };
    let alpha = excitation(&settings.experiments.excitation, samples, nominal.time(), settings.seed, stream + 1)?;
    Ok(run_experiment(&mut rig, &mut controller, alpha.as_ref(), &parameters.safety)?)
}

fn data<'a>(
    settings: &'a PaperSettings,
    design: &'a Design,
    start: Bearing,
    [estimation, verification]: [&ExperimentRecord; 2],
    settle: usize,
    turning: bool,
) -> Result<Data<'a>> {
    let signals = design.factors.signals(estimation.u_applied.as_ref(), estimation.y.as_ref())?;
    let later = |signal: MatRef<'_, f64>| signal.subrows(settle, signal.nrows() - settle).to_owned();
    let clean = |signal: MatRef<'_, f64>| -> Result<Mat<f64>> {
        let later = later(signal);
        if !turning {
            return Ok(later);
        }
        let hz = settings.experiments.rpm / 60.0;
        Ok(without_harmonics(later.as_ref(), hz, settings.experiments.harmonics, estimation.time)?)
    };
    Ok(Data {
        settings,
        design,
        start,
        u: clean(estimation.u_applied.as_ref())?,
        y: clean(estimation.y.as_ref())?,
        signals: YoulaSignals::new(clean(signals.alpha())?.as_ref(), clean(signals.beta())?.as_ref())?,
        verification_u: later(verification.u_applied.as_ref()),
        verification_y: later(verification.y.as_ref()),
        initial_state: if settle > 0 { InitialState::Estimated } else { settings.pem.initial_state },
    })
}

impl Data<'_> {
    fn time(&self) -> Discrete {
        self.design.factors.nominal().time()
    }

    fn hansen(&self) -> Result<HansenModel, String> {
        let options = SubspaceOptions { initial_state: self.initial_state, ..self.settings.hansen.clone() };
        hansen(&self.design.factors, std::slice::from_ref(&self.signals), &options).map_err(text)
    }

    fn pem(&self, factor: f64) -> Result<GreyBoxModel, String> {
        let start = self.start.degraded(factor, 1.0).map_err(text)?;
        let experiment = [subspace::Experiment::new(self.u.as_ref(), self.y.as_ref())];
        let options = GreyBoxOptions { initial_state: self.initial_state, ..self.settings.pem.clone() };
        greybox(
            &Problem::new(&BearingStructure, &experiment, self.time()),
            &BearingStructure::parameters(&start),
            &options,
        )
        .map_err(text)
    }

    /// From the projection of G(S), or that from the nominal model, `single`, where its criterion is lower.
    fn hansen_pem(&self, found: HansenModel, single: &Result<GreyBoxModel, String>) -> Result<GreyBoxModel, String> {
        let experiment = [subspace::Experiment::new(self.u.as_ref(), self.y.as_ref())];
        let signals = std::slice::from_ref(&self.signals);
        let pem = GreyBoxOptions { initial_state: self.initial_state, ..self.settings.pem.clone() };
        let options = HansenPemOptions { pem, ..Default::default() };
        let factors = &self.design.factors;
        let projected = pem_from_hansen(
            found,
            SchemeData { factors, signals },
            &Problem::new(&BearingStructure, &experiment, self.time()),
            None,
            &options,
        );
        lower(projected.map(|found| found.model).map_err(text), single.clone())
    }

    /// The prediction-error method from all starts, those that lead to a model; `single` is that from the nominal model.
    fn starts(&self, single: &Result<GreyBoxModel, String>) -> Vec<(Start, GreyBoxModel)> {
        let run = |factor: &f64| {
            let found = if *factor == 1.0 { single.clone() } else { self.pem(*factor) }.ok()?;
            let (fit, _) = self.predict(&found.model).ok()?;
            let start = Start { factor: *factor, cost: found.cost, fit, steps: found.iterations, stop: found.stop };
            Some((start, found))
        };
        self.settings.experiments.start_factors.par_iter().filter_map(run).collect()
    }

    /// Fit and prediction on the verification record; no prediction and minus infinity for a model that diverges.
    fn predict(&self, model: &StateSpace<Discrete>) -> Result<([f64; 2], Mat<f64>)> {
        let (u, y): (MatRef<'_, f64>, MatRef<'_, f64>) = (self.verification_u.as_ref(), self.verification_y.as_ref());
        match predict_open_loop(model, u, y) {
            Ok(predicted) => {
                let percent = fit(y, predicted.as_ref())?;
                Ok(([percent[0], percent[1]], predicted))
            }
            Err(youla::Error::Diverged { .. }) => Ok(([f64::NEG_INFINITY; 2], Mat::zeros(0, 2))),
            Err(e) => Err(e.into()),
        }
    }

    fn judge(
        &self,
        method: StudyMethod,
        model: Result<StateSpace<Discrete>, String>,
        seconds: f64,
    ) -> Result<ExperimentModel> {
        let mut judged = ExperimentModel {
            method,
            fit: [f64::NAN; 2],
            predicted: Mat::zeros(0, 2),
            stable: false,
            stabilised: false,
            modes: Vec::new(),
            seconds,
            model,
        };
        if let Ok(model) = &judged.model {
            (judged.fit, judged.predicted) = self.predict(model)?;
            judged.stable = model.is_stable()?;
            judged.stabilised = certify(model, &self.design.factors.controller()?)?.stable;
            judged.modes = model.modes()?;
        }
        Ok(judged)
    }

    /// beta of the verification record, measured and predicted from alpha alone.
    fn beta(&self, found: &HansenModel) -> Result<[Mat<f64>; 2]> {
        let signals = self.design.factors.signals(self.verification_u.as_ref(), self.verification_y.as_ref())?;
        let s = &found.deviation.model;
        let predicted = simulate(s, signals.alpha(), &vec![0.0; s.order()])?;
        Ok([signals.beta().to_owned(), predicted])
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}
