//! Frequency responses of a run: every model, and the indirect non-parametric one where the excitation is known.

use crate::method::Method;
use crate::settings::FrequencySettings;
use crate::stages::context::RunContext;
use crate::stages::signals::DeviationSignals;
use crate::stages::validate::Validation;
use crate::{Error, Result};
use std::f64::consts::TAU;
use youla::lti::{Discrete, FrequencyResponse, StateSpace, frequency_response};
use youla::signal::LoopRecord;
use youla::signal::{ExcitedRecord, IndirectResponse, Welch, indirect_response};
use youla::{Mat, MatRef};

/// Window of the indirect response, samples, unless stated: 5 lines below the lowest frequency of the curves, a 300th of Nyquist.
/// Chosen, not measured.
const LONGEST_WINDOW: usize = 4096;
/// A record has at least so many windows side by side, seven half overlapping: of one alone the coherence is 1, whatever the noise.
const WINDOWS_OF_A_RECORD: usize = 4;
/// The least window that settings may state, samples.
const SHORTEST_WINDOW: usize = 4;

/// The indirect response `S_dy S_du^-1` averaged over all estimation records, `None` where no excitation is known.
///
/// The excitation d is the signal added at the plant input or injected as alpha where it acts alone; where references move
/// too, it is the image of all of them in alpha, so that none is mistaken for noise.
///
/// The error is the reason why there is none: a record shorter than a window, an excitation without power at a frequency.
pub(crate) fn indirect(run: RunContext<'_>, signals: Option<&DeviationSignals>) -> Option<Result<IndirectResponse>> {
    let settings = &run.settings.frequency_response;
    let records = &run.records.estimation;
    let at_rest = |r: &LoopRecord| r.reference().is_none_or(is_constant);
    let excitations: Vec<Mat<f64>> = records
        .iter()
        .enumerate()
        .filter_map(|(k, r)| {
            let alone = [r.input_excitation(), r.alpha()].into_iter().flatten().collect::<Vec<_>>();
            match alone[..] {
                [d] if at_rest(r) => Some(d.to_owned()),
                _ => signals?.expected_alpha.get(k).cloned(),
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
            let (u, y) = (r.u().subrows(dropped, d.nrows()), r.y().subrows(dropped, d.nrows()));
            ExcitedRecord { d: d.as_ref(), u, y }
        })
        .collect();
    let shortest = experiments.iter().map(|e| e.d.nrows()).min().unwrap_or(0);
    let window = settings.window.unwrap_or(LONGEST_WINDOW.min(shortest / WINDOWS_OF_A_RECORD).max(SHORTEST_WINDOW));
    let options = Welch { window, ..Welch::default() };
    Some(indirect_response(&experiments, run.records.time, &options).map_err(Error::from))
}

pub(crate) fn is_constant(signals: MatRef<'_, f64>) -> bool {
    signals.col_iter().all(|c| c.iter().all(|v| *v == c[0]))
}

/// Responses of all models on the given frequencies in Hz.
///
/// # Errors
/// As [`frequency_response`].
pub(crate) fn model_responses(validation: &Validation, hz: &[f64]) -> Result<Vec<(Method, FrequencyResponse)>> {
    let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
    let response = |v: &crate::stages::validate::ModelValidation| Ok((v.method, frequency_response(&v.model, &omega)?));
    validation.models.iter().map(response).collect()
}

/// Highest frequency of the curves, over the Nyquist frequency: at it some responses are not defined.
const HIGHEST: f64 = 0.999;

/// Refuses a lowest frequency that leaves no room below Nyquist.
pub(crate) fn check_grid(settings: &FrequencySettings, time: Discrete) -> Result<()> {
    let nyquist = 0.5 / time.ts();
    match settings.from_hz {
        Some(from) if from >= HIGHEST * nyquist => {
            let what = format!("[frequency_response] from_hz, with a Nyquist frequency of {nyquist:.6} Hz,");
            Err(Error::Method(youla::Error::OutOfRange { what, value: from, must: "below 0.999 of it" }))
        }
        _ => Ok(()),
    }
}

/// Frequencies of the logarithmic grid to a decade: below the width of a line in a figure (chosen, not measured).
const PER_DECADE: f64 = 160.0;

/// Modes with less damping have frequencies of their own.
/// A resonance with more damping is wider than 20 % of its frequency, several points of the grid. Chosen, not measured.
const LIGHT: f64 = 0.1;

/// Angles in degrees of the response of a mode, seen from its peak, at which it is evaluated.
/// From -15 to 15 degrees the response and its chords differ by less than 1 % of the peak, `1 - cos(7.5 degrees)`.
const AROUND_A_PEAK: [f64; 13] = [-80.0, -70.0, -58.0, -45.0, -30.0, -15.0, 0.0, 15.0, 30.0, 45.0, 58.0, 70.0, 80.0];

/// Frequencies in Hz, rising: logarithmic from the lowest one asked for (or two decades and a half below Nyquist, or the lowest `valid`
/// frequency of the recommended model) up to just below Nyquist, and around each lightly damped mode of the models, at `f (1 + zeta tan(angle))`:
/// between the points of the logarithmic grid a peak would be cut off.
///
/// # Errors
/// [`youla::Error::NoConvergence`] of the eigenvalues.
pub(crate) fn grid(
    settings: &FrequencySettings,
    models: &[&StateSpace<Discrete>],
    time: Discrete,
    valid: Option<f64>,
) -> Result<Vec<f64>> {
    let nyquist = 0.5 / time.ts();
    let lowest = valid.unwrap_or(f64::INFINITY).min(nyquist / 300.0);
    let (from, to) = (settings.from_hz.unwrap_or(lowest), HIGHEST * nyquist);
    let last = (PER_DECADE * (to / from).log10()).ceil() as usize;
    let mut hz: Vec<f64> = (0..=last).map(|k| from * (to / from).powf(k as f64 / last as f64)).collect();
    for model in models {
        for mode in model.modes()?.into_iter().filter(|m| m.pole.im != 0.0 && m.zeta.abs() < LIGHT) {
            let width = mode.zeta.abs().max(1e-5);
            hz.extend(AROUND_A_PEAK.iter().map(|angle| mode.hz * (1.0 + width * angle.to_radians().tan())));
        }
    }
    hz.retain(|f| (from..=to).contains(f));
    hz.sort_by(f64::total_cmp);
    hz.dedup_by(|b, a| *b - *a < 1e-9 * *a);
    Ok(hz)
}

/// All pairs of output and input, by output.
pub(crate) fn ports(outputs: usize, inputs: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..outputs).flat_map(move |i| (0..inputs).map(move |j| (i, j)))
}
