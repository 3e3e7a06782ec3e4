//! The plant without a model, at lines or in windows, with the levels of noise and distortion.

use super::bode::{Pair, pairs};
use super::choice::Chosen;
use super::{RunFigure, axis, choice, frequency_in_both_units};
use crate::data::{LevelBasis, LineLevels};
use crate::figure::{Content, Curve, Drawn, Figure, MEASURED, Panel};

/// One figure per pair of output and input with a known excitation.
pub(super) fn figures(chosen: &Chosen) -> Vec<Figure> {
    pairs(chosen, RunFigure::Levels).iter().filter_map(|pair| Some(figure(pair, pair.lines?))).collect()
}

fn figure(pair: &Pair, lines: &LineLevels) -> Figure {
    let measured = |note: &str, drawn: Drawn, y: &[f64]| Curve {
        method: MEASURED.into(),
        note: note.into(),
        drawn,
        x: lines.hz.clone(),
        y: y.to_vec(),
        ..Curve::default()
    };
    let own = pair.models.iter().filter(|model| model.method == "likelihood");
    let model = own.map(|model| Curve {
        method: model.method.clone(),
        x: pair.hz.to_vec(),
        y: model.magnitude_db.clone(),
        ..Curve::default()
    });
    let mut curves: Vec<Curve> = model.collect();
    curves.push(measured("response", Drawn::Points, &lines.response_db));
    let levels = [
        ("noise", Drawn::Line, &lines.noise_db),
        ("noise and distortion", Drawn::Dots, &lines.total_db),
        ("distortion", Drawn::Marks, &lines.distortion_db),
    ];
    let known = levels.into_iter().filter(|(.., level)| !level.is_empty());
    curves.extend(known.map(|(note, drawn, level)| measured(note, drawn, level)));
    let gain = if pair.unit.is_empty() { "dB".into() } else { format!("dB re {}", pair.unit) };
    let what = match (lines.basis, lines.total_db.is_empty()) {
        (LevelBasis::Periods, true) => {
            "at the lines of the periodic excitation, with the standard deviation of its mean over the periods. More records than \
             inputs, with other phases, would tell distortion from noise."
        }
        (LevelBasis::Periods, false) => {
            "at the lines of the periodic excitation, with the standard deviation of its mean over the periods. Distortion: what \
             repeats with the period and changes with the phases."
        }
        (LevelBasis::Windows, _) => {
            "by polynomials over windows of neighbouring frequencies, with its standard deviation by noise. A periodic excitation \
             would tell distortion from noise."
        }
        (LevelBasis::Stated, _) => "as measured, with the standard deviation that is stated.",
    };
    Figure {
        key: pair.key.clone(),
        title: format!("Noise and distortion, {}", pair.title),
        caption: format!("Response of {} without any model, {what}", pair.title),
        choice: choice(&[("View", "Noise and distortion"), ("Response of", &pair.title)]),
        panels: vec![Panel {
            x: frequency_in_both_units(),
            y: axis("Magnitude", gain),
            content: Content::Curves(curves),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}
