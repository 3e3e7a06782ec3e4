//! Frequency responses as loci: `10^(dB/20) exp(i phase)`, both axes of one scale.
//!
//! A region `d' V^-1 d <= 1` is an ellipse `d = L (cos t, sin t)` with `V = L L'`.

use super::bode::{FADED, Pair, is_clear, pairs, percent};
use super::choice::Chosen;
use super::{RunFigure, axis, choice, span};
use crate::data::{DrawnBand, Indirect, ModelResponse};
use crate::figure::{Axis, Content, Curve, Drawn, Figure, Guide, GuideKind, Panel};
use std::f64::consts::TAU;

/// Most regions of a curve, and points of each.
const ELLIPSES: usize = 48;
const AROUND: usize = 24;

/// One figure per pair of output and input.
pub(super) fn figures(chosen: &Chosen) -> Vec<Figure> {
    pairs(chosen, RunFigure::Nyquist).iter().map(figure).collect()
}

fn figure(pair: &Pair) -> Figure {
    let points = pair.indirect.iter().map(|measured| measured_points(measured)).filter(|curve| !curve.x.is_empty());
    let regions = pair.bands.iter().filter_map(|band| ellipses(pair, band));
    let curves: Vec<Curve> =
        points.chain(regions).chain(pair.models.iter().map(|model| locus(pair.hz, model))).collect();
    let ellipses = pair.bands.iter().find(|band| !band.region.is_empty()).map_or(String::new(), |band| {
        format!(
            " Ellipses: where the response lies with a probability of {} at each of some frequencies.",
            percent(band.level)
        )
    });
    let said = match pair.indirect.is_empty() {
        true => String::new(),
        false => format!(" Points: indirect non-parametric response where its coherence is at least {FADED}."),
    };
    let line =
        |x: [f64; 2], y: [f64; 2]| Guide { kind: GuideKind::Level, x: x.into(), y: y.into(), ..Guide::default() };
    const FAR: f64 = 1e12;
    let axes = [line([-FAR, FAR], [0.0, 0.0]), line([0.0, 0.0], [-FAR, FAR])];
    let marked = pair.models.iter().find(|model| model.method == "hansen").or(pair.models.first());
    let frequencies = marked.map_or_else(Vec::new, |model| frequencies(pair.hz, model));
    let seen = seen(pair);
    Figure {
        key: pair.key.clone(),
        title: format!("Locus, {}", pair.title),
        caption: format!("Frequency response, {}, over positive frequencies.{said}{ellipses}", pair.title),
        choice: choice(&[("View", "Nyquist"), ("Response of", &pair.title)]),
        panels: vec![Panel {
            x: Axis { range: seen.map(|[x, _]| x), ..axis("Real part", &pair.unit) },
            y: Axis { range: seen.map(|[_, y]| y), ..axis("Imaginary part", &pair.unit) },
            content: Content::Curves(curves),
            guides: axes.into_iter().chain(frequencies).collect(),
            equal: true,
            along: Some(axis("Frequency", "Hz")),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

/// Largest distance of a point from the origin over that of the models, beyond which it is not in the first view.
const STRAY: f64 = 2.0;

/// What the models with a region need, all models where none has one, and the points that are not far beyond; wider by a twentieth.
fn seen(pair: &Pair) -> Option<[[f64; 2]; 2]> {
    let has_region = |model: &&&ModelResponse| pair.bands.iter().any(|band| band.method == model.method);
    let none = !pair.models.iter().any(|model| has_region(&model));
    let of_model = |model: &&ModelResponse| -> Vec<(f64, f64)> {
        model.magnitude_db.iter().zip(&model.phase_deg).map(|(db, deg)| place(*db, *deg)).collect()
    };
    let loci: Vec<(f64, f64)> =
        pair.models.iter().filter(|model| none || has_region(model)).flat_map(of_model).collect();
    let largest = loci.iter().map(|(re, im)| re.hypot(*im)).filter(|size| size.is_finite()).fold(0.0, f64::max);
    let points = pair.indirect.iter().flat_map(|measured| {
        let curve = measured_points(measured);
        curve.x.into_iter().zip(curve.y).filter(|(re, im)| re.hypot(*im) <= STRAY * largest).collect::<Vec<_>>()
    });
    let all: Vec<(f64, f64)> = loci.iter().copied().chain(points).collect();
    let wider = |[low, high]: [f64; 2]| [low - 0.05 * (high - low), high + 0.05 * (high - low)];
    let ends = [span(all.iter().map(|at| at.0))?, span(all.iter().map(|at| at.1))?];
    (largest > 0.0).then(|| ends.map(wider))
}

fn locus(hz: &[f64], model: &ModelResponse) -> Curve {
    let (x, y) = model.magnitude_db.iter().zip(&model.phase_deg).map(|(db, deg)| place(*db, *deg)).unzip();
    Curve { method: model.method.clone(), x, y, along: hz.to_vec(), ..Curve::default() }
}

/// Points at 1, 2 and 5 times powers of ten, with their frequencies; between grid points on the chord.
fn frequencies(hz: &[f64], model: &ModelResponse) -> Vec<Guide> {
    let decades = (-3..6).map(|decade| 10f64.powi(decade));
    let wanted = [1.0, 2.0, 5.0].iter().flat_map(|digit| decades.clone().map(move |decade| digit * decade));
    let point = |wanted: f64| {
        let next = hz.partition_point(|f| *f <= wanted);
        let [from, to] = [next.checked_sub(1)?, next]
            .map(|k| Some((*hz.get(k)?, place(*model.magnitude_db.get(k)?, *model.phase_deg.get(k)?))));
        let ((low, a), (high, b)) = (from?, to?);
        let share = (wanted - low) / (high - low);
        let at = [a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1)];
        let label = format!("{} Hz", (wanted * 1e6).round() / 1e6);
        at.iter().all(|v| v.is_finite()).then(|| Guide { kind: GuideKind::Point, label, at, ..Guide::default() })
    };
    wanted.filter_map(point).collect()
}

/// The regions at some frequencies as one line with gaps.
fn ellipses(pair: &Pair, band: &DrawnBand) -> Option<Curve> {
    let model = pair.models.iter().find(|model| model.method == band.method)?;
    let mut curve = Curve { method: band.method.clone(), note: percent(band.level), ..Curve::default() };
    let every = (pair.hz.len() / ELLIPSES).max(1);
    let values = model.magnitude_db.iter().zip(&model.phase_deg).zip(band.region.chunks_exact(3));
    for (hz, ((db, deg), region)) in pair.hz.iter().zip(values).step_by(every) {
        let [rr, ri, ii] = [region[0], region[1], region[2]];
        let along = rr.sqrt();
        let (lean, rest) = (ri / along, (ii - ri * ri / rr).max(0.0).sqrt());
        let (re, im) = place(*db, *deg);
        if !(along > 0.0 && [re, im, lean, rest].iter().all(|value| value.is_finite())) {
            continue;
        }
        for k in 0..=AROUND {
            let (sine, cosine) = (TAU * k as f64 / AROUND as f64).sin_cos();
            curve.x.push(re + along * cosine);
            curve.y.push(im + lean * cosine + rest * sine);
            curve.along.push(*hz);
        }
        curve.x.push(re);
        curve.y.push(f64::NAN);
        curve.along.push(*hz);
    }
    Some(curve).filter(|curve| !curve.x.is_empty())
}

fn measured_points(measured: &Indirect) -> Curve {
    let mut curve = Curve { method: "indirect".into(), drawn: Drawn::Points, ..Curve::default() };
    let values = measured.magnitude_db.iter().zip(&measured.phase_deg).zip(&measured.coherence);
    for (hz, ((db, deg), _)) in measured.hz.iter().zip(values).filter(|(_, (_, coherence))| is_clear(**coherence)) {
        let (real, imaginary) = place(*db, *deg);
        if real.is_finite() && imaginary.is_finite() {
            curve.x.push(real);
            curve.y.push(imaginary);
            curve.along.push(*hz);
        }
    }
    curve
}

fn place(db: f64, deg: f64) -> (f64, f64) {
    let gain = 10f64.powf(db / 20.0);
    (gain * deg.to_radians().cos(), gain * deg.to_radians().sin())
}
