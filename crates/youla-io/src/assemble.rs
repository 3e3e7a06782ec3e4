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

/// Largest magnitude of a value; the squares and sums of larger ones overflow.
const LARGEST: f64 = 1e100;

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
