//! The standard deviation of the recommended response with its causes, and the bands in which the response is valid.

use super::{logarithmic, span};
use crate::data::DrawnDeviation;
use crate::figure::{Area, Axis, Content, Curve, Panel};

/// Key of the total, of a band, and of each cause: each has a style of its own, the same in every figure.
const TOTAL: &str = "deviation, all causes";
const BAND: &str = "band of validity";
/// What each cause is.
const CAUSES: [(&str, &str); 4] = [
    ("noise", "the noise of the records"),
    ("choice", "models of other structure that the records do not tell from this one"),
    ("variation", "differences between records, and between parts of them, beyond their noise"),
    ("distortion", "what the excitation causes and no linear model of this order explains"),
];

/// Over the frequencies of the models; filled below the limit in each band of validity.
pub(super) fn panel(deviation: &DrawnDeviation, [first, last]: [f64; 2]) -> Panel {
    let places: Vec<usize> = (0..deviation.hz.len()).filter(|k| (first..=last).contains(&deviation.hz[*k])).collect();
    let kept = |values: &[f64]| -> Vec<f64> { places.iter().map(|k| values[*k]).collect() };
    let (hz, total) = (&kept(&deviation.hz), &kept(&deviation.total));
    let DrawnDeviation { parts, limit, bands, .. } = deviation;
    let line = |key: String, y: &[f64]| Curve { method: key, x: hz.clone(), y: y.to_vec(), ..Curve::default() };
    let parts = parts.iter().map(|part| line(format!("deviation, {}", part.cause), &kept(&part.percent)));
    let floor = span(total.iter().copied().filter(|v| *v > 0.0)).map_or(0.1 * limit, |[low, _]| low.min(0.1 * limit));
    let ceiling = span(total.iter().copied()).map_or(*limit, |[_, high]| high.clamp(2.0 * limit, 10.0 * limit));
    Panel {
        y: Axis { range: Some([0.3 * floor, ceiling]), ..logarithmic("Deviation", "%") },
        content: Content::Curves(std::iter::once(line(TOTAL.into(), total)).chain(parts).collect()),
        regions: (!bands.is_empty()).then(|| valid(hz, bands, *limit)).into_iter().collect(),
        height: Some(0.6),
        ..Panel::default()
    }
}

fn valid(hz: &[f64], bands: &[[f64; 2]], limit: f64) -> Area {
    let within = |hz: &f64| bands.iter().any(|[low, high]| (*low..=*high).contains(hz));
    Area {
        method: BAND.into(),
        note: format!("{limit} %"),
        x: hz.to_vec(),
        low: vec![f64::NAN; hz.len()],
        high: hz.iter().map(|hz| if within(hz) { limit } else { f64::NAN }).collect(),
    }
}

/// What the panel shows, with what each cause in it is.
pub(super) fn caption(deviation: &DrawnDeviation) -> String {
    let drawn = CAUSES.iter().filter(|(name, _)| deviation.parts.iter().any(|part| part.cause == *name));
    let causes: Vec<String> = drawn.map(|(name, what)| format!("{name}: {what}")).collect();
    let bands = match deviation.bands.is_empty() {
        true => String::new(),
        false => format!("; filled in the bands of validity, where it is at most {} %", deviation.limit),
    };
    format!(
        " Below: the standard deviation of the recommended response, in per cent of its magnitude{bands}. The square of the total is the sum \
         of the squares of its parts ({}).",
        causes.join("; ")
    )
}
