//! Verification records with the samples of the estimation, under whatever name of their file: their fit verifies nothing.

use super::finding;
use crate::records::RunRecords;
use faer::ColRef;
use youla::signal::LoopRecord;
use youla_loop::check::{Finding, Severity, Test};

/// Share of a verification record from which it counts as one of the estimation.
const SHARE: f64 = 0.5;
/// Two steps of a channel are the same within this share of its largest one: means that were taken out leave rounding.
const ROUNDING: f64 = 1e-9;
/// Places in a record that are compared.
const MOST_PLACES: usize = 100;

/// A finding for each verification record whose samples are mostly those of an estimation record.
pub(super) fn repeated(records: &RunRecords) -> Vec<Finding> {
    let of = |later: &LoopRecord| {
        let (used, row) = records.estimation.iter().find_map(|used| Some((used, same_from(used, later)?)))?;
        let what = format!(
            "its samples are those of {} from its sample {row} on, from which the models are identified: the fit to them verifies nothing",
            used.name()
        );
        let found = finding(Severity::Caution, later.name(), what, "Verify with samples that do not identify");
        Some(Finding { test: Test::Timing, ..found })
    };
    records.verification.iter().filter_map(of).collect()
}

/// The sample of a record, counted from 1, with which the samples of another begin that are mostly its own. Steps are compared: of the means
/// each record lost its own.
fn same_from(used: &LoopRecord, later: &LoopRecord) -> Option<usize> {
    let [used, later] = [Steps::new(used), Steps::new(later)];
    let (rows, channels) = (later.rows(), later.columns.len());
    let largest = |c: usize| (0..rows).fold(0.0, |m: f64, k| m.max(later.at(c, k).abs()));
    let sizes: Vec<f64> = (0..channels).map(largest).collect();
    let same = |a: usize, b: usize| {
        let equal = |c: usize| (used.at(c, a) - later.at(c, b)).abs() <= ROUNDING * sizes[c];
        (0..channels).all(equal)
    };
    let moves = |b: usize| (0..channels).any(|c| later.at(c, b) != 0.0);
    // With the sample `at` of the used record beside `anchor` of the later one.
    let shared = |at: usize, anchor: usize| {
        let rows = (anchor.saturating_sub(at)..rows).take_while(|b| at + b - anchor < used.rows());
        rows.filter(|b| moves(*b) && same(at + b - anchor, *b)).count()
    };
    // Half of the record holds a quarter whole, whose largest step is the least likely to be there twice.
    let quarters = (0..4).filter_map(|k| {
        let of = k * rows / 4..(k + 1) * rows / 4;
        of.max_by(|a, b| later.at(0, *a).abs().total_cmp(&later.at(0, *b).abs())).filter(|anchor| moves(*anchor))
    });
    let places = quarters.flat_map(|anchor| {
        let alike = (0..used.rows()).filter(move |at| same(*at, anchor)).take(MOST_PLACES);
        alike.map(move |at| (at, anchor))
    });
    let mut found = places.filter(|(at, anchor)| shared(*at, *anchor) as f64 > SHARE * rows as f64);
    found.next().map(|(at, anchor)| at.saturating_sub(anchor) + 1)
}

/// Differences of successive samples of all inputs and outputs.
struct Steps<'a> {
    columns: Vec<ColRef<'a, f64>>,
}

impl<'a> Steps<'a> {
    fn new(record: &'a LoopRecord) -> Self {
        Steps { columns: record.u().col_iter().chain(record.y().col_iter()).collect() }
    }

    fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.nrows().saturating_sub(1))
    }

    fn at(&self, channel: usize, row: usize) -> f64 {
        let column = self.columns[channel];
        column[row + 1] - column[row]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use youla::Mat;
    use youla::lti::Discrete;

    /// A cut of the estimation is found with its first sample, behind another mean; samples of their own are not.
    #[test]
    fn samples_of_the_estimation_are_found_again() {
        // Fractions of multiples of irrational numbers, no two alike.
        let all = Mat::from_fn(900, 2, |k, c| ((k * k) as f64 * [2f64, 3.0][c].sqrt()).fract());
        let record = |from: usize, rows: usize, mean: f64| {
            let column = |c: usize| Mat::from_fn(rows, 1, |k, _| all[(from + k, c)] - mean);
            LoopRecord::new(Discrete::new(0.01).unwrap(), column(0), column(1)).unwrap()
        };
        let used = record(0, 600, 0.5);
        assert_eq!(same_from(&used, &record(0, 600, 0.25)), Some(1));
        assert_eq!(same_from(&used, &record(200, 300, 0.25)), Some(201));
        assert_eq!(same_from(&used, &record(400, 300, 0.25)), Some(401), "two thirds of it");
        assert_eq!(same_from(&used, &record(600, 300, 0.5)), None);
        let still = LoopRecord::new(used.time(), Mat::zeros(100, 1), Mat::zeros(100, 1)).unwrap();
        assert_eq!(same_from(&still, &still), None);
    }
}
