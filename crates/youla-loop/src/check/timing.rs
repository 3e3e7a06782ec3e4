//! Time steps: regular, complete, in order, and of the declared size.
//!
//! With the step `ts` of the time column, step k is irregular where `|dt_k - ts| > tolerance ts`, and not by the rounding of the stamps; it is a gap of
//! `round(dt_k / ts) - 1` samples from 1.5 ts on, a repeated time at (nearly) zero, a jump back below. Nothing here is
//! random: there are no false alarms beyond the tolerance.

use super::finding::{Finding, Severity, Test, few};
use youla::signal::StampSteps;

/// Missing samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// Row after the gap, counted from 1.
    pub row: usize,
    /// Samples that are missing before it.
    pub missing: usize,
}

/// Properties of a time column.
#[derive(Debug, Clone, PartialEq)]
pub struct TimingCheck {
    /// Step of the stamps ([`StampSteps`]), seconds as declared by the column.
    pub step: f64,
    /// Root mean square of the deviations of the other steps, as a part of the step.
    pub jitter: f64,
    /// Largest such deviation.
    pub worst: f64,
    /// Rows, counted from 1, before which the step is irregular without being a gap, a repetition or a jump back.
    pub irregular: Vec<usize>,
    /// Missing samples.
    pub gaps: Vec<Gap>,
    /// Rows, counted from 1, that repeat the time of the row before.
    pub repeated: Vec<usize>,
    /// Rows, counted from 1, whose time is before that of the row before.
    pub back: Vec<usize>,
    /// Declared sample time over the step, where they differ by more than the tolerance.
    pub unit: Option<f64>,
}

/// Below this part of the step a time counts as repeated.
/// The jitter of a clock that repeats no sample is far smaller. Chosen, not measured.
const REPEATED: f64 = 0.05;
/// From this part on a step is a gap.
/// A missing sample makes a step of 2; 1.5 is midway to a regular step of 1.
const GAP: f64 = 1.5;

/// Compares a time column with its own step and against a declared sample time. `None` for less than three rows or
/// a median step that is not positive.
///
/// ```
/// use youla_loop::check::timing;
/// let times: Vec<f64> = (0..100).filter(|k| !(40..43).contains(k)).map(|k| 0.01 * f64::from(k)).collect();
/// let found = timing(&times, None, 1e-3).unwrap();
/// assert_eq!((found.gaps[0].row, found.gaps[0].missing), (41, 3));
/// ```
pub fn timing(times: &[f64], declared: Option<f64>, tolerance: f64) -> Option<TimingCheck> {
    if times.len() < 3 {
        return None;
    }
    let StampSteps { mean: step, slack, median } = StampSteps::of(times, tolerance)?;
    if step.is_nan() || median <= 0.0 {
        return None;
    }
    let (irregular, gaps, repeated, back) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut found = TimingCheck { step, jitter: 0.0, worst: 0.0, irregular, gaps, repeated, back, unit: None };
    let (mut energy, mut count) = (0.0, 0);
    for (k, pair) in times.windows(2).enumerate() {
        let (row, relative) = (k + 2, (pair[1] - pair[0]) / step);
        match relative {
            x if x < -REPEATED => found.back.push(row),
            x if x < REPEATED => found.repeated.push(row),
            x if x >= GAP => found.gaps.push(Gap { row, missing: (x.round() as usize).max(2) - 1 }),
            x => {
                energy += (x - 1.0) * (x - 1.0);
                count += 1;
                found.worst = found.worst.max((x - 1.0).abs());
                if (x - 1.0).abs() * step > slack {
                    found.irregular.push(row);
                }
            }
        }
    }
    found.jitter = (energy / f64::from(count.max(1))).sqrt();
    found.unit = declared.map(|ts| ts / step).filter(|ratio| (ratio - 1.0).abs() > tolerance);
    Some(found)
}

impl TimingCheck {
    /// The findings; `first` is the row of the file, counted from 1, of the first time.
    pub fn findings(&self, record: &str, first: usize) -> Vec<Finding> {
        let mut all = Vec::new();
        let defect = |what: String| Finding::new(Test::Timing, Severity::Defect, record, what);
        let span = |rows: &[usize]| (first - 1 + rows[0], first - 1 + rows[rows.len() - 1]);
        if let Some(ratio) = self.unit {
            let unit = [(1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds"), (60.0, "minutes")]
                .into_iter()
                .find(|(factor, _)| (ratio / factor - 1.0).abs() < 0.01);
            let guess = unit.map_or(String::new(), |(_, name)| format!("; the time column seems to be in {name}"));
            let what = format!(
                "the declared sample time is {} s, but the steps of the time column are {}{guess}",
                few(ratio * self.step),
                few(self.step)
            );
            all.push(
                defect(what)
                    .number("step", self.step)
                    .number("ratio", ratio)
                    .advice("Give time and sample time in seconds"),
            );
        }
        if !self.gaps.is_empty() {
            let missing: usize = self.gaps.iter().map(|g| g.missing).sum();
            let rows: Vec<usize> = self.gaps.iter().map(|g| g.row).collect();
            let (from, to) = span(&rows);
            let what = format!("{} samples are missing in {} gaps", missing, self.gaps.len());
            let advice = "Split the record there by gaps = \"split\", or log it again";
            let numbers = defect(what).number("missing", missing as f64).number("gaps", self.gaps.len() as f64);
            all.push(numbers.rows(from, to).advice(advice));
        }
        if !self.repeated.is_empty() {
            let (from, to) = span(&self.repeated);
            let what = format!("{} rows repeat the time of the row before", self.repeated.len());
            let advice =
                "Remove the rows that were logged twice; if their values differ, check the clock of the logger";
            all.push(defect(what).rows(from, to).number("repeated", self.repeated.len() as f64).advice(advice));
        }
        if !self.back.is_empty() {
            let (from, to) = span(&self.back);
            let what = format!("the time decreases at {} rows", self.back.len());
            let advice = "Sort the rows, or use the parts as separate records";
            all.push(defect(what).rows(from, to).number("back", self.back.len() as f64).advice(advice));
        }
        if !self.irregular.is_empty() {
            let (from, to) = span(&self.irregular);
            let what = format!(
                "{} steps deviate from the sample time of {} s, by {} % rms and {} % at most",
                self.irregular.len(),
                few(self.step),
                few(100.0 * self.jitter),
                few(100.0 * self.worst)
            );
            let advice = "If only the time stamps are irregular, set sample_time and remove time_column; if samples are \
                          missing here and there or channels have clocks of their own, bring them to one clock by `youla synchronise`";
            let numbers = defect(what).number("irregular", self.irregular.len() as f64).number("jitter", self.jitter);
            all.push(numbers.rows(from, to).number("worst", self.worst).advice(advice));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_step_is_told() {
        let mut times: Vec<f64> = (0..100).map(|k| 0.1 * f64::from(k)).collect();
        times[30] += 0.02;
        times.remove(60);
        times[80] = times[79];
        let found = timing(&times, Some(1e-4), 1e-3).unwrap();
        assert!((found.step - 0.1).abs() < 1e-12 && (found.worst - 0.2).abs() < 1e-9);
        // The step back from a repeated time is a gap of its own.
        let gaps: Vec<_> = found.gaps.iter().map(|g| (g.row, g.missing)).collect();
        assert_eq!((found.irregular, gaps, found.repeated), (vec![31, 32], vec![(61, 1), (82, 1)], vec![81]));
        assert!((found.unit.unwrap() - 1e-3).abs() < 1e-9);
        let sentences = timing(&times, Some(1e-4), 1e-3).unwrap().findings("log", 1);
        assert!(sentences[0].what.contains("milliseconds"), "{}", sentences[0].what);
        assert!(timing(&times[..20], Some(0.1), 1e-3).unwrap().findings("log", 1).is_empty());
        assert!(timing(&[0.0, 0.0, 0.0], None, 1e-3).is_none());
        let epoch: Vec<f64> = (0..1000).map(|k| 1_764_352_842.0 + f64::from(k) * 2e-4).collect();
        let found = timing(&epoch, Some(2e-4), 1e-3).unwrap();
        assert!(found.step == 2e-4 && found.findings("log", 1).is_empty(), "{found:?}");
    }
}
