//! Error of the reduction over its order, in open and in closed loop, with its a-priori bound.

use super::choice::Chosen;
use super::{RunFigure, axis, key, logarithmic};
use crate::data::{DrawnReduction, ReductionOrder};
use crate::figure::{Content, Curve, Drawn, Figure, Guide, GuideKind, Panel};

/// Relative errors below this are rounding, as of a model that is not reduced.
const ROUNDING: f64 = 1e-9;

/// One figure where errors were computed.
pub(super) fn figure(chosen: &Chosen) -> Vec<Figure> {
    let Some(reduction) = &chosen.data.reduction else { return Vec::new() };
    let rows: Vec<&ReductionOrder> = reduction.orders.iter().filter(|row| row.failure.is_none()).collect();
    let curves = curves(reduction, &rows);
    if curves.is_empty() {
        return Vec::new();
    }
    let shades: Vec<[f64; 2]> = rows
        .iter()
        .filter(|row| !row.stabilised_by_controller)
        .map(|row| [row.order as f64 - 0.5, row.order as f64 + 0.5])
        .collect();
    let shaded = if shades.is_empty() { "" } else { " Shaded: the controller does not stabilise the reduced model." };
    let taken = Guide {
        kind: GuideKind::Level,
        x: vec![reduction.chosen as f64; 2],
        y: vec![1e-300, 1e300],
        ..Guide::default()
    };
    vec![Figure {
        key: key(RunFigure::Reduction, &[]),
        title: "Error against order".into(),
        caption: format!(
            "Relative errors over the order (H∞ norm, {}); order {} is taken (dashed).{shaded}",
            reduction.label, reduction.chosen
        ),
        panels: vec![Panel {
            x: axis("Order", ""),
            y: logarithmic("Relative error", ""),
            content: Content::Curves(curves),
            guides: vec![taken],
            shades,
            ..Panel::default()
        }],
        ..Figure::default()
    }]
}

fn curves(reduction: &DrawnReduction, rows: &[&ReductionOrder]) -> Vec<Curve> {
    let bound = |row: &ReductionOrder| match (row.error_bound?, reduction.bound_is_gap, reduction.plant_norm) {
        (bound, true, _) => Some(bound),
        (bound, false, Some(norm)) if norm > 0.0 => Some(bound / norm),
        _ => None,
    };
    let curve = |method: &str, note: &str, of: &dyn Fn(&ReductionOrder) -> Option<f64>| {
        let known = rows.iter().filter_map(|row| Some((row.order as f64, of(row)?)));
        let (x, y): (Vec<f64>, Vec<f64>) = known.filter(|(_, error)| *error > ROUNDING).unzip();
        let line = Curve { method: method.into(), note: note.into(), x, y, ..Curve::default() };
        [line.clone(), Curve { drawn: Drawn::Dots, ..line }]
    };
    let bound_note = if reduction.bound_is_gap { "gap" } else { "" };
    let [bound, _] = curve("bound", bound_note, &bound);
    [
        curve("open loop", "", &|row| row.open_loop_relative).to_vec(),
        vec![bound],
        curve("hansen_reduced", "closed loop", &|row| row.closed_loop_relative).to_vec(),
    ]
    .concat()
    .into_iter()
    .filter(|curve| !curve.x.is_empty())
    .collect()
}
