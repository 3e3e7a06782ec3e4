//! Counts, and the items that the searches without a start do not solve.

use crate::study::{ARRIVED, StartCount, StartFailure};
use youla_report::story::{Row, Table, plain};

/// One line per case and search.
pub(super) fn counts(counts: &[StartCount]) -> Table {
    let optional = |number: Option<usize>| number.map_or_else(String::new, |n| n.to_string());
    let row = |c: &StartCount| {
        let share = 100.0 * c.arrived as f64 / c.items.max(1) as f64;
        let numbers = [c.items, c.without_loop, c.arrived].map(|n| n.to_string());
        let rest = [format!("{share:.1}"), c.refused.to_string(), c.unstable.to_string(), optional(c.told)];
        let cells = [c.case.key().to_owned(), c.search.label().to_owned()].into_iter().chain(numbers).chain(rest);
        Row { method: c.search.key().into(), cells: cells.chain([optional(c.with_start)]).collect() }
    };
    plain(
        "counts",
        "Counts",
        format!(
            "Items that arrived (behind by at most {ARRIVED} point on each axis), that gave no model, and that gave an unstable one. \
             Told: items that did not arrive and of which the search without a start says so itself. With the start: items that \
             arrive where the lower criterion of this search and of that from the start wins."
        ),
        &["case", "search", "items", "no loop", "arrived", "%", "no model", "unstable", "told", "with the start"],
        counts.iter().map(row).collect(),
    )
}

/// One line per item.
pub(super) fn failures(failures: &[StartFailure]) -> Table {
    let row = |f: &StartFailure| {
        let behind = f.behind.map(|points| match points {
            points if !points.is_finite() => "no fit".to_owned(),
            points if points > 999.0 => "> 999".to_owned(),
            points => format!("{points:.2}"),
        });
        let first = [f.case.key().to_owned(), f.item.to_string(), format!("{} {:.3}", f.case.setting(), f.setting)];
        let cells = first.into_iter().chain(behind).chain([f.reason.clone()]).collect();
        Row { method: f.search.key().into(), cells }
    };
    plain(
        "failures",
        "Failures",
        "Items at which the search without a start did not arrive: points of fit behind the search from the true parameters, and why.",
        &["case", "item", "setting", "behind, horizontal", "behind, vertical", "reason"],
        failures.iter().map(row).collect(),
    )
}
