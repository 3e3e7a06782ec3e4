//! One curve over time as it is drawn, and the clock to which its points refer.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{decimate, numbers};
use crate::{Error, Result};

/// Most points that one curve is drawn with. A screen has fewer columns than half of this.
pub const MAX_POINTS: usize = 4000;

/// Most rows of a record: what a number on the page counts exactly.
const MAX_ROWS: usize = if usize::BITS > 53 { (1_u64 << 53) as usize } else { usize::MAX };

/// Most samples in the window in which every sample is drawn.
const MAX_DETAIL: usize = 1600;

/// The time axis shared by the curves of one figure.
///
/// Sample `k` is at `k * sample_time`. A record of more than [`MAX_POINTS`] samples is drawn by the minimum and maximum of
/// each bucket, except within `detail`, where every sample is drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TimelineNumbers")]
pub struct Timeline {
    /// Seconds between samples.
    pub sample_time: f64,
    /// Number of samples of the record.
    pub samples: usize,
    /// Rows of the record of which every sample is drawn; empty where the whole record is.
    pub detail: Range<usize>,
    /// Samples per bucket outside of `detail`; 1 where every sample is drawn.
    pub bucket: usize,
}

impl Timeline {
    /// A clock for a record of `samples` rows, with the detail window in its middle.
    pub fn new(sample_time: f64, samples: usize) -> Self {
        Self::with_detail_around(sample_time, samples, samples / 2)
    }

    /// A clock whose detail window starts where `signal` departs farthest from its mean, the part worth seeing.
    pub fn around_largest_swing(sample_time: f64, signal: &[f64]) -> Self {
        let mean = signal.iter().sum::<f64>() / signal.len() as f64;
        let distance = |row: &usize| (signal[*row] - mean).abs();
        let centre = (0..signal.len()).max_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        Self::with_detail_around(sample_time, signal.len(), centre)
    }

    fn with_detail_around(sample_time: f64, samples: usize, centre: usize) -> Self {
        let mut timeline = Timeline { sample_time, samples, detail: centre..centre, bucket: 1 };
        timeline.fit_into(MAX_POINTS);
        timeline
    }

    /// Chooses window and buckets such that a curve has at most `points` points.
    fn fit_into(&mut self, points: usize) {
        let length = if self.samples <= points { 0 } else { MAX_DETAIL.min(points * 2 / 5) };
        let centre = self.detail.start + self.detail.len() / 2;
        let start = centre.saturating_sub(length / 2).min(self.samples - length);
        self.detail = start..start + length;
        self.bucket = self.bucket.max(decimate::width_for(self.samples, length, points));
    }
}

/// A [`Timeline`] as it is in a file.
#[derive(Deserialize)]
struct TimelineNumbers {
    sample_time: f64,
    samples: usize,
    detail: Range<usize>,
    bucket: usize,
}

impl TryFrom<TimelineNumbers> for Timeline {
    type Error = String;

    fn try_from(clock: TimelineNumbers) -> std::result::Result<Self, String> {
        let TimelineNumbers { sample_time, samples, detail, bucket } = clock;
        if !(sample_time > 0.0 && sample_time.is_finite()) {
            return Err(format!(
                "the sample_time of a clock is {sample_time}, but must be a positive number of seconds"
            ));
        }
        if samples > MAX_ROWS || detail.start > detail.end || detail.end > samples {
            let Range { start, end } = detail;
            return Err(format!(
                "the detail of a clock, rows {start} to {end}, does not lie within its {samples} samples"
            ));
        }
        if bucket == 0 {
            return Err("the bucket of a clock is 0, but must be at least 1".into());
        }
        Ok(Timeline { sample_time, samples, detail, bucket })
    }
}

/// One curve over time, reduced to the points that are drawn.
///
/// ```
/// use youla_report::{Timeline, Trace};
/// let samples: Vec<f64> = (0..240_000).map(|k| (k as f64 * 1e-3).sin()).collect();
/// let clock = Timeline::new(1e-3, samples.len());
/// let trace = Trace::new("u", &samples, &clock)?;
/// assert!(trace.values.len() <= 4000);
/// # Ok::<(), youla_report::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TraceNumbers")]
pub struct Trace {
    /// Rows from each point to the next; the first counts from row 0.
    pub steps: Vec<usize>,
    /// Values, rounded to 1e-5 of themselves or of the range of the curve, whichever is finer; NaN makes a gap.
    #[serde(deserialize_with = "numbers::many")]
    pub values: Vec<f64>,
}

/// A [`Trace`] as it is in a file.
#[derive(Deserialize)]
struct TraceNumbers {
    steps: Vec<usize>,
    #[serde(deserialize_with = "numbers::many")]
    values: Vec<f64>,
}

impl TryFrom<TraceNumbers> for Trace {
    type Error = String;

    fn try_from(curve: TraceNumbers) -> std::result::Result<Self, String> {
        let TraceNumbers { steps, values } = curve;
        if steps.len() != values.len() {
            return Err(format!("a curve has {} steps and {} values", steps.len(), values.len()));
        }
        let last = steps.iter().try_fold(0_usize, |row, step| row.checked_add(*step).filter(|row| *row < MAX_ROWS));
        match last {
            Some(_) => Ok(Trace { steps, values }),
            None => Err(format!("the steps of a curve lead beyond row {MAX_ROWS}")),
        }
    }
}

impl Trace {
    /// Reduces a signal to the points that are drawn.
    ///
    /// # Errors
    /// [`youla::Error::Shape`] where the signal is not as long as the clock says; `name` says which.
    pub fn new(name: &str, samples: &[f64], clock: &Timeline) -> Result<Self> {
        if samples.len() != clock.samples {
            return Err(Error::Method(youla::Error::Shape {
                what: format!("signal {name} of the report"),
                expected: (clock.samples, 1),
                found: (samples.len(), 1),
            }));
        }
        Ok(Self::reduced(samples.iter().copied().enumerate(), clock))
    }

    /// Row and value of each point.
    pub fn points(&self) -> impl Iterator<Item = (usize, f64)> {
        let rows = self.steps.iter().scan(0, |row, step| {
            *row += step;
            Some(*row)
        });
        rows.zip(self.values.iter().copied())
    }

    fn reduced(points: impl Iterator<Item = (usize, f64)>, clock: &Timeline) -> Self {
        let kept = decimate::min_max(points, clock.samples, &clock.detail, clock.bucket);
        let mut previous = 0;
        let steps = kept.iter().map(|&(row, _)| row - std::mem::replace(&mut previous, row)).collect();
        Trace { steps, values: numbers::for_drawing(kept.iter().map(|point| point.1), 6) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_knows_rows_and_values() {
        let samples: Vec<f64> = (0..100_000).map(|k| 1000.0 + (k as f64 * 0.01).sin()).collect();
        let clock = Timeline::around_largest_swing(1e-3, &samples);
        let trace = Trace::new("y", &samples, &clock).unwrap();
        assert!(trace.values.len() <= MAX_POINTS && clock.bucket > 1 && !clock.detail.is_empty());
        for (row, value) in trace.points() {
            assert!((samples[row] - value).abs() <= 2e-5);
        }
    }

    /// What a report.json that was changed by hand may hold.
    #[test]
    fn impossible_clocks_and_curves_are_refused() {
        let clock = |detail: &str, bucket: &str| {
            let text =
                format!("{{\"sample_time\": 1e-3, \"samples\": 9000, \"detail\": {detail}, \"bucket\": {bucket}}}");
            serde_json::from_str::<Timeline>(&text).map_err(|e| e.to_string())
        };
        let huge = usize::MAX;
        let mut good = clock("{\"start\": 8990, \"end\": 9000}", "7").unwrap();
        good.fit_into(600);
        assert!(good.detail.end <= 9000);
        for (detail, bucket, evidence) in [
            (format!("{{\"start\": {huge}, \"end\": {huge}}}"), "1", "within its 9000 samples"),
            ("{\"start\": 5, \"end\": 3}".into(), "1", "rows 5 to 3"),
            ("{\"start\": 0, \"end\": 9001}".into(), "1", "rows 0 to 9001"),
            ("{\"start\": 0, \"end\": 0}".into(), "0", "the bucket of a clock is 0"),
        ] {
            let error = clock(&detail, bucket).unwrap_err();
            assert!(error.contains(evidence), "{error}");
        }
        for (steps, evidence) in [(format!("[0, {huge}, 1]"), "beyond row"), ("[0]".into(), "1 steps and 3 values")] {
            let text = format!("{{\"steps\": {steps}, \"values\": [1.0, null, 2.0]}}");
            let error = serde_json::from_str::<Trace>(&text).unwrap_err().to_string();
            assert!(error.contains(evidence), "{error}");
        }
    }

    #[test]
    fn a_signal_of_another_length_is_refused() {
        let error = Trace::new("y", &[1.0, 2.0], &Timeline::new(1.0, 3)).unwrap_err();
        assert!(matches!(error, Error::Method(youla::Error::Shape { expected: (3, 1), found: (2, 1), .. })));
    }
}
