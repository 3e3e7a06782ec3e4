//! Frequency responses of a run: every model, and the indirect non-parametric one where the excitation is known.

use super::pipeline::Identification;
use super::records::LoopRecord;
use super::settings::FrequencySettings;
use super::verdict::Method;
use crate::lti::{Discrete, FrequencyResponse, frequency_response};
use crate::record::{ExcitedRecord, IndirectResponse, Welch, indirect_response};
use crate::{Error, Mat, Result};
use std::f64::consts::TAU;

/// Responses on one grid.
#[derive(Debug, Clone)]
pub(super) struct ModelResponses {
    /// Grid, Hz.
    pub hz: Vec<f64>,
    /// One entry per model.
    pub models: Vec<(Method, FrequencyResponse)>,
}

/// The indirect response `S_dy S_du^-1` averaged over all estimation records, `None` where no excitation is known.
///
/// The excitation d is the signal added at the plant input or injected as alpha where it acts alone; where references move
/// too, it is the image of all of them in alpha, so that none is mistaken for noise.
///
/// The reason where it cannot be had: a record shorter than a window, an excitation without power at a frequency.
pub(super) fn indirect(found: &Identification) -> Option<Result<IndirectResponse>> {
    let settings = &found.settings.frequency_response;
    let records = &found.records.estimation;
    let at_rest = |r: &LoopRecord| r.reference.as_ref().is_none_or(is_constant);
    let excitations: Vec<Mat<f64>> = records
        .iter()
        .enumerate()
        .filter_map(|(k, r)| {
            let alone = [&r.input_excitation, &r.alpha].into_iter().flatten().collect::<Vec<_>>();
            match alone[..] {
                [d] if at_rest(r) => Some(d.clone()),
                _ => found.signals.expected_alpha.get(k).cloned(),
            }
        })
        .collect();
    if excitations.len() < records.len() {
        return None;
    }
    // The image in alpha starts after the settling samples.
    let experiments: Vec<_> = records
        .iter()
        .zip(&excitations)
        .map(|(r, d)| {
            let dropped = r.samples() - d.nrows();
            let (u, y) = (r.u.subrows(dropped, d.nrows()), r.y.subrows(dropped, d.nrows()));
            ExcitedRecord { d: d.as_ref(), u, y }
        })
        .collect();
    let options = Welch { window: settings.window, overlap: settings.overlap, ..Welch::default() };
    Some(indirect_response(&experiments, found.records.time, &options))
}

fn is_constant(signals: &Mat<f64>) -> bool {
    signals.col_iter().all(|c| c.iter().all(|v| *v == c[0]))
}

/// Responses of all models on the given frequencies in Hz.
///
/// # Errors
/// As [`frequency_response`].
pub(super) fn model_responses(found: &Identification, hz: Vec<f64>) -> Result<ModelResponses> {
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let response = |v: &super::verdict::ModelVerdict| Ok((v.method, frequency_response(&v.model, &omega)?));
    let models = found.verdict.models.iter().map(response).collect::<Result<_>>()?;
    Ok(ModelResponses { hz, models })
}

/// Refuses a lowest frequency that leaves no room below Nyquist.
pub(super) fn check_grid(settings: &FrequencySettings, time: Discrete) -> Result<()> {
    let nyquist = 0.5 / time.ts();
    match settings.from_hz {
        Some(from) if from >= nyquist => {
            let what = format!("[frequency_response] from_hz, with a Nyquist frequency of {nyquist:.6} Hz,");
            Err(Error::OutOfRange { what, value: from, must: "below it" })
        }
        _ => Ok(()),
    }
}

/// Frequencies in Hz, logarithmic from the lowest one asked for (or two decades and a half below Nyquist) up to just below
/// Nyquist.
pub(super) fn log_grid(found: &Identification) -> Vec<f64> {
    let settings = &found.settings.frequency_response;
    let nyquist = 0.5 / found.records.time.ts();
    let from = settings.from_hz.unwrap_or(nyquist / 300.0);
    let (last, ratio) = (settings.points.max(2) - 1, 0.999 * nyquist / from);
    (0..=last).map(|k| from * ratio.powf(k as f64 / last as f64)).collect()
}

/// Magnitude in dB.
pub(super) fn decibel(magnitude: f64) -> f64 {
    20.0 * magnitude.log10()
}
