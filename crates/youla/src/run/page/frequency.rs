//! Frequency responses of all models: magnitude and phase, principal gains, regions, and the measured ones.

use super::structure;
use crate::Result;
use crate::identify::subspace::ResponseBand;
use crate::report::data as draw;
use crate::run::pipeline::Identification;
use crate::run::response::{self, ModelResponses, decibel, grid, magnitude, model_responses, phase};
use crate::run::verdict::Method;
use std::f64::consts::TAU;

/// Lowest bound that is drawn, over the upper one: a bound of zero is drawn far below the curve.
const LEAST_BOUND: f64 = 1e-3;

/// The region of one model.
struct Known<'a> {
    method: Method,
    level: f64,
    band: std::borrow::Cow<'a, ResponseBand>,
}

pub(super) fn drawn(found: &Identification) -> Result<draw::FrequencyResponse> {
    let responses = model_responses(found, grid(found)?)?;
    let known = known(found, &responses.hz)?;
    let models = responses.models.iter().flat_map(|(method, r)| response::drawn(method.key(), r)).collect();
    let bands = known.iter().flat_map(|k| ports(found).map(|port| band(k, port)).collect::<Vec<_>>()).collect();
    let singular = singular(found, &responses, &known)?;
    Ok(draw::FrequencyResponse { hz: responses.hz, models, indirect: indirect(found), bands, singular })
}

fn indirect(found: &Identification) -> Vec<draw::Indirect> {
    let Some(Ok(measured)) = &found.indirect else { return Vec::new() };
    let hz: Vec<f64> = measured.response.omega.iter().map(|w| w / TAU).collect();
    let entry = |(output, input): (usize, usize)| {
        let values = measured.response.entry(output, input);
        draw::Indirect {
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

/// The regions of G(S) and of the physical structure, on the grid of the models.
fn known<'a>(found: &'a Identification, hz: &[f64]) -> Result<Vec<Known<'a>>> {
    use std::borrow::Cow::{Borrowed, Owned};
    let mut all = Vec::new();
    if let Some(uncertainty) = &found.uncertainty {
        let level = found.settings.hansen.uncertainty.level;
        all.push(Known { method: Method::Hansen, level, band: Borrowed(&uncertainty.plant.response) });
    }
    if let Some(run) = structure(found).and_then(|run| run.intervals.as_ref().ok()) {
        let omega: Vec<f64> = hz.iter().map(|f| TAU * f).collect();
        all.push(Known { method: Method::GreyBox, level: run.level, band: Owned(run.response(&omega)?) });
    }
    Ok(all)
}

fn band(known: &Known<'_>, (output, input): (usize, usize)) -> draw::Band {
    let band = &known.band;
    let places: Vec<usize> = (0..band.response.omega.len()).map(|k| band.place(k, output, input)).collect();
    let (low_db, high_db) = bounds_db(places.iter().map(|at| band.magnitude[*at]));
    let region = places.iter().flat_map(|at| band.covariance[*at].map(|v| v * band.ellipse)).collect();
    draw::Band { method: known.method.key().into(), output, input, level: known.level, low_db, high_db, region }
}

/// Nothing for a single input or output: the one singular value is the length of the row or column.
fn singular(
    found: &Identification,
    responses: &ModelResponses,
    known: &[Known<'_>],
) -> Result<Vec<draw::SingularValue>> {
    if found.records.inputs.len().min(found.records.outputs.len()) < 2 {
        return Ok(Vec::new());
    }
    let mut all = Vec::new();
    for (method, response) in &responses.models {
        let gains = response.gains()?;
        let band = known.iter().find(|k| k.method == *method);
        for place in 0..found.records.inputs.len().min(found.records.outputs.len()) {
            let (low_db, high_db) = band.map_or_else(Default::default, |k| {
                bounds_db(k.band.gains.iter().map(|at| [at[place][1], at[place][2]]))
            });
            all.push(draw::SingularValue {
                method: method.key().into(),
                place,
                value_db: gains.iter().map(|at| decibel(at[place])).collect(),
                level: band.map(|k| k.level),
                low_db,
                high_db,
            });
        }
    }
    Ok(all)
}

/// Lower and upper bounds in dB.
fn bounds_db(bounds: impl Iterator<Item = [f64; 2]>) -> (Vec<f64>, Vec<f64>) {
    bounds.map(|[low, high]| (decibel(low.max(LEAST_BOUND * high)), decibel(high))).unzip()
}

/// All pairs of output and input.
fn ports(found: &Identification) -> impl Iterator<Item = (usize, usize)> {
    response::ports(found.records.outputs.len(), found.records.inputs.len())
}
