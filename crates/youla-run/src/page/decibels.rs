//! Frequency responses in decibels and degrees, as reports draw them.

use crate::stages::responses::ports;
use youla::c64;
use youla::lti::FrequencyResponse;
use youla_report::data::ModelResponse;

/// Magnitude and phase of all pairs of a response, as a report draws them; `key` names the method.
pub(crate) fn drawn(key: &str, response: &FrequencyResponse) -> Vec<ModelResponse> {
    let first = response.at(0);
    let entry = |(output, input): (usize, usize)| {
        let values = response.entry(output, input);
        let (magnitude_db, phase_deg) = (magnitude(&values), phase(&values));
        ModelResponse { method: key.to_owned(), output, input, magnitude_db, phase_deg }
    };
    ports(first.nrows(), first.ncols()).map(entry).collect()
}

pub(crate) fn magnitude(values: &[c64]) -> Vec<f64> {
    values.iter().map(|v| decibel(v.norm())).collect()
}

/// In degrees, from -180 to 180.
pub(crate) fn phase(values: &[c64]) -> Vec<f64> {
    values.iter().map(|v| v.im.atan2(v.re).to_degrees()).collect()
}

/// Magnitude in dB.
pub(crate) fn decibel(magnitude: f64) -> f64 {
    20.0 * magnitude.log10()
}

/// Lowest bound that is stated, over the upper one: below it a region counts as reaching magnitude zero.
/// 60 dB, below the axis of every figure. Chosen, not measured.
const LEAST_BOUND: f64 = 1e-3;

/// Lower and upper bounds in dB, NaN (`null` in JSON) for one at magnitude zero.
pub(crate) fn bounds_db(bounds: impl Iterator<Item = [f64; 2]>) -> (Vec<f64>, Vec<f64>) {
    let stated = |bound: f64| if bound > 0.0 { decibel(bound) } else { f64::NAN };
    bounds.map(|[low, high]| (stated(if low > LEAST_BOUND * high { low } else { 0.0 }), stated(high))).unzip()
}

#[cfg(test)]
mod tests {
    use super::bounds_db;

    #[test]
    fn a_bound_at_magnitude_zero_has_no_decibels() {
        let (low, high) = bounds_db([[1.0, 10.0], [0.0, 1.0], [-2.0, 1.0], [1e-9, 1.0], [0.0, 0.0]].into_iter());
        assert_eq!((low[0], &high[..4]), (0.0, &[20.0, 0.0, 0.0, 0.0][..]));
        assert!(low[1..].iter().chain(&high[4..]).all(|bound| bound.is_nan()), "{low:?} {high:?}");
    }
}
