//! Singular values and Hankel singular values: those that are kept filled, the others as outlines.

use super::choice::Chosen;
use super::{RunFigure, axis, key, logarithmic};
use crate::data::OrderChoice;
use crate::figure::{Content, Curve, Drawn, Figure, Guide, GuideKind, Layout, Panel};

/// Values below this share of the largest one are rounding.
const ROUNDING: f64 = 1e-18;

/// Of each choice of an order.
pub(super) fn singular_values(chosen: &Chosen) -> Vec<Figure> {
    let orders = &chosen.data.orders;
    let panel = |choice: &OrderChoice| Panel {
        title: capital(if choice.label.is_empty() { &choice.method } else { &choice.label }),
        ..stems(&choice.method, &choice.values, choice.chosen, "Singular value")
    };
    let said = |choice: &OrderChoice| {
        format!("{}: {} of {} are kept.", capital(&choice.label), choice.chosen, choice.values.len())
    };
    let sentences: Vec<String> = orders.iter().map(said).collect();
    let figure = || Figure {
        key: key(RunFigure::Order, &[]),
        title: "Choice of the order".into(),
        caption: format!("Singular values, filled where they are kept. {}", sentences.join(" ")),
        layout: Layout::Beside,
        panels: orders.iter().map(panel).collect(),
        ..Figure::default()
    };
    if orders.is_empty() { Vec::new() } else { vec![figure()] }
}

/// Of the model that was reduced.
pub(super) fn hankel(chosen: &Chosen) -> Vec<Figure> {
    let Some(reduction) = chosen.data.reduction.as_ref().filter(|reduction| !reduction.hankel.is_empty()) else {
        return Vec::new();
    };
    let kept = reduction.chosen.saturating_sub(reduction.kept);
    let apart = match reduction.kept {
        0 => String::new(),
        states => format!(", besides {states} whose poles are kept as they are"),
    };
    let norm = if reduction.bound_is_gap { "gap metric" } else { "H∞ norm" };
    let bound = reduction.bound.map_or(String::new(), |b| format!(" The error is at most {b:.4} in the {norm}."));
    let all = reduction.hankel.len();
    vec![Figure {
        key: key(RunFigure::Hankel, &[]),
        title: "Hankel singular values".into(),
        caption: format!(
            "Hankel singular values ({}). {kept} of {all} states are kept{apart}.{bound}",
            reduction.label
        ),
        panels: vec![stems("hansen_reduced", &reduction.hankel, kept, "Hankel singular value")],
        ..Figure::default()
    }]
}

fn stems(method: &str, values: &[f64], kept: usize, label: &str) -> Panel {
    let largest = values.iter().copied().fold(0.0, f64::max);
    let shown = |places: std::ops::Range<usize>, note: &str, drawn| {
        let (x, y) = places.filter(|k| values[*k] > largest * ROUNDING).map(|k| ((k + 1) as f64, values[k])).unzip();
        Curve { method: method.into(), note: note.into(), drawn, x, y, ..Curve::default() }
    };
    let kept = kept.min(values.len());
    let curves = [shown(0..kept, "kept", Drawn::Dots), shown(kept..values.len(), "left out", Drawn::Marks)];
    Panel {
        x: axis("Number", ""),
        y: logarithmic(label, ""),
        content: Content::Curves(curves.into_iter().filter(|curve| !curve.x.is_empty()).collect()),
        guides: vec![Guide {
            kind: GuideKind::Level,
            x: vec![kept as f64 + 0.5; 2],
            y: vec![1e-300, 1e300],
            ..Guide::default()
        }],
        ..Panel::default()
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
