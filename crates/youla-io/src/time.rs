//! The sample time of a file: declared, taken from a time column, or both, in which case they must agree.

use crate::assemble::assemble;
use crate::choose::ChannelRef;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use youla::error::Seconds;
use youla::lti::Discrete;
use youla::signal::StampSteps;

/// Where the sample time comes from; one of `column` and `ts` at least.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TimeSource {
    /// Column with the time in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<ChannelRef>,
    /// Sample time in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ts: Option<f64>,
    /// Greatest deviation of a step of the time column from the sample time, as a part of the sample time.
    pub tolerance: f64,
    /// What to do where the time column has a gap.
    pub gaps: Gaps,
}

/// Words of a name that state a unit of time, how seconds are made of it, and how many of it a second is.
const UNITS: [(&[&str], &str, &str, f64); 5] = [
    (&["ms", "msec", "msecs", "millis", "millisecond", "milliseconds"], "milliseconds", "/ 1e3", 1e3),
    (
        &["us", "\u{b5}s", "\u{3bc}s", "usec", "usecs", "micros", "microsecond", "microseconds"],
        "microseconds",
        "/ 1e6",
        1e6,
    ),
    (&["ns", "nsec", "nsecs", "nanos", "nanosecond", "nanoseconds"], "nanoseconds", "/ 1e9", 1e9),
    (&["min", "mins", "minute", "minutes"], "minutes", "* 60", 1.0 / 60.0),
    (&["h", "hr", "hrs", "hour", "hours"], "hours", "* 3600", 1.0 / 3600.0),
];
/// Ticks of 100 ns in a second, which clocks of controllers count.
const TICKS: f64 = 1e7;

/// The unit of time that a heading or a cell of a line of units states, and how seconds are made of it; `None` for seconds and where it
/// states none. `t_ms`, `time [ms]`, `Time(us)` and `timeMs` state one.
///
/// ```
/// assert_eq!(youla_io::unit_of_time("time [ms]"), Some(("milliseconds", "/ 1e3")));
/// assert_eq!(youla_io::unit_of_time("systems"), None);
/// ```
pub fn unit_of_time(heading: &str) -> Option<(&'static str, &'static str)> {
    stated_unit(heading).map(|(_, unit, to_seconds, _)| (*unit, *to_seconds))
}

fn stated_unit(heading: &str) -> Option<&'static (&'static [&'static str], &'static str, &'static str, f64)> {
    let words = words_of(heading);
    UNITS.iter().find(|(names, ..)| words.split(' ').any(|word| names.contains(&word)))
}

/// The words of a heading in small letters, a blank between two.
fn words_of(heading: &str) -> String {
    let mut words = String::new();
    for c in heading.chars() {
        if c.is_uppercase() && words.ends_with(char::is_lowercase) {
            words.push(' ');
        }
        words.push(if c.is_alphanumeric() { c } else { ' ' });
    }
    words.to_lowercase()
}

/// Words by which a column names itself a clock.
const CLOCKS: [&str; 7] = ["t", "time", "timestamp", "zeit", "temps", "tiempo", "tempo"];

/// Whether a column names itself a clock.
pub(super) fn is_clock(heading: &str) -> bool {
    words_of(heading).split(' ').any(|word| CLOCKS.contains(&word))
}

/// Refuses a column of a file that names itself a clock, rises evenly, and contradicts the declared sample time: in the unit that its heading
/// states, else in every unit of time, a counter of rows rising by 1.
pub(super) fn require_agreement(what: &str, column: &str, times: &[f64], ts: f64) -> Result<()> {
    let Some(step) = uniform_step(times) else { return Ok(()) };
    let near = |expected: f64| (step / expected - 1.0).abs() < UNIFORM;
    let in_any_unit = || UNITS.iter().map(|(.., per_second)| per_second).chain([&1.0, &TICKS]).any(|of| near(of * ts));
    if stated_unit(column).map_or_else(|| near(1.0) || in_any_unit(), |(.., per_second)| near(per_second * ts)) {
        return Ok(());
    }
    let problem = format!(
        "column {column:?} rises by {} in each row, but the sample time is declared as {} s; correct sample_time in [data] (--sample-time), or name \
         the column instead of it (time_column, --time); give the column another name in the file where it is no clock",
        Seconds(step),
        Seconds(ts)
    );
    Err(Error::Clock { what: what.to_owned(), problem })
}

/// Greatest deviation of a step of a clock that rises evenly, as a part of the mean step.
const UNIFORM: f64 = 1e-3;

/// The mean step of a column that rises evenly.
pub(super) fn uniform_step(values: &[f64]) -> Option<f64> {
    let steps = StampSteps::of(values, UNIFORM)?;
    let even = values.windows(2).all(|pair| (pair[1] - pair[0] - steps.mean).abs() <= steps.slack);
    (steps.mean > 0.0 && even).then_some(steps.mean)
}

/// Refuses a column of the time where `heading`, its name or its cell of a line of units, states another unit than the second.
pub(super) fn require_seconds(what: &str, column: &str, heading: &str) -> Result<()> {
    let Some((unit, to_seconds)) = unit_of_time(heading) else { return Ok(()) };
    let by = if heading == column { "name" } else { "line of units" };
    Err(Error::TimeUnit { what: what.to_owned(), column: column.to_owned(), unit, by, to_seconds })
}

/// What to do where samples are missing, by the time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Gaps {
    /// Reject the file with the row of the gap.
    #[default]
    Refuse,
    /// Split the file there into separate records. Steps that are too short or negative are rejected.
    Split,
}

impl Default for TimeSource {
    fn default() -> Self {
        TimeSource { column: None, ts: None, tolerance: 1e-3, gaps: Gaps::Refuse }
    }
}

impl TimeSource {
    /// A declared sample time in seconds.
    pub fn ts(ts: f64) -> Self {
        TimeSource { ts: Some(ts), ..Self::default() }
    }

    /// A time column in seconds.
    pub fn column(column: ChannelRef) -> Self {
        TimeSource { column: Some(column), ..Self::default() }
    }

    /// The sample time that a time column in memory shows; `what` names it in errors.
    ///
    /// # Errors
    /// [`Error::SampleTimeMissing`] for less than two rows, [`Error::NonUniformTime`] with the first bad row,
    /// [`youla::Error::SampleTimeMismatch`] where column and declaration disagree.
    pub fn of_column(&self, what: &str, times: &[f64]) -> Result<Discrete> {
        Ok(self.resolve(what, Some(times))?.time)
    }

    /// A record cut and timed by a time column in memory, as a file is by a column of its own.
    ///
    /// # Errors
    /// Those of [`TimeSource::of_column`].
    pub fn cut(&self, record: &youla::signal::Record, times: &[f64]) -> Result<Vec<youla::signal::Record>> {
        let columns: Vec<Vec<f64>> = record.columns().map(<[f64]>::to_vec).collect();
        assemble(record.name(), record.channels().to_vec(), &columns, self.resolve(record.name(), Some(times))?)
    }

    /// Refuses a time column whose name states another unit than the second: a sample time that is a thousand times too long would be
    /// taken in silence. `what` names the log.
    ///
    /// # Errors
    /// [`Error::TimeUnit`].
    pub fn check_unit(&self, what: &str) -> Result<()> {
        let Some(ChannelRef::Name(column)) = &self.column else { return Ok(()) };
        require_seconds(what, column, column)
    }

    /// The clock and the parts without gaps from the time column, which is there when `self.column` is set.
    ///
    /// # Errors
    /// [`Error::SampleTimeMissing`], [`Error::NonUniformTime`] with the first bad row, [`youla::Error::SampleTimeMismatch`]
    /// where column and declaration disagree, [`youla::Error::OutOfRange`] for a bad `ts` or `tolerance`.
    pub(super) fn resolve(&self, what: &str, column: Option<&[f64]>) -> Result<Clock> {
        self.check_unit(what)?;
        if !(self.tolerance >= 0.0 && self.tolerance < 1.0) {
            let what = format!("{what}: the tolerance of the time column");
            return Err(Error::Method(youla::Error::OutOfRange {
                what,
                value: self.tolerance,
                must: "at least 0 and below 1",
            }));
        }
        match (column, self.ts) {
            (None, None) => Err(Error::SampleTimeMissing { what: what.to_owned() }),
            (None, Some(ts)) => Ok(Clock::whole(Discrete::new(ts)?, 0.0)),
            (Some(times @ ([] | [_])), Some(ts)) => {
                Ok(Clock::whole(Discrete::new(ts)?, times.first().copied().unwrap_or(0.0)))
            }
            (Some([] | [_]), None) => Err(Error::SampleTimeMissing { what: what.to_owned() }),
            (Some(times), declared) => self.measured(what, times, declared),
        }
    }

    fn measured(&self, what: &str, times: &[f64], declared: Option<f64>) -> Result<Clock> {
        let Some(steps) = StampSteps::of(times, self.tolerance) else {
            return Err(Error::SampleTimeMissing { what: what.to_owned() });
        };
        require_rising(what, times, steps.median)?;
        let ts = declared.unwrap_or(steps.mean);
        if (steps.mean - ts).abs() > self.tolerance * ts {
            let what = format!("{what}, declared sample time and time column");
            return Err(Error::Method(youla::Error::SampleTimeMismatch { what, left: ts, right: steps.mean }));
        }
        Ok(Clock { time: Discrete::new(ts)?, parts: self.parts(what, times, ts, steps.slack)? })
    }

    /// First row (from 0) and time of each part without gaps.
    fn parts(&self, what: &str, times: &[f64], ts: f64, slack: f64) -> Result<Vec<(usize, f64)>> {
        let mut parts = vec![(0, times[0])];
        for (k, step) in times.windows(2).enumerate() {
            let dt = step[1] - step[0];
            match (dt - ts).abs() <= slack {
                true => {}
                false if self.gaps == Gaps::Split && dt > ts => parts.push((k + 1, step[1])),
                false => return Err(Error::NonUniformTime { what: what.to_owned(), row: k + 2, dt, ts }),
            }
        }
        Ok(parts)
    }
}

/// Refuses stamps of which most repeat, because they lack digits, or fall.
fn require_rising(what: &str, times: &[f64], middle: f64) -> Result<()> {
    let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    let problem = match middle {
        rising if rising > 0.0 => return Ok(()),
        0.0 if mean > 0.0 => format!(
            "several rows share each stamp, which lacks digits; state the sample time in place of the time column (sample_time in [data], \
             --sample-time), the mean step is {} s",
            Seconds(mean)
        ),
        falling if falling < 0.0 && mean < 0.0 => "the newest row comes first; sort the rows".to_owned(),
        _ => "this column is no clock; name the one with the time".to_owned(),
    };
    Err(Error::NotRising { what: what.to_owned(), problem })
}

/// Sample time, and first row (from 0) and time of each part without gaps.
#[derive(Debug)]
pub(super) struct Clock {
    pub(super) time: Discrete,
    pub(super) parts: Vec<(usize, f64)>,
}

impl Clock {
    fn whole(time: Discrete, start: f64) -> Self {
        Clock { time, parts: vec![(0, start)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(n: usize, ts: f64) -> Vec<f64> {
        (0..n).map(|k| 0.3 + k as f64 * ts).collect()
    }

    #[test]
    fn the_sample_time_survives_the_time_column() {
        for ts in [0.002, 1.0 / 5000.0, 2.5e-4, 0.08] {
            let clock = TimeSource::default().resolve("t", Some(&times(1000, ts))).unwrap();
            assert_eq!(clock.time.ts(), ts);
        }
        let third = TimeSource::default().resolve("t", Some(&times(1000, 1.0 / 3.0))).unwrap().time.ts();
        assert!((third - 1.0 / 3.0).abs() < 1e-15);
    }

    /// Seconds since 1970 with so many decimals: the rounding of the stamps changes no sample time, and jitter is still jitter.
    #[test]
    fn rounding_of_the_stamps_does_not_matter() {
        let stamps = |ts: f64, per_second: f64, jitter: &dyn Fn(u32) -> f64| -> Result<f64> {
            let stamp = |k| 1_764_352_842.0 + ((f64::from(k) * ts + jitter(k)) * per_second).round() / per_second;
            let times: Vec<f64> = (0..20_000).map(stamp).collect();
            Ok(TimeSource::default().resolve("t", Some(&times))?.time.ts())
        };
        for (ts, per_second) in [(1e-3, 1e3), (5e-5, 1e6), (2e-4, 1e6), (0.02, 1e2)] {
            assert_eq!(stamps(ts, per_second, &|_| 0.0).unwrap(), ts);
        }
        assert!((stamps(1.0 / 150.0, 1e3, &|_| 0.0).unwrap() * 150.0 - 1.0).abs() < 1e-5);
        let error = stamps(0.005, 1e3, &|k| [0.0, 1e-3][usize::from(k % 7 == 3)]).unwrap_err();
        assert!(matches!(error, Error::NonUniformTime { row: 4 | 5, .. }), "{error}");
        // A clock that wanders by more than the rounding, each step within it.
        assert!(stamps(1.0 / 150.0, 1e3, &|k| 0.02 * (f64::from(k) / 3e3).sin()).is_err());
    }

    #[test]
    fn a_column_that_is_named_in_milliseconds_is_refused() {
        let of = |name: &str| TimeSource::column(ChannelRef::Name(name.into())).resolve("log", Some(&times(100, 0.5)));
        for (name, unit) in [
            ("t_ms", "milliseconds"),
            ("Time [ms]", "milliseconds"),
            ("time(\u{b5}s)", "microseconds"),
            ("t/ns", "nanoseconds"),
            ("timestampUs", "microseconds"),
            ("Time [min]", "minutes"),
        ] {
            let error = of(name).unwrap_err().to_string();
            assert!(error.starts_with("log: ") && error.contains(unit), "{error}");
            assert!(error.contains("sample_time in [data]"), "{error}");
        }
        assert!(["t", "time", "t_s", "systems", "Time [s]"].iter().all(|name| of(name).is_ok()));
    }

    #[test]
    fn a_gap_splits_where_this_is_asked_for() {
        let mut gap = times(100, 0.1);
        gap.drain(60..63);
        let split = TimeSource { gaps: Gaps::Split, ..TimeSource::default() };
        let clock = split.resolve("t", Some(&gap)).unwrap();
        assert_eq!((clock.parts, clock.time.ts()), (vec![(0, 0.3), (60, 0.3 + 63.0 * 0.1)], 0.1));
        gap[70] = gap[69];
        let error = split.resolve("t", Some(&gap)).unwrap_err();
        assert!(matches!(error, Error::NonUniformTime { row: 71, .. }), "{error}");
    }

    #[test]
    fn a_gap_is_reported_at_its_row() {
        let mut gap = times(100, 0.1);
        gap.remove(60);
        let error = TimeSource::default().resolve("t", Some(&gap)).unwrap_err();
        assert!(matches!(error, Error::NonUniformTime { row: 61, .. }), "{error}");
        let error = TimeSource::ts(0.1).resolve("t", Some(&times(100, 0.2))).unwrap_err();
        assert!(matches!(error, Error::Method(youla::Error::SampleTimeMismatch { .. })), "{error}");
        assert!(TimeSource::default().resolve("t", Some(&[0.0, 0.0, 0.0])).is_err());
        assert!(TimeSource::default().resolve("t", None).is_err());
        assert!(TimeSource::default().resolve("t", Some(&[1.0])).is_err());
        assert_eq!(TimeSource::ts(0.1).resolve("t", Some(&[])).unwrap().parts, [(0, 0.0)]);
    }
}
