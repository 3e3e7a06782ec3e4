//! One line of a results file: one item by one search, with a check of its own.

use super::super::row::{ResultLine, Status, checked, in_one_field, unchecked};
use super::search::Search;

/// The result of one search on one item.
#[derive(Debug, Clone, PartialEq)]
pub struct StartRow {
    /// Number of the item within its case, from 0.
    pub item: usize,
    /// theta of the nominal model, or how far off the start is; see [`super::StartCase::setting`].
    pub setting: f64,
    /// The search.
    pub search: Search,
    /// What became of it.
    pub status: Status,
    /// Fit (26) on the noise-free record, percent, horizontal and vertical; NaN without a model, minus infinity where the
    /// model's output leaves the range of the numbers.
    pub fit: [f64; 2],
    /// The criterion where it ended; NaN without a model.
    pub cost: f64,
    /// Steps of the last search.
    pub steps: Option<usize>,
    /// Whether its own diagnostics suspect a local minimum; known of searches without a start only.
    pub local_minimum_suspected: bool,
    /// Why there is no model, or what was done on the way.
    pub note: String,
}

impl StartRow {
    /// The row of a search that led to no model.
    pub(super) fn without_model(item: usize, setting: f64, search: Search) -> Self {
        StartRow {
            item,
            setting,
            search,
            status: Status::Refused,
            fit: [f64::NAN; 2],
            cost: f64::NAN,
            steps: None,
            local_minimum_suspected: false,
            note: String::new(),
        }
    }
}

impl ResultLine for StartRow {
    const HEADER: &str =
        "item,setting,search,status,fit_horizontal,fit_vertical,cost,steps,local_minimum_suspected,note,check";

    fn item(&self) -> usize {
        self.item
    }

    fn line(&self) -> String {
        checked(format!(
            "{},{},{},{},{},{},{},{},{},{}",
            self.item,
            self.setting,
            self.search.key(),
            self.status.word(),
            self.fit[0],
            self.fit[1],
            self.cost,
            self.steps.map_or_else(String::new, |steps| steps.to_string()),
            if self.local_minimum_suspected { "local minimum" } else { "" },
            in_one_field(&self.note),
        ))
    }

    fn parse(line: &str) -> Option<StartRow> {
        let fields: Vec<&str> = unchecked(line)?.split(',').collect();
        let [item, setting, search, status, h, v, cost, steps, local_minimum_suspected, note] =
            fields.as_slice().try_into().ok()?;
        Some(StartRow {
            item: str::parse(item).ok()?,
            setting: str::parse(setting).ok()?,
            search: Search::of_key(search)?,
            status: Status::of_word(status)?,
            fit: [str::parse(h).ok()?, str::parse(v).ok()?],
            cost: str::parse(cost).ok()?,
            steps: if str::is_empty(steps) { None } else { Some(str::parse(steps).ok()?) },
            local_minimum_suspected: match local_minimum_suspected {
                "local minimum" => true,
                "" => false,
                _ => return None,
            },
            note: str::to_owned(note),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_reads_back_and_a_damaged_one_does_not() {
        let row = StartRow {
            fit: [f64::NEG_INFINITY, -1.0 / 3.0],
            cost: 1e-300,
            steps: Some(3),
            local_minimum_suspected: true,
            note: "a, b".into(),
            ..StartRow::without_model(4, 0.1 + 0.2, Search::HansenPem)
        };
        let line = row.line();
        assert_eq!(StartRow::parse(&line), Some(StartRow { note: "a; b".into(), ..row }));
        assert_eq!(line.split(',').count(), StartRow::HEADER.split(',').count());
        assert_eq!(StartRow::parse(&line.replacen('4', "5", 1)), None);
    }
}
