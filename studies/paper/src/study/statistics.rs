//! What the rows of a campaign say.

use super::method::StudyMethod;
use super::row::{RowStatus, StudyRow};

/// Fit of the worse axis, percent, below which a stable model counts as a poor fit.
pub const POOR_FIT: f64 = 50.0;

impl StudyRow {
    /// Whether there is no usable model: none, an unstable one, or one with a poor fit on an axis.
    pub fn failed(&self) -> bool {
        self.status != RowStatus::Stable || self.worse_fit() < POOR_FIT
    }
}

/// Margin in percentage points below which nobody wins.
pub const TIE: f64 = 1.0;

/// The value below which a share of the values lies, linear between neighbours; values that are not numbers count as lower
/// than all. NaN for no values.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let number = |v: &f64| if v.is_nan() { f64::NEG_INFINITY } else { *v };
    let mut sorted: Vec<f64> = values.iter().map(number).collect();
    sorted.sort_by(f64::total_cmp);
    youla::statistics::quantile(&sorted, share)
}

/// The middle value.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// One method over one tenth of the range of theta.
#[derive(Debug, Clone, PartialEq)]
pub struct Decile {
    /// The method.
    pub method: StudyMethod,
    /// From and to.
    pub theta: [f64; 2],
    /// Loops.
    pub count: usize,
    /// Median fit per axis, percent, over all loops; minus infinity where that many gave no model.
    pub median: [f64; 2],
    /// Median of the fit of the worse axis, by which methods are compared.
    pub worse: f64,
    /// Loops without a model.
    pub refused: usize,
    /// Loops with an unstable model.
    pub unstable: usize,
    /// Loops with a stable model whose fit is below [`POOR_FIT`] on an axis.
    pub poor_fit: usize,
}

impl Decile {
    /// Loops with a usable model.
    pub fn usable(&self) -> usize {
        self.count - self.failed()
    }

    /// Loops without a usable model.
    pub fn failed(&self) -> usize {
        self.refused + self.unstable + self.poor_fit
    }
}

/// Medians and failures of a method per tenth of the range of theta; every loop is in exactly one.
pub fn deciles(rows: &[StudyRow], method: StudyMethod, range: [f64; 2]) -> Vec<Decile> {
    let tenth = |theta: f64| (((theta - range[0]) / (range[1] - range[0]) * 10.0) as usize).min(9);
    let bound = |k: usize| range[0] + (range[1] - range[0]) * k as f64 / 10.0;
    (0..10)
        .map(|k| {
            let inside: Vec<&StudyRow> = rows.iter().filter(|r| r.method == method && tenth(r.theta) == k).collect();
            summary(method, [bound(k), bound(k + 1)], &inside)
        })
        .collect()
}

/// Medians and failures of a method over all loops.
pub fn overall(rows: &[StudyRow], method: StudyMethod, range: [f64; 2]) -> Decile {
    summary(method, range, &rows.iter().filter(|r| r.method == method).collect::<Vec<_>>())
}

fn summary(method: StudyMethod, theta: [f64; 2], rows: &[&StudyRow]) -> Decile {
    let axis = |i: usize| median(&rows.iter().map(|r| r.fit[i]).collect::<Vec<_>>());
    let count = |predicate: &dyn Fn(&StudyRow) -> bool| rows.iter().filter(|r| predicate(r)).count();
    Decile {
        method,
        theta,
        count: rows.len(),
        median: [axis(0), axis(1)],
        worse: median(&rows.iter().map(|r| r.worse_fit()).collect::<Vec<_>>()),
        refused: count(&|r| matches!(r.status, RowStatus::Refused | RowStatus::NoController)),
        unstable: count(&|r| r.status == RowStatus::Unstable),
        poor_fit: count(&|r| r.status == RowStatus::Stable && r.worse_fit() < POOR_FIT),
    }
}

/// Who wins a cell of the map.
#[derive(Debug, Clone, PartialEq)]
pub struct Winner {
    /// The methods with their median fit of the worse axis, percent, best first.
    pub ranking: Vec<(StudyMethod, f64)>,
    /// Lead over the second, percentage points; infinite where there is no second.
    pub margin: f64,
}

/// Compares the methods by the median over the rows of a cell of the fit of the worse axis; the nominal model does not
/// compete. `None` where there was no controller.
pub fn winner(rows: &[&StudyRow]) -> Option<Winner> {
    let competing: Vec<&&StudyRow> =
        rows.iter().filter(|r| r.method != StudyMethod::Nominal && r.status != RowStatus::NoController).collect();
    let mut methods: Vec<StudyMethod> = competing.iter().map(|r| r.method).collect();
    methods.sort();
    methods.dedup();
    let fits = |m: StudyMethod| competing.iter().filter(|r| r.method == m).map(|r| r.worse_fit()).collect::<Vec<_>>();
    let mut ranking: Vec<(StudyMethod, f64)> = methods.into_iter().map(|m| (m, median(&fits(m)))).collect();
    ranking.sort_by(|a, b| b.1.total_cmp(&a.1));
    let margin = match ranking.as_slice() {
        [] => return None,
        [_] => f64::INFINITY,
        // Both may be minus infinity.
        [first, second, ..] if first.1 == second.1 => 0.0,
        [first, second, ..] => first.1 - second.1,
    };
    Some(Winner { ranking, margin })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_by_hand() {
        let values = [3.0, 1.0, f64::NAN, 2.0];
        assert_eq!(quantile(&values, 1.0 / 3.0), 1.0);
        assert_eq!(median(&[1.0, 2.0, 4.0, 3.0]), 2.5);
        assert_eq!(median(&values[..2]), 2.0);
        assert!(median(&[]).is_nan());
        assert_eq!(median(&[f64::NAN, f64::NAN, 5.0]), f64::NEG_INFINITY);
    }
}
