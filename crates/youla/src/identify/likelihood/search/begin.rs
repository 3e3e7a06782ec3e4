//! Where a search begins: at the ends of the records that belong to its noise.

use super::noise::Noise;
use super::point::{Point, reblocked};
use super::{SearchOptions, cost, cost_beside, with_best_ends, with_best_inputs};
use crate::identify::likelihood::data::spectra::Spectra;

/// Times that the ends of a start and the filter of its noise are taken from each other: the third changes little.
const SETTLED: usize = 3;
/// Coefficients of an autoregression from which it may stand for noise at the inputs: a pole and a zero describe drift.
const LONG: usize = 3;

/// Where a search begins, its value and the noise there; `None` where that is not finite.
pub(super) fn begun(
    spectra: &Spectra,
    start: &Point,
    known: Option<&Noise>,
    options: &SearchOptions,
) -> Option<(Point, f64, Noise)> {
    let mut point = reblocked(start)?;
    let (mut least, mut noise) = cost_beside(spectra, &point, known, options);
    if !least.is_finite() {
        return None;
    }
    if let Some(trial) = from_inputs(spectra, &point, &noise, options) {
        let (value, other) = cost(spectra, &trial, options);
        if value < least {
            (point, least, noise) = (trial, value, other);
        }
    }
    // The ends of the start are those of another filter, and noise that several outputs see takes them for its own.
    for _ in 0..SETTLED {
        if noise.joint.is_none() {
            break;
        }
        let trial = with_best_ends(spectra, point.model.clone(), &noise);
        let (value, settled) = cost_beside(spectra, &trial, Some(&noise), options);
        let gain = least - value;
        if gain.is_nan() || gain < options.tolerance {
            break;
        }
        (point, least, noise) = (trial, value, settled);
    }
    Some((point, least, noise))
}

/// A start whose residual a long autoregression describes, of several outputs, as if all of it entered at the inputs: B, D and the ends, and
/// the sizes of that noise, by turns. Beside drift of an integrator, least squares of the outputs find its gain hundreds of times too large,
/// and from there a search ends at a wrong plant with long autoregressions.
fn from_inputs(spectra: &Spectra, start: &Point, noise: &Noise, options: &SearchOptions) -> Option<Point> {
    if noise.joint.is_some() || noise.parameters() <= LONG * spectra.outputs {
        return None;
    }
    let mut point = start.clone();
    for _ in 0..SETTLED {
        let noise = Noise::at_inputs(spectra, &point.residuals(spectra), options.noise_order, &point.model)?;
        point = with_best_inputs(spectra, point.model, &noise, options.feedthrough);
    }
    Some(point)
}
