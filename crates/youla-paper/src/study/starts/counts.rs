//! How many searches converged, and why the others did not.

use super::super::row::Status;
use super::case::StartCase;
use super::row::StartRow;
use super::search::Search;
use serde::Serialize;

/// Percentage points of fit (26) by which a model may be below that of the search from the truth, on each axis, to count as converged.
/// Chosen, not measured.
pub const CONVERGED_WITHIN: f64 = 0.1;

/// Outcomes of one search on the items of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartCount {
    /// The case.
    pub case: StartCase,
    /// The search.
    pub search: Search,
    /// Items with a loop.
    pub items: usize,
    /// Items without one: no controller keeps the margin.
    pub without_loop: usize,
    /// Items that converged.
    pub converged: usize,
    /// Items without a model.
    pub refused: usize,
    /// Items with an unstable model.
    pub unstable: usize,
    /// Searches without a start: items that did not converge and for which the search reports it, by `local_minimum_suspected()` or by refusing.
    pub self_reported: Option<usize>,
    /// Searches without a start: items that converge where the search from the start is run too and the lower criterion is taken.
    pub with_start: Option<usize>,
}

/// An item that a search without a start did not solve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartFailure {
    /// The case.
    pub case: StartCase,
    /// Number of the item, from 0.
    pub item: usize,
    /// theta of the nominal model, or how far off the start is.
    pub setting: f64,
    /// The search.
    pub search: Search,
    /// Points behind the yardstick, horizontal and vertical; infinite without a model.
    #[serde(serialize_with = "finite_or_none")]
    pub behind: [f64; 2],
    /// Why.
    pub reason: String,
}

fn finite_or_none<S: serde::Serializer>(values: &[f64; 2], serializer: S) -> Result<S::Ok, S::Error> {
    values.map(|v| v.is_finite().then_some(v)).serialize(serializer)
}

/// The counts of all searches of a case.
pub fn start_counts(case: StartCase, rows: &[StartRow]) -> Vec<StartCount> {
    let items = Items { rows, per_item: Search::of(case).count() };
    Search::of(case).map(|search| count(case, search, &items)).collect()
}

/// The items that the search without a start did not solve.
pub fn start_failures(case: StartCase, rows: &[StartRow]) -> Vec<StartFailure> {
    let items = Items { rows, per_item: Search::of(case).count() };
    let failure = |item: &[StartRow]| {
        let row = item.iter().find(|row| row.search.without_start())?;
        let behind = behind(row, item);
        (!converged(behind)).then(|| StartFailure {
            case,
            item: row.item,
            setting: row.setting,
            search: row.search,
            behind,
            reason: reason(row),
        })
    };
    items.all().filter_map(failure).collect()
}

/// The rows of a case, item by item, the yardstick first.
struct Items<'a> {
    rows: &'a [StartRow],
    per_item: usize,
}

impl Items<'_> {
    fn all(&self) -> impl Iterator<Item = &[StartRow]> {
        self.rows.chunks_exact(self.per_item)
    }
}

fn count(case: StartCase, search: Search, items: &Items<'_>) -> StartCount {
    let row = |item: &[StartRow]| item.iter().find(|row| row.search == search).cloned();
    let closed = |item: &&[StartRow]| item.iter().all(|row| row.status != Status::NoController);
    let with = |status| items.all().filter_map(row).filter(|r| r.status == status).count();
    let solved = |row: &StartRow, item: &[StartRow]| converged(behind(row, item));
    let self_reported = |item: &&[StartRow]| {
        row(item).is_some_and(|r| !solved(&r, item) && (r.local_minimum_suspected || r.status == Status::Refused))
    };
    let either = |item: &&[StartRow]| {
        let start = item.iter().find(|row| row.search == Search::Pem).cloned();
        let lower = [row(item), start].into_iter().flatten().filter(|r| !r.cost.is_nan());
        lower.min_by(|a, b| a.cost.total_cmp(&b.cost)).is_some_and(|r| solved(&r, item))
    };
    let of_projection = |predicate: &dyn Fn(&&[StartRow]) -> bool| {
        search.without_start().then(|| items.all().filter(closed).filter(|item| predicate(item)).count())
    };
    StartCount {
        case,
        search,
        items: items.all().filter(closed).count(),
        without_loop: with(Status::NoController),
        converged: items.all().filter(|item| row(item).is_some_and(|r| solved(&r, item))).count(),
        refused: with(Status::Refused),
        unstable: with(Status::Unstable),
        self_reported: of_projection(&self_reported),
        with_start: of_projection(&either),
    }
}

/// Points behind the yardstick, the first row of the item.
fn behind(row: &StartRow, item: &[StartRow]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let points = item[0].fit[axis] - row.fit[axis];
        if points.is_nan() { f64::INFINITY } else { points }
    })
}

fn converged(behind: [f64; 2]) -> bool {
    behind.iter().all(|points| *points <= CONVERGED_WITHIN)
}

fn reason(row: &StartRow) -> String {
    let state = match row.status {
        Status::NoController => "no loop",
        Status::Refused => "no model",
        Status::Unstable if row.local_minimum_suspected => "unstable model, local minimum suspected",
        Status::Unstable => "unstable model",
        Status::Stable if row.local_minimum_suspected => "local minimum suspected",
        Status::Stable => "another minimum",
    };
    if row.note.is_empty() { state.into() } else { format!("{state}: {}", row.note) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_by_hand() {
        let row = |item, search, fit, cost| StartRow {
            status: Status::Stable,
            fit: [fit, fit],
            cost,
            ..StartRow::without_model(item, 0.5, search)
        };
        let item = |k, projected: f64, start: f64| {
            vec![
                row(k, Search::Truth, 99.0, 1.0),
                row(k, Search::Pem, start, 100.0 - start),
                row(k, Search::PemMultiStart, 99.0, 1.0),
                StartRow {
                    local_minimum_suspected: projected < 90.0,
                    ..row(k, Search::HansenPem, projected, 100.0 - projected)
                },
            ]
        };
        let rows = [item(0, 98.95, 10.0), item(1, 80.0, 99.05), item(2, 98.8, 20.0)].concat();
        let counts = start_counts(StartCase::Loop02, &rows);
        let hansen = counts.iter().find(|c| c.search == Search::HansenPem).unwrap();
        assert_eq!((hansen.items, hansen.converged, hansen.self_reported, hansen.with_start), (3, 1, Some(1), Some(2)));
        let single = counts.iter().find(|c| c.search == Search::Pem).unwrap();
        assert_eq!((single.converged, single.self_reported), (1, None));
        let failures = start_failures(StartCase::Loop02, &rows);
        assert_eq!(failures.iter().map(|f| f.item).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(
            (failures[0].reason.as_str(), failures[1].reason.as_str()),
            ("local minimum suspected", "another minimum")
        );
    }
}
