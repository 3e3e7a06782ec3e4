//! Frequency responses as loci: `10^(dB/20) exp(i phase)`, both axes of one scale.

use super::bode::{FADED, Pair, is_clear, pairs};
use super::choice::Chosen;
use super::{RunFigure, axis};
use crate::report::data::{Indirect, ModelResponse};
use crate::report::figure::{Content, Curve, Drawn, Figure, Guide, GuideKind, Layout, Panel};

/// One figure per pair of output and input.
pub(super) fn figures(chosen: &Chosen) -> Vec<Figure> {
    pairs(chosen, RunFigure::Nyquist).iter().map(figure).collect()
}

fn figure(pair: &Pair) -> Figure {
    let points = pair.indirect.iter().map(|measured| measured_points(measured)).filter(|curve| !curve.x.is_empty());
    let curves: Vec<Curve> = points.chain(pair.models.iter().map(|model| locus(pair.hz, model))).collect();
    let said = match pair.indirect.is_empty() {
        true => String::new(),
        false => format!(" Points: indirect non-parametric response where its coherence is at least {FADED}."),
    };
    let line =
        |x: [f64; 2], y: [f64; 2]| Guide { kind: GuideKind::Level, x: x.into(), y: y.into(), ..Guide::default() };
    const FAR: f64 = 1e12;
    Figure {
        key: pair.key.clone(),
        title: format!("Locus, {}", pair.title),
        caption: format!("Frequency response, {}, over positive frequencies.{said}", pair.title),
        layout: Layout::Stacked,
        panels: vec![Panel {
            x: axis("Real part", &pair.unit),
            y: axis("Imaginary part", &pair.unit),
            content: Content::Curves(curves),
            guides: vec![line([-FAR, FAR], [0.0, 0.0]), line([0.0, 0.0], [-FAR, FAR])],
            equal: true,
            ..Panel::default()
        }],
    }
}

fn locus(hz: &[f64], model: &ModelResponse) -> Curve {
    let (x, y) = model.magnitude_db.iter().zip(&model.phase_deg).map(|(db, deg)| place(*db, *deg)).unzip();
    Curve { method: model.method.clone(), x, y, along: hz.to_vec(), ..Curve::default() }
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
