//! Frequency responses of all models: magnitude and phase, principal gains, regions, and the measured ones.

use super::nonparametric;
use crate::Result;
use crate::method::Method;
use crate::page::decibels::{self, bounds_db, decibel, magnitude, phase};
use crate::result::Identification;
use crate::stages::responses::{self, model_responses};
use crate::stages::uncertainty::SystemUncertainty;
use std::f64::consts::TAU;
use youla::Mat;
use youla::c64;
use youla::identify::likelihood::{EntryErrors, LARGEST_IN_BAND};
use youla::lti::FrequencyResponse;
use youla_report::data;

/// Level of the regions that are stated.
const LEVEL: f64 = 0.95;
/// Its quantile of the normal distribution, both sides.
const NORMAL: f64 = 1.959_963_984_540_054;
/// Its quantile of chi-square with two degrees of freedom, for the region of a complex number.
const ELLIPSE: f64 = 5.991_464_547_107_979;

pub(crate) fn drawn(found: &Identification) -> Result<data::DrawnResponses> {
    let responses = model_responses(&found.validation, &found.hz)?;
    let models = responses.iter().flat_map(|(method, r)| decibels::drawn(method.key(), r)).collect();
    let known = responses.iter().filter_map(|(method, _)| Some((*method, found.uncertainty(*method)?)));
    let of_scheme = known.flat_map(|(method, of)| ports(found).map(move |port| band(method, of, port)));
    let bands = recommended(found, &responses).into_iter().chain(of_scheme).collect();
    let singular = singular(found, &responses)?;
    let (indirect, lines) = (indirect(found), nonparametric::drawn(found));
    let deviations = deviations(found)?;
    Ok(data::DrawnResponses { hz: found.hz.clone(), models, indirect, lines, bands, deviations, singular })
}

fn indirect(found: &Identification) -> Vec<data::Indirect> {
    let Some(Ok(measured)) = &found.indirect else { return Vec::new() };
    let hz: Vec<f64> = measured.response.omega.iter().map(|w| w / TAU).collect();
    let entry = |(output, input): (usize, usize)| {
        let values = measured.response.entry(output, input);
        data::Indirect {
            output,
            input,
            hz: hz.clone(),
            magnitude_db: magnitude(&values),
            phase_deg: phase(&values),
            coherence: measured.coherence_y.col_as_slice(output).to_vec(),
        }
    };
    ports(found).map(entry).collect()
}

/// The region of the recommended model.
fn recommended(found: &Identification, responses: &[(Method, FrequencyResponse)]) -> Vec<data::DrawnBand> {
    let Ok(model) = &found.recommended else { return Vec::new() };
    let own = responses.iter().filter(|(method, _)| *method == Method::Likelihood);
    let errors = model.region.entry_errors(&found.hz);
    own.flat_map(|(_, r)| ports(found).map(|port| recommended_band(&errors, r, port)).collect::<Vec<_>>()).collect()
}

/// The deviations of the recommended model by their causes.
fn deviations(found: &Identification) -> Result<Vec<data::DrawnDeviation>> {
    let Ok(model) = &found.recommended else { return Ok(Vec::new()) };
    let region = &model.region;
    let omega: Vec<f64> = region.hz.iter().map(|hz| TAU * hz).collect();
    let response = youla::lti::frequency_response(&model.plant, &omega)?;
    let entry = |(output, input): (usize, usize)| {
        let size: Vec<f64> = response.entry(output, input).iter().map(|g| g.norm()).collect();
        let percent = |all: &[Mat<f64>]| -> Vec<f64> {
            all.iter().zip(&size).map(|(deviation, size)| 100.0 * deviation[(output, input)] / size).collect()
        };
        let part = |(cause, all): (&str, &[Mat<f64>])| {
            let percent = percent(all);
            let some = percent.iter().any(|value| *value > 0.0);
            some.then(|| data::DeviationPart { cause: cause.into(), percent })
        };
        data::DrawnDeviation {
            output,
            input,
            hz: region.hz.clone(),
            total: percent(&region.absolute),
            parts: region.parts.named().into_iter().filter_map(part).collect(),
            limit: 100.0 * LARGEST_IN_BAND,
            bands: if model.in_doubt() { Vec::new() } else { model.entry_bands[output][input].clone() },
        }
    };
    Ok(ports(found).map(entry).collect())
}

/// The 95 % region of the response from an input to an output, with the errors at its frequencies.
fn recommended_band(
    errors: &[EntryErrors],
    response: &FrequencyResponse,
    (output, input): (usize, usize),
) -> data::DrawnBand {
    let half = |g: &c64, error: &EntryErrors| NORMAL * error.of_magnitude(*g, (output, input));
    let bounds = response
        .entry(output, input)
        .into_iter()
        .zip(errors)
        .map(|(g, e)| [g.norm() - half(&g, e), g.norm() + half(&g, e)]);
    let (low_db, high_db) = bounds_db(bounds);
    data::DrawnBand {
        method: Method::Likelihood.key().into(),
        output,
        input,
        level: LEVEL,
        low_db,
        high_db,
        region: errors.iter().flat_map(|e| e.covariance((output, input)).map(|v| ELLIPSE * v)).collect(),
    }
}

fn band(method: Method, known: &SystemUncertainty, (output, input): (usize, usize)) -> data::DrawnBand {
    let band = &known.response;
    let places: Vec<usize> = (0..band.response.omega.len()).map(|k| band.place(k, output, input)).collect();
    let (low_db, high_db) = bounds_db(places.iter().map(|at| band.magnitude[*at]));
    let region = places.iter().flat_map(|at| band.covariance[*at].map(|v| v * band.ellipse)).collect();
    data::DrawnBand { method: method.key().into(), output, input, level: known.level, low_db, high_db, region }
}

/// Nothing for a single input or output: the one singular value is the length of the row or column.
fn singular(found: &Identification, responses: &[(Method, FrequencyResponse)]) -> Result<Vec<data::SingularValue>> {
    let places = found.records.inputs.len().min(found.records.outputs.len());
    if places < 2 {
        return Ok(Vec::new());
    }
    let mut all = Vec::new();
    for (method, response) in responses {
        let gains = response.gains()?;
        for place in 0..places {
            all.push(data::SingularValue {
                method: method.key().into(),
                place,
                value_db: gains.iter().map(|at| decibel(at[place])).collect(),
            });
        }
    }
    Ok(all)
}

/// All pairs of output and input.
fn ports(found: &Identification) -> impl Iterator<Item = (usize, usize)> {
    responses::ports(found.records.outputs.len(), found.records.inputs.len())
}
