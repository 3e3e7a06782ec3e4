//! Parts that the tables share.

use super::words::{AXES, percent};
use crate::study::{ExperimentModel, StudyMethod};
use youla_report::story::TableRow;
pub(super) use youla_report::story::plain;

/// A row that is about no method.
pub(super) fn row(cells: impl IntoIterator<Item = String>) -> TableRow {
    TableRow { method: String::new(), cells: cells.into_iter().collect() }
}

/// A row about a method.
pub(super) fn method_row(method: StudyMethod, cells: impl IntoIterator<Item = String>) -> TableRow {
    TableRow { method: method.key().into(), cells: cells.into_iter().collect() }
}

/// One cell per axis.
pub(super) fn fit_cells(fit: [f64; 2], decimals: usize) -> [String; 2] {
    fit.map(|f| percent(f, decimals))
}

/// The axes as headings, as often as needed.
pub(super) fn axes(times: usize) -> Vec<String> {
    (0..times).flat_map(|_| AXES).map(str::to_owned).collect()
}

/// As a cell.
pub(super) fn yes(value: bool) -> String {
    if value { "yes" } else { "no" }.into()
}

/// The order of a model, or why there is none.
pub(super) fn order(model: &ExperimentModel) -> String {
    model.model.as_ref().map_or_else(Clone::clone, |g| g.order().to_string())
}
