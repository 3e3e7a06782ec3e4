//! What a search makes small, and the noise with which it is least.

use super::driven::Entry;
use super::model::Model;
use super::noise::Noise;
use super::point::Point;
use super::{SearchOptions, feedthrough, unstable};
use crate::identify::likelihood::data::spectra::Spectra;

/// -2 log likelihood and noise of a point; noise at the inputs is white.
pub(crate) fn deviance(spectra: &Spectra, point: &Point, noise_order: usize) -> (f64, Noise) {
    let noise = Noise::fit(spectra, &point.residuals(spectra), (noise_order, false), &point.model);
    (of_noise(spectra, &noise, &point.model), noise)
}

fn of_noise(spectra: &Spectra, noise: &Noise, model: &Model) -> f64 {
    spectra.samples() as f64 * noise.log_det + 2.0 * unstable::outside(spectra, &model.poles())
}

/// What a search makes small, and the noise of the point.
pub(super) fn cost(spectra: &Spectra, point: &Point, options: &SearchOptions) -> (f64, Noise) {
    let of = (options.noise_order, coloured(spectra, options));
    let noise = Noise::fit(spectra, &point.residuals(spectra), of, &point.model);
    (value_of(spectra, &noise, &point.model, options), noise)
}

/// Whether noise at the inputs may have a colour. Autoregressions of single outputs do not describe the colour of what several see. That of one output
/// does until the last search: with a colour, searches from long regressions of a two-tank level end 60 to 100 nats above the model that they find
/// without it.
fn coloured(spectra: &Spectra, options: &SearchOptions) -> bool {
    options.filter_moves || spectra.outputs > 1
}

/// The same with noise at the inputs that is known of a point near where it is the more likely, and without another look where it leaves less than is
/// `enough`: its sizes have several minima, and the search for them ends anew at each point. Of lags that are hardly apart no step would be taken
/// otherwise, 300 nats above the minimum.
pub(super) fn least_cost(
    spectra: &Spectra,
    point: &Point,
    (known, enough): (Option<Entry>, f64),
    options: &SearchOptions,
) -> (f64, Noise) {
    match cost_near(spectra, point, known, options) {
        Some(near) if near.0 < enough => near,
        near => lesser(near, cost(spectra, point, options)),
    }
}

/// The lesser of that with known noise at the inputs, where there is one, and of what was found.
pub(super) fn lesser(near: Option<(f64, Noise)>, found: (f64, Noise)) -> (f64, Noise) {
    near.filter(|near| near.0 < found.0 || found.0.is_nan()).unwrap_or(found)
}

/// The same of a point with the noise of another.
pub(super) fn cost_beside(
    spectra: &Spectra,
    point: &Point,
    known: Option<&Noise>,
    options: &SearchOptions,
) -> (f64, Noise) {
    least_cost(spectra, point, (known.and_then(Noise::entry).cloned(), f64::NEG_INFINITY), options)
}

/// The same with known noise at the inputs; `None` where none is known, and where it has no filter.
pub(super) fn cost_near(
    spectra: &Spectra,
    point: &Point,
    known: Option<Entry>,
    options: &SearchOptions,
) -> Option<(f64, Noise)> {
    let entry = known?;
    if entry.colour.is_some() && !coloured(spectra, options) {
        return None;
    }
    let noise = Noise::of_entry(spectra, &point.residuals(spectra), options.noise_order, &point.model, entry)?;
    Some((value_of(spectra, &noise, &point.model, options), noise))
}

/// -2 log likelihood of y given the excitation.
pub(super) fn value_of(spectra: &Spectra, noise: &Noise, model: &Model, options: &SearchOptions) -> f64 {
    of_noise(spectra, noise, model) - 2.0 * spectra.samples() as f64 * feedthrough::log_loop(model, &options.direct)
}
