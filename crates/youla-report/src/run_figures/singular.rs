//! Singular values of the response of all outputs from all inputs, with their bands.

use super::bode::percent;
use super::choice::Chosen;
use super::{RunFigure, axis, choice, frequency_in_both_units, key, span};
use crate::data::SingularValue;
use crate::figure::{Axis, Content, Curve, Figure, Panel, Region};

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
    let region = |one: &SingularValue| {
        let known = one.level.filter(|_| one.low_db.len() == hz.len() && one.high_db.len() == hz.len());
        known.map(|level| Region {
            method: one.method.clone(),
            note: percent(level),
            x: hz.clone(),
            low: one.low_db.clone(),
            high: one.high_db.clone(),
        })
    };
    let regions: Vec<Region> = singular.iter().filter_map(region).collect();
    let said = match regions.first() {
        None => String::new(),
        Some(first) => format!(
            " Filled: where they lie with a probability of {} at each frequency; where two of them meet, the bounds say little.",
            first.note
        ),
    };
    let room = |[low, high]: [f64; 2]| [low - 0.06 * (high - low).max(10.0), high + 0.06 * (high - low).max(10.0)];
    let range = span(singular.iter().flat_map(|one| &one.value_db).copied()).map(room);
    vec![Figure {
        key: key(RunFigure::SingularValues, &[]),
        title: "Singular values over frequency".into(),
        caption: format!(
            "Singular values of the response of all outputs from all inputs, in the units of the channels.{said}"
        ),
        choice: choice(&[("View", "Singular values")]),
        panels: vec![Panel {
            x: frequency_in_both_units(),
            y: Axis { range, ..axis("Singular values", "dB") },
            content: Content::Curves(singular.iter().map(curve).collect()),
            regions,
            ..Panel::default()
        }],
        ..Figure::default()
    }]
}
