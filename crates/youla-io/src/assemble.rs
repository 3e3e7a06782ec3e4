//! From columns and a clock to records.

use crate::error::{Error, Result};
use crate::time::Clock;
use youla::Mat;
use youla::signal::{Channel, Record};

/// The record of a file that must have no gaps.
pub(super) fn only(mut parts: Vec<Record>) -> Result<Record> {
    if let [first, second, ..] = &parts[..] {
        let (what, row, ts) = (first.name().to_owned(), first.samples() + 1, first.time().ts());
        return Err(Error::NonUniformTime { what, row, dt: second.start() - first.time_at(first.samples() - 1), ts });
    }
    Ok(parts.remove(0))
}

/// Largest magnitude of a value, and the least one of the largest value of a channel; sums and products of squares of larger ones
/// overflow, of smaller ones vanish.
const LARGEST: f64 = 1e100;
const LEAST: f64 = 1e-100;

/// The records, one for each part without gaps, of columns of equal length.
pub(super) fn assemble(what: &str, channels: Vec<Channel>, columns: &[Vec<f64>], clock: Clock) -> Result<Vec<Record>> {
    let samples = columns.first().map_or(0, Vec::len);
    for (channel, column) in channels.iter().zip(columns) {
        if column.len() != samples {
            let (what, channel, found) = (what.to_owned(), channel.name.clone(), column.len());
            return Err(Error::UnequalLength { what, channel, found, expected: samples });
        }
    }
    for (channel, column) in channels.iter().zip(columns) {
        if let Some(row) = column.iter().position(|v| v.is_finite() && v.abs() > LARGEST) {
            let what = format!("{what}: channel {:?} in row {} (counted from 1)", channel.name, row + 1);
            let must = "at most 1e100 in magnitude; check its unit and the type of the numbers in the file";
            return Err(Error::Method(youla::Error::OutOfRange { what, value: column[row], must }));
        }
        let largest = column.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        if largest > 0.0 && largest < LEAST {
            let what = format!("{what}: the largest value of channel {:?}", channel.name);
            let must = "at least 1e-100 in magnitude, or zero; check its unit and the type of the numbers in the file";
            return Err(Error::Method(youla::Error::OutOfRange { what, value: largest, must }));
        }
    }
    let ends = clock.parts.iter().skip(1).map(|part| part.0).chain([samples]);
    let part = |(&(from, start), to): (&(usize, f64), usize)| {
        let mut data = Mat::zeros(to - from, columns.len());
        for (j, column) in columns.iter().enumerate() {
            data.col_as_slice_mut(j).copy_from_slice(&column[from..to]);
        }
        Ok(Record::new(what, channels.clone(), data, clock.time)?.starting_at(start)?)
    };
    clock.parts.iter().zip(ends).map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::TimeSource;

    /// Such values come from a wrong type of numbers; a search on them did not converge "after 0 iterations".
    #[test]
    fn channels_of_denormal_numbers_are_refused() {
        let clock = || TimeSource::ts(1.0).resolve("log", None).unwrap();
        let of = |v: f64| assemble("log", vec![Channel::new("y", "")], &[vec![v, -v, 0.0]], clock());
        let error = of(1e-310).unwrap_err().to_string();
        assert!(
            error.starts_with("log: the largest value of channel \"y\" is 1e-310, but must be at least 1e-100"),
            "{error}"
        );
        assert!(of(0.0).is_ok() && of(1e-99).is_ok());
    }
}
