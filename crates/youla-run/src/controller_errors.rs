//! How wrong may the description of the controller be? S and G(S) are identified again from alpha and beta that are computed with
//! a wrong one, and modes and fit are compared.
//!
//! All variants, and the one without an error that they are compared with, use the factors of an arbitrary controller
//! ([`youla::factor::CoprimeFactors::stacked`]): the choice of factors alone changes an estimate a little.

use super::certificate::CertificateSettings;
use super::factorise::factorise;
use super::models::Controller;
use super::pipeline::Identification;
use super::records::{LoopRecord, RunRecords};
use super::settings::{Construction, FactorSettings};
use super::signals::deviation_signals;
use super::verdict::verify_record;
use crate::Result;
use faer::Scale;
use rayon::prelude::*;
use serde_json::{Value, json};
use youla::Mat;
use youla::identify::hansen::{HansenModel, deviation_data};
use youla::identify::innovation_form::hansen_structured;
use youla::identify::subspace::{Stability, SubspaceOptions, UncertaintyOptions};
use youla::linalg::eye;
use youla::lti::{Mode, StateSpace};
use youla_report::{data as draw, with_minus};

/// Modes with at least this damping are left out of the comparison.
const WELL_DAMPED: f64 = 0.3;

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
            ControllerError::Delay => "one sample of delay left out".into(),
            ControllerError::Gain(g) if g > 0.0 => format!("gain too large by {:.0} %", 100.0 * g),
            ControllerError::Gain(g) => format!("gain too small by {:.0} %", -100.0 * g),
            ControllerError::Saturation(part) => format!("u cut at {:.0} % of its largest value", 100.0 * part),
            ControllerError::InitialState => "initial state of the observer unknown, nothing dropped".into(),
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
pub(super) fn controller_errors(
    found: &Identification,
    settings: &CertificateSettings,
) -> Result<Vec<ControllerErrorEffect>> {
    let plain = identified(found, ControllerError::None)?;
    let modes: Vec<Mode> = plain.plant.modes()?.into_iter().filter(light).collect();
    let errors = [
        ControllerError::None,
        ControllerError::Delay,
        ControllerError::Gain(settings.gain_error),
        ControllerError::Gain(-settings.gain_error),
        ControllerError::Saturation(settings.saturation),
        ControllerError::InitialState,
    ];
    let effect = |error: &ControllerError| {
        let result = match error {
            ControllerError::None => Ok(plain.clone()),
            error => identified(found, *error),
        };
        let outcome = result.and_then(|result| changed(found, &modes, &result)).map_err(|e| e.to_string());
        ControllerErrorEffect { error: *error, outcome }
    };
    Ok(errors.par_iter().map(effect).collect())
}

fn light(mode: &Mode) -> bool {
    mode.pole.im > 0.0 && mode.zeta < WELL_DAMPED
}

/// S and G(S) with an error in the description of the controller; an unstable S is a result here.
fn identified(found: &Identification, error: ControllerError) -> Result<HansenModel> {
    let (settings, time) = (&found.settings, found.records.time);
    let controller = &found.factorisation.controller;
    let described = match error {
        ControllerError::Delay => {
            let m = controller.outputs();
            let late = StateSpace::new(Mat::zeros(m, m), eye(m), eye(m), Mat::zeros(m, m), time)?;
            controller.then(&late)?
        }
        ControllerError::Gain(g) => controller.map_output(&(Scale(1.0 + g) * eye(controller.outputs()))),
        _ => controller.clone(),
    };
    let records = RunRecords {
        estimation: found.records.estimation.iter().map(|r| altered(r, error, found.signals.settle)).collect(),
        ..found.records.clone()
    };
    let factors = FactorSettings { construction: Construction::Stacked, ..settings.factors };
    let factors = factorise(&found.factorisation.nominal, &Controller::System(described), &records, &factors)?.factors;
    let settle = match error {
        ControllerError::InitialState => Some(0),
        _ => Some(found.signals.settle),
    };
    let signals = deviation_signals(&factors, &records.estimation, settle)?;
    let lines = records.disturbances(signals.settle);
    let uncertainty = UncertaintyOptions::default();
    let options = SubspaceOptions { uncertainty, stability: Stability::Allow, ..settings.hansen.clone() };
    let data = deviation_data(&factors, &signals.experiments, &lines, &options)?;
    Ok(hansen_structured(&factors, &data, &options, &settings.deviation.options())?)
}

/// The record as an error leaves it.
fn altered(record: &LoopRecord, error: ControllerError, settle: usize) -> LoopRecord {
    let mut record = record.clone();
    match error {
        ControllerError::Saturation(part) => {
            for column in record.u.as_mut().col_iter_mut() {
                let limit = part * column.norm_max();
                column.iter_mut().for_each(|u| *u = u.clamp(-limit, limit));
            }
        }
        ControllerError::InitialState => {
            let skip = settle.max(record.samples() / 10);
            let later = |m: &Mat<f64>| m.subrows(skip, m.nrows() - skip).to_owned();
            let both = |m: &Option<Mat<f64>>| m.as_ref().map(later);
            record = LoopRecord {
                u: later(&record.u),
                y: later(&record.y),
                input_excitation: both(&record.input_excitation),
                reference: both(&record.reference),
                alpha: both(&record.alpha),
                disturbance: both(&record.disturbance),
                ..record
            };
        }
        _ => {}
    }
    record
}

fn changed(found: &Identification, modes: &[Mode], result: &HansenModel) -> Result<Changed> {
    let HansenModel { plant, deviation, .. } = result;
    let own = plant.modes()?;
    let nearest = |mode: &Mode| {
        let distance = |other: &&Mode| (other.pole - mode.pole).norm();
        own.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or([f64::NAN; 2], |m| [m.hz, m.zeta])
    };
    let fit = found
        .records
        .verification
        .iter()
        .map(|r| Ok(verify_record(found, plant, None, r)?.fit))
        .collect::<Result<_>>()?;
    Ok(Changed {
        modes: modes.iter().map(|m| [m.hz, m.zeta]).collect(),
        changed: modes.iter().map(nearest).collect(),
        fit,
        deviation_fit: deviation.fit.percent.clone(),
        deviation_radius: deviation.model.poles()?.iter().map(|p| p.norm()).fold(0.0, f64::max),
        stable: youla::validate::certify(plant, &found.factorisation.controller)?.stable,
    })
}

impl ControllerErrorEffect {
    pub(super) fn json(&self) -> Value {
        let mut entry = json!({"error": self.error.key(), "label": self.error.label()});
        match &self.outcome {
            Ok(c) => {
                let mode = |(m, c): (&[f64; 2], &[f64; 2])| json!({"hz": c[0], "zeta": c[1], "without": {"hz": m[0], "zeta": m[1]}});
                entry["modes"] = c.modes.iter().zip(&c.changed).map(mode).collect::<Vec<_>>().into();
                entry["fit"] = json!(c.fit);
                entry["deviation_fit"] = json!(c.deviation_fit);
                entry["deviation_radius"] = json!(c.deviation_radius);
                entry["stabilised_by_controller"] = json!(c.stable);
            }
            Err(reason) => entry["refused"] = json!(reason),
        }
        entry
    }
}

/// For the report.
pub(super) fn table(effects: &[ControllerErrorEffect]) -> Option<draw::EvidenceTable> {
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
        title: "How wrong may the controller be described?".into(),
        text: "S was identified again with alpha and beta from a description of the controller that is wrong in one point.".into(),
        columns,
        rows: effects.iter().map(row).collect(),
        caption: "Lightly damped modes of G(S), below the first row their change. Fit of S on alpha and beta, of G(S) on the verification records, means over channels.".into(),
    })
}
