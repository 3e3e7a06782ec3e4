//! The plant at the lines of a periodic excitation with the levels of noise and distortion.

use super::bode::{Pair, pairs};
use super::choice::Chosen;
use super::{RunFigure, axis, choice, frequency_in_both_units};
use crate::data::LineLevels;
use crate::figure::{Content, Curve, Drawn, Figure, MEASURED, Panel};

/// One figure per pair of output and input whose excitation is periodic.
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
    curves.push(measured("response at the lines", Drawn::Points, &lines.response_db));
    let levels = [
        ("noise", Drawn::Line, &lines.noise_db),
        ("noise and distortion", Drawn::Dots, &lines.total_db),
        ("distortion", Drawn::Marks, &lines.distortion_db),
    ];
    let known = levels.into_iter().filter(|(.., level)| !level.is_empty());
    curves.extend(known.map(|(note, drawn, level)| measured(note, drawn, level)));
    let gain = if pair.unit.is_empty() { "dB".into() } else { format!("dB re {}", pair.unit) };
    let more = match lines.total_db.is_empty() {
        true => "More records than inputs, with other phases, would tell distortion from noise.",
        false => "Distortion: what repeats with the period and changes with the phases.",
    };
    Figure {
        key: pair.key.clone(),
        title: format!("Noise and distortion, {}", pair.title),
        caption: format!(
            "Response at the lines of the periodic excitation, {}, without any model, and the standard deviation of its mean over \
             the periods. {more}",
            pair.title
        ),
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
