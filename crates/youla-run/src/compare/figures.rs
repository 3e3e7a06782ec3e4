//! Responses, poles and predictions of the runs on common axes.

use super::run::FinishedRun;
use crate::Result;
use crate::page::decibels::{decibel, drawn};
use std::f64::consts::{PI, TAU};
use youla::lti::{FrequencyResponse, TimeDomain, frequency_response};
use youla_report::data;

/// Responses of all models on the frequencies of all runs, with the bounds that each run found. Beyond the Nyquist frequency of a
/// run there is nothing.
pub(super) fn frequency(runs: &[FinishedRun], model: &str) -> Result<data::DrawnResponses> {
    let hz = grid(runs);
    let mut all = data::DrawnResponses { hz: hz.clone(), ..data::DrawnResponses::default() };
    for run in runs {
        let nyquist = PI / run.model.system.time().ts();
        let omega: Vec<f64> = hz.iter().map(|f| TAU * f).filter(|w| *w < nyquist).collect();
        let response = frequency_response(&run.model.system, &omega)?;
        all.models.extend(entries(run, &response, hz.len()));
        all.bands.extend(bands(run, model, &hz));
        if response.at(0).nrows().min(response.at(0).ncols()) > 1 {
            all.singular.extend(singular(run, &response, hz.len())?);
        }
    }
    Ok(all)
}

/// All frequencies of all runs.
fn grid(runs: &[FinishedRun]) -> Vec<f64> {
    let of = |r: &FinishedRun| r.report.frequency.as_ref().map(|f| f.hz.clone()).unwrap_or_default();
    let mut hz: Vec<f64> = runs.iter().flat_map(of).collect();
    hz.sort_by(f64::total_cmp);
    hz.dedup_by(|b, a| *b - *a < 1e-6 * *a);
    hz
}

fn entries(run: &FinishedRun, response: &FrequencyResponse, length: usize) -> Vec<data::ModelResponse> {
    let mut all = drawn(&run.key, response);
    for entry in &mut all {
        entry.magnitude_db.resize(length, f64::NAN);
        entry.phase_deg.resize(length, f64::NAN);
    }
    all
}

fn singular(run: &FinishedRun, response: &FrequencyResponse, length: usize) -> Result<Vec<data::SingularValue>> {
    let gains = response.gains()?;
    let count = gains.first().map_or(0, Vec::len);
    let beyond = std::iter::repeat_n(f64::NAN, length - gains.len());
    let one = |place: usize| data::SingularValue {
        method: run.key.clone(),
        place,
        value_db: gains.iter().map(|at| decibel(at[place])).chain(beyond.clone()).collect(),
    };
    Ok((0..count).map(one).collect())
}

/// The bounds of a run on the common frequencies, in between by lines in dB over the logarithm of frequency.
fn bands(run: &FinishedRun, model: &str, hz: &[f64]) -> Vec<data::DrawnBand> {
    let Some(own) = &run.report.frequency else { return Vec::new() };
    let of = |band: &data::DrawnBand| data::DrawnBand {
        method: run.key.clone(),
        low_db: hz.iter().map(|f| between(&own.hz, &band.low_db, *f)).collect(),
        high_db: hz.iter().map(|f| between(&own.hz, &band.high_db, *f)).collect(),
        region: Vec::new(),
        ..band.clone()
    };
    own.bands.iter().filter(|b| b.method == model).map(of).collect()
}

fn between(hz: &[f64], values: &[f64], at: f64) -> f64 {
    // Frequencies of a report have seven digits.
    let next = hz.partition_point(|f| *f < at * (1.0 - 1e-6));
    match next {
        k if k >= hz.len() => f64::NAN,
        k if hz[k] <= at * (1.0 + 1e-6) => values[k],
        0 => f64::NAN,
        k => values[k - 1] + (values[k] - values[k - 1]) * (at / hz[k - 1]).ln() / (hz[k] / hz[k - 1]).ln(),
    }
}

/// Poles and zeros in z, or, where sample times differ, in s.
pub(super) fn poles(run: &FinishedRun, in_z: bool) -> Result<data::Poles> {
    let g = &run.model.system;
    let place = |z: &youla::c64| {
        let at = if in_z { *z } else { g.time().continuous_pole(*z) };
        [at.re, at.im]
    };
    let zeros = if in_z && g.inputs() == g.outputs() { g.zeros()? } else { Vec::new() };
    let poles = g.poles()?.iter().map(place).filter(|p| p[0].is_finite()).collect();
    Ok(data::Poles { method: run.key.clone(), poles, zeros: zeros.iter().map(place).collect() })
}

/// The verification records of the first run, with the predictions of every run that was verified on the same samples.
pub(super) fn verification(runs: &[FinishedRun], model: &str) -> Vec<data::Verification> {
    let of_record = |record: &data::Verification| {
        let mut drawn = record.clone();
        for output in &mut drawn.outputs {
            output.predictions = runs.iter().filter_map(|r| prediction(r, model, record, output)).collect();
        }
        drawn
    };
    runs[0].report.verification.iter().map(of_record).collect()
}

fn prediction(
    run: &FinishedRun,
    model: &str,
    record: &data::Verification,
    output: &data::VerifiedOutput,
) -> Option<data::DrawnPrediction> {
    let same = |v: &&data::Verification| v.record == record.record && v.clock == record.clock;
    let found = run.report.verification.iter().find(same)?;
    let of_output = found.outputs.iter().find(|o| o.output == output.output && o.measured == output.measured)?;
    let own = of_output.predictions.iter().find(|p| p.method == model)?;
    Some(data::DrawnPrediction { method: run.key.clone(), ..own.clone() })
}
