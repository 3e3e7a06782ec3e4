//! Singular values of the response of all outputs from all inputs.

use super::choice::Chosen;
use super::{RunFigure, axis, choice, frequency_in_both_units, key, span};
use crate::data::SingularValue;
use crate::figure::{Axis, Content, Curve, Figure, Panel};

/// One figure where the run has several inputs and outputs.
pub(super) fn figure(chosen: &Chosen) -> Vec<Figure> {
    let Some(frequency) = chosen.data.frequency.as_ref().filter(|frequency| !frequency.singular.is_empty()) else {
        return Vec::new();
    };
    let (hz, singular) = (&frequency.hz, &frequency.singular);
    let curve = |one: &SingularValue| Curve {
        method: one.method.clone(),
        x: hz.clone(),
        y: one.value_db.clone(),
        ..Curve::default()
    };
    let room = |[low, high]: [f64; 2]| [low - 0.06 * (high - low).max(10.0), high + 0.06 * (high - low).max(10.0)];
    let range = span(singular.iter().flat_map(|one| &one.value_db).copied()).map(room);
    vec![Figure {
        key: key(RunFigure::SingularValues, &[]),
        title: "Singular values over frequency".into(),
        caption: "Singular values of the response of all outputs from all inputs, in the units of the channels.".into(),
        choice: choice(&[("View", "Singular values")]),
        panels: vec![Panel {
            x: frequency_in_both_units(),
            y: Axis { range, ..axis("Singular values", "dB") },
            content: Content::Curves(singular.iter().map(curve).collect()),
            ..Panel::default()
        }],
        ..Figure::default()
    }]
}
