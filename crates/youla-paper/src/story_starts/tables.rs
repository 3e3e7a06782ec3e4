//! Counts, and the items that the searches without a start do not solve.

use crate::study::{CONVERGED_WITHIN, StartCount, StartFailure};
use youla_report::story::{Row, Table, plain};

/// One line per case and search.
pub(super) fn counts(counts: &[StartCount]) -> Table {
    let optional = |number: Option<usize>| number.map_or_else(String::new, |n| n.to_string());
    let row = |c: &StartCount| {
        let share = 100.0 * c.converged as f64 / c.items.max(1) as f64;
        let numbers = [c.items, c.without_loop, c.converged].map(|n| n.to_string());
        let rest = [format!("{share:.1}"), c.refused.to_string(), c.unstable.to_string(), optional(c.self_reported)];
        let cells = [c.case.key().to_owned(), c.search.label().to_owned()].into_iter().chain(numbers).chain(rest);
        Row { method: c.search.key().into(), cells: cells.chain([optional(c.with_start)]).collect() }
    };
    plain(
        "counts",
        "Counts",
        format!(
            "Items that converged (fit at most {CONVERGED_WITHIN} percentage points lower on each axis), that gave no model, and that gave an \
             unstable one. Self-reported: items that did not converge and for which the search without a start reports it. With the start: \
             items that converge where the lower criterion of this search and of that from the start is taken."
        ),
        &[
            "case",
            "search",
            "items",
            "no loop",
            "converged",
            "%",
            "no model",
            "unstable",
            "self-reported",
            "with the start",
        ],
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
        "Items at which the search without a start did not converge: percentage points of fit below the search from the true parameters, and the reason.",
        &["case", "item", "setting", "deficit, horizontal", "deficit, vertical", "reason"],
        failures.iter().map(row).collect(),
    )
}
