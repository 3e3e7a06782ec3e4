//! How wrong may the description of the controller be? S and G(S) are identified again from alpha and beta that are computed with
//! a wrong one, and modes and fit are compared.
//!
//! All variants, and the one without an error that they are compared with, use the factors of an arbitrary controller
//! ([`youla::factor::CoprimeFactors::stacked`]): the choice of factors alone changes an estimate a little.

use crate::Result;
use crate::records::{LoopRecord, RunRecords};
use crate::settings::RealisedController;
use crate::stages::context::{RunContext, SchemeContext};
use crate::stages::factors::factorise;
use crate::stages::signals::deviation_signals;
use crate::stages::validate::verify_record;
use crate::summary::entries::{OrRefused, finite, finite_all};
use faer::Scale;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use youla::Mat;
use youla::identify::hansen::{HansenModel, HansenOptions, hansen};
use youla::identify::subspace::{Stability, SubspaceOptions, UncertaintyOptions};
use youla::linalg::eye;
use youla::lti::{Mode, StateSpace};
use youla_report::{data as draw, with_minus};

/// Modes with at least this damping are left out of the comparison.
/// More damping leaves no peak from which frequency and damping could be read. Chosen, not measured.
const WELL_DAMPED: f64 = 0.3;

/// Relative error of the gain that is tried, both ways: the tolerance of an amplifier (chosen, not measured).
const GAIN_ERROR: f64 = 0.05;

/// Limit of u that is tried, as a part of its largest value in each record and channel: clips peaks only (chosen, not measured).
const SATURATION: f64 = 0.9;

/// What is wrong with the description of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ControllerError {
    /// Nothing.
    None,
    /// The controller is one sample later than described.
    Delay,
    /// Its gain is this much larger than described, relative.
    Gain(f64),
    /// u of the log is cut at this part of its largest value.
    Saturation(f64),
    /// The filter of alpha and beta starts from rest in the middle of the log, and no sample is dropped.
    InitialState,
}

impl ControllerError {
    /// In words.
    pub fn label(self) -> String {
        match self {
            ControllerError::None => "none".into(),
            ControllerError::Delay => "one sample of delay omitted".into(),
            ControllerError::Gain(g) if g > 0.0 => format!("gain too large by {:.0} %", 100.0 * g),
            ControllerError::Gain(g) => format!("gain too small by {:.0} %", -100.0 * g),
            ControllerError::Saturation(part) => format!("u cut at {:.0} % of its largest value", 100.0 * part),
            ControllerError::InitialState => "unknown initial state of the observer, no samples discarded".into(),
        }
    }

    fn key(self) -> &'static str {
        match self {
            ControllerError::None => "none",
            ControllerError::Delay => "delay",
            ControllerError::Gain(g) if g > 0.0 => "gain_high",
            ControllerError::Gain(_) => "gain_low",
            ControllerError::Saturation(_) => "saturation",
            ControllerError::InitialState => "initial_state",
        }
    }
}

/// What an error does to the result.
#[derive(Debug, Clone)]
pub struct ControllerErrorEffect {
    /// What is wrong.
    pub error: ControllerError,
    /// The modes of G(S) that are lightly damped, each with its change against the run without the error, or why there is no model.
    pub outcome: Result<Changed, String>,
}

/// G(S) from a wrong description.
#[derive(Debug, Clone, PartialEq)]
pub struct Changed {
    /// Hz and damping ratio of the modes without the error.
    pub modes: Vec<[f64; 2]>,
    /// The same of the nearest modes with it.
    pub changed: Vec<[f64; 2]>,
    /// Fit of S on alpha and beta, per channel, percent.
    pub deviation_fit: Vec<f64>,
    /// Largest magnitude of a pole of S: from 1 on, S is unstable.
    pub deviation_radius: f64,
    /// Fit of G(S) per verification record and output, percent.
    pub fit: Vec<Vec<f64>>,
    /// Whether the controller that ran stabilises G(S).
    pub stable: bool,
}

/// Mean of fits.
fn mean<'a>(fits: impl Iterator<Item = &'a f64>) -> f64 {
    let all: Vec<f64> = fits.copied().collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// Identifies once for each error; errors in parallel.
///
/// # Errors
/// Those of the run without an error.
pub(crate) fn controller_errors(context: SchemeContext<'_>) -> Result<Vec<ControllerErrorEffect>> {
    let (run, settle) = (context.run, context.signals.settle);
    let plain = identified(run, settle, ControllerError::None)?;
    let modes: Vec<Mode> = plain.plant.modes()?.into_iter().filter(light).collect();
    let errors = [
        ControllerError::None,
        ControllerError::Delay,
        ControllerError::Gain(GAIN_ERROR),
        ControllerError::Gain(-GAIN_ERROR),
        ControllerError::Saturation(SATURATION),
        ControllerError::InitialState,
    ];
    let effect = |error: &ControllerError| {
        let result = match error {
            ControllerError::None => Ok(plain.clone()),
            error => identified(run, settle, *error),
        };
        let outcome = result.and_then(|result| changed(run, &modes, &result)).map_err(|e| e.to_string());
        ControllerErrorEffect { error: *error, outcome }
    };
    Ok(errors.par_iter().map(effect).collect())
}

fn light(mode: &Mode) -> bool {
    mode.pole.im > 0.0 && mode.zeta < WELL_DAMPED
}

/// S and G(S) with an error in the description of the controller; an unstable S is a result here.
fn identified(run: RunContext<'_>, settle: usize, error: ControllerError) -> Result<HansenModel> {
    let (settings, time) = (run.settings, run.records.time);
    let controller = &run.declared.controller;
    let described = match error {
        ControllerError::Delay => {
            let m = controller.outputs();
            let late = StateSpace::new(Mat::zeros(m, m), eye(m), eye(m), Mat::zeros(m, m), time)?;
            controller.then(&late)?
        }
        ControllerError::Gain(g) => controller.map_output(&(Scale(1.0 + g) * eye(controller.outputs()))),
        _ => controller.clone(),
    };
    let records = altered(run.records, error, settle);
    let described = RealisedController::System(described);
    let factors = factorise(&run.declared.nominal, &described, &records, &settings.factors)?.factors;
    let dropped = if error == ControllerError::InitialState { 0 } else { settle };
    let signals = deviation_signals(&factors, &records.estimation, Some(dropped))?;
    let uncertainty = UncertaintyOptions::default();
    let subspace = SubspaceOptions { uncertainty, stability: Stability::Allow, ..settings.hansen.clone() };
    let options = HansenOptions { subspace, noise: settings.deviation.noise() };
    Ok(hansen(&factors, &signals.experiments, &options)?)
}

/// The estimation records as an error leaves them; errors of the controller alone leave them as they are.
fn altered(records: &RunRecords, error: ControllerError, settle: usize) -> Cow<'_, RunRecords> {
    let alter: &dyn Fn(&LoopRecord) -> LoopRecord = match error {
        ControllerError::Saturation(part) => &move |record| saturated(record, part),
        ControllerError::InitialState => &move |record| begun_late(record, settle),
        ControllerError::None | ControllerError::Delay | ControllerError::Gain(_) => return Cow::Borrowed(records),
    };
    Cow::Owned(RunRecords {
        time: records.time,
        inputs: records.inputs.clone(),
        outputs: records.outputs.clone(),
        estimation: records.estimation.iter().map(alter).collect(),
        verification: Vec::new(),
        sources: Vec::new(),
        segments: Vec::new(),
        measured: None,
        true_plant: None,
    })
}

/// u cut at a part of its largest value.
fn saturated(record: &LoopRecord, part: f64) -> LoopRecord {
    let mut record = record.clone();
    for column in record.u.as_mut().col_iter_mut() {
        let limit = part * column.norm_max();
        column.iter_mut().for_each(|u| *u = u.clamp(-limit, limit));
    }
    record
}

/// The record without its first tenth, at least the samples in which the filter settles.
fn begun_late(record: &LoopRecord, settle: usize) -> LoopRecord {
    let skip = settle.max(record.samples() / 10);
    let later = |m: &Mat<f64>| m.subrows(skip, m.nrows() - skip).to_owned();
    let both = |m: &Option<Mat<f64>>| m.as_ref().map(later);
    LoopRecord {
        name: record.name.clone(),
        time: record.time,
        u: later(&record.u),
        y: later(&record.y),
        input_excitation: both(&record.input_excitation),
        reference: both(&record.reference),
        alpha: both(&record.alpha),
        disturbance: both(&record.disturbance),
    }
}

fn changed(run: RunContext<'_>, modes: &[Mode], result: &HansenModel) -> Result<Changed> {
    let HansenModel { plant, deviation, .. } = result;
    let own = plant.modes()?;
    let nearest = |mode: &Mode| {
        let distance = |other: &&Mode| (other.pole - mode.pole).norm();
        own.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or([f64::NAN; 2], |m| [m.hz, m.zeta])
    };
    let fit =
        run.records.verification.iter().map(|r| Ok(verify_record(run, plant, None, r)?.fit)).collect::<Result<_>>()?;
    Ok(Changed {
        modes: modes.iter().map(|m| [m.hz, m.zeta]).collect(),
        changed: modes.iter().map(nearest).collect(),
        fit,
        deviation_fit: deviation.fit.percent.clone(),
        deviation_radius: deviation.model.poles()?.iter().map(|p| p.norm()).fold(0.0, f64::max),
        stable: youla::validate::certify(plant, &run.declared.controller)?.stable,
    })
}

/// The entry of one error in the certificate: its effect, or the reason why there is no model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ControllerErrorEntry {
    /// Key of the error.
    pub error: String,
    /// The error in words.
    pub label: String,
    /// The effect, or the reason.
    #[serde(flatten)]
    pub effect: OrRefused<EffectEntry>,
}

/// G(S) from a wrong description of the controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct EffectEntry {
    /// The lightly damped modes of G(S).
    pub modes: Vec<ChangedMode>,
    /// Fit of G(S) per verification record and output, percent.
    pub fit: Vec<Vec<Option<f64>>>,
    /// Fit of S on alpha and beta per channel, percent.
    pub deviation_fit: Vec<Option<f64>>,
    /// Largest magnitude of a pole of S.
    pub deviation_radius: f64,
    /// Whether the controller that ran stabilises G(S).
    pub stabilised_by_controller: bool,
}

/// A mode with the error, and without it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ChangedMode {
    /// Frequency and damping ratio with the error.
    #[serde(flatten)]
    pub changed: ModePoint,
    /// The same without it.
    pub without: ModePoint,
}

/// Frequency and damping ratio of a mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ModePoint {
    /// Natural frequency, Hz.
    pub hz: Option<f64>,
    /// Damping ratio.
    pub zeta: Option<f64>,
}

impl From<&ControllerErrorEffect> for ControllerErrorEntry {
    fn from(effect: &ControllerErrorEffect) -> Self {
        let point = |[hz, zeta]: [f64; 2]| ModePoint { hz: finite(hz), zeta: finite(zeta) };
        let entry = |c: &Changed| EffectEntry {
            modes: (c.modes.iter().zip(&c.changed))
                .map(|(m, c)| ChangedMode { changed: point(*c), without: point(*m) })
                .collect(),
            fit: c.fit.iter().map(|f| finite_all(f)).collect(),
            deviation_fit: finite_all(&c.deviation_fit),
            deviation_radius: c.deviation_radius,
            stabilised_by_controller: c.stable,
        };
        ControllerErrorEntry {
            error: effect.error.key().to_owned(),
            label: effect.error.label(),
            effect: OrRefused::new(effect.outcome.as_ref().map(entry)),
        }
    }
}

/// For the report.
pub(crate) fn table(effects: &[ControllerErrorEffect]) -> Option<draw::EvidenceTable> {
    let first = effects.first()?.outcome.as_ref().ok()?;
    let percent = |v: f64| if v.is_finite() { with_minus(format!("{v:.1}")) } else { "–".into() };
    let row = |effect: &ControllerErrorEffect| {
        let mut cells = vec![effect.error.label()];
        match &effect.outcome {
            Ok(c) => {
                let mode = |(m, c): (&[f64; 2], &[f64; 2])| match effect.error {
                    ControllerError::None => format!("{:.2} Hz, ζ\u{a0}{:.4}", c[0], c[1]),
                    _ => with_minus(format!("{:+.2} Hz, ζ\u{a0}{:+.4}", c[0] - m[0], c[1] - m[1])),
                };
                cells.extend(c.modes.iter().zip(&c.changed).map(mode));
                cells.push(percent(mean(c.deviation_fit.iter())));
                cells.push(format!("{:.4}", c.deviation_radius));
                cells.push(percent(mean(c.fit.iter().flatten())));
                cells.push(if c.stable { "yes" } else { "no" }.into());
            }
            Err(reason) => cells.push(reason.clone()),
        }
        cells
    };
    let mut columns = vec!["Error".to_owned()];
    columns.extend((1..=first.modes.len()).map(|k| format!("Mode {k}")));
    columns.extend(["Fit of S, %", "Largest pole of S", "Fit of G(S), %", "K stabilises G(S)"].map(String::from));
    Some(draw::EvidenceTable {
        title: "Effect of errors in the description of the controller".into(),
        text: "S was identified again with alpha and beta computed from a controller description that has one error.".into(),
        columns,
        rows: effects.iter().map(row).collect(),
        caption: "First row: lightly damped modes of G(S); rows below: their change. Fits are means over channels: S on alpha and beta, G(S) on the verification records.".into(),
    })
}
