//! The share that converged, as a map.

use crate::study::{Search, StartCase, StartCount};
use youla_report::figure::{Axis, Cell, Cells, Content, Figure, Panel};

/// One cell per case and search; the searches without a start share a column.
pub(super) fn converged(counts: &[StartCount]) -> Figure {
    let columns = Search::ALL.into_iter().filter(|search| *search != Search::SubspacePem);
    let named = |search: Search| if search.without_start() { "without a start" } else { search.label() };
    let mut cases: Vec<StartCase> = counts.iter().map(|c| c.case).collect();
    cases.dedup();
    // Rows of a map stand from below.
    cases.reverse();
    let of = |case: StartCase, column: Search| {
        let same = |c: &&StartCount| {
            c.case == case && (c.search == column || (column.without_start() && c.search.without_start()))
        };
        counts.iter().find(same).map(cell).unwrap_or_default()
    };
    let cells = cases.iter().flat_map(|case| columns.clone().map(|column| of(*case, column))).collect();
    Figure {
        key: "starts".into(),
        title: "Converged searches".into(),
        caption:
            "Items that converged to the estimate of the search from the true parameters, of all items of the case."
                .into(),
        panels: vec![Panel {
            title: String::new(),
            x: Axis { label: "start".into(), ..Axis::default() },
            y: Axis { label: "case".into(), ..Axis::default() },
            content: Content::Cells(Cells {
                columns: columns.clone().map(|search| named(search).to_owned()).collect(),
                rows: cases.iter().map(|case| case.key().to_owned()).collect(),
                cells,
            }),
            ..Panel::default()
        }],
        ..Figure::default()
    }
}

fn cell(count: &StartCount) -> Cell {
    let share = count.converged as f64 / count.items.max(1) as f64;
    Cell {
        method: count.search.key().into(),
        strength: share,
        text: if count.converged == count.items { "all".into() } else { format!("{:.1} %", 100.0 * share) },
        detail: format!("{}: {} of {} converged", count.search.label(), count.converged, count.items),
    }
}
