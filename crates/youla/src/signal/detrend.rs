//! Removal of offsets and drifts, and what was removed.
//!
//! Least squares for each channel: `y(k) = offset + slope k ts + rest(k)`, k counted from the first row.

use super::Record;
use crate::Result;

/// What to take out of every channel.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Detrend {
    /// Nothing.
    None,
    /// The mean.
    #[default]
    Mean,
    /// The straight line of least squares.
    Linear,
}

/// The line that was taken out of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Trend {
    /// Its value at the first sample, in the unit of the channel.
    pub offset: f64,
    /// Its slope, unit of the channel per second.
    pub slope: f64,
}

/// A record without its trends.
#[derive(Debug, Clone, PartialEq)]
pub struct Detrended {
    /// What is left.
    pub record: Record,
    /// What was taken out of each channel.
    pub removed: Vec<Trend>,
}

impl Record {
    /// Takes the mean or the straight line of least squares out of every channel.
    ///
    /// # Errors
    /// [`crate::Error::NotFiniteSample`] where values near the largest number overflow.
    pub fn detrend(self, kind: Detrend) -> Result<Detrended> {
        let ts = self.time().ts();
        let removed: Vec<Trend> = self.columns().map(|values| trend(values, ts, kind)).collect();
        let line = |i: usize, trend: &Trend| trend.offset + trend.slope * (i as f64 * ts);
        let record = self.map_columns(|j, column| {
            column.iter_mut().enumerate().for_each(|(i, value)| *value -= line(i, &removed[j]));
        })?;
        Ok(Detrended { record, removed })
    }
}

/// Least squares with the time counted from the middle, so that mean and slope are orthogonal.
fn trend(values: &[f64], ts: f64, kind: Detrend) -> Trend {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let middle = (n - 1.0) / 2.0;
    match kind {
        Detrend::None => Trend { offset: 0.0, slope: 0.0 },
        Detrend::Linear if n > 1.0 => {
            let moment: f64 = values.iter().enumerate().map(|(k, y)| (k as f64 - middle) * (y - mean)).sum();
            let per_sample = moment / (n * (n * n - 1.0) / 12.0);
            Trend { offset: mean - per_sample * middle, slope: per_sample / ts }
        }
        _ => Trend { offset: mean, slope: 0.0 },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mat, lti::Discrete, signal::Channel};

    #[test]
    fn a_line_is_removed_and_returned() {
        let data = Mat::from_fn(101, 1, |i, _| 3.0 - 2.0 * (i as f64 * 0.1) + if i % 2 == 0 { 0.5 } else { -0.5 });
        let record = Record::new("line", vec![Channel::new("y", "m")], data, Discrete::new(0.1).unwrap()).unwrap();
        let out = record.clone().detrend(Detrend::Linear).unwrap();
        assert!((out.removed[0].slope + 2.0).abs() < 1e-12, "{:?}", out.removed);
        assert!((out.removed[0].offset - (3.0 + 0.5 / 101.0)).abs() < 1e-12, "{:?}", out.removed);
        let again = out.record.clone().detrend(Detrend::Linear).unwrap();
        assert!(again.removed[0].slope.abs() < 1e-13 && again.removed[0].offset.abs() < 1e-13);
        assert_eq!(record.clone().detrend(Detrend::None).unwrap().record, record);
    }
}
