//! Parts that the figures share.

use crate::study::StudyMethod;
use youla_report::figure::{Axis, Curve, Drawn};

/// First view of a fit, as in Fig. 4 of the paper.
pub(super) const FIT_RANGE: [f64; 2] = [-20.0, 100.0];

/// An axis that shows all.
pub(super) fn axis(label: &str, unit: &str) -> Axis {
    Axis { label: label.into(), unit: unit.into(), ..Axis::default() }
}

/// The same with a first view.
pub(super) fn ranged(label: &str, unit: &str, range: [f64; 2]) -> Axis {
    Axis { range: Some(range), ..axis(label, unit) }
}

/// The same, logarithmic.
pub(super) fn logarithmic(label: &str, unit: &str) -> Axis {
    Axis { log: true, ..axis(label, unit) }
}

/// The fit (26).
pub(super) fn fit_axis(axis_name: &str) -> Axis {
    ranged(&format!("fit {axis_name}"), "%", FIT_RANGE)
}

/// A line of a method.
pub(super) fn line(method: StudyMethod, note: &str, x: Vec<f64>, y: Vec<f64>) -> Curve {
    Curve { method: method.key().into(), note: note.into(), drawn: Drawn::Line, x, y, ..Curve::default() }
}

/// Points of a method.
pub(super) fn points(method: StudyMethod, note: &str, x: Vec<f64>, y: Vec<f64>) -> Curve {
    Curve { drawn: Drawn::Points, ..line(method, note, x, y) }
}
