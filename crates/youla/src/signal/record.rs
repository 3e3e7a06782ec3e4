//! The record: samples x channels with names, units and a sample time.

use super::Channel;
use super::channel::unknown;
use crate::linalg::check_shape;
use crate::lti::Discrete;
use crate::{Error, Result};
use faer::{Mat, MatRef};
use std::collections::HashSet;

/// Samples x channels, row k at time `start + k ts`; all values finite, all names different.
///
/// Data are stored by column, so one channel is one contiguous slice.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    channels: Vec<Channel>,
    data: Mat<f64>,
    time: Discrete,
    start: f64,
    name: String,
}

/// A record in two consecutive parts.
#[derive(Debug, Clone, PartialEq)]
pub struct SplitRecord {
    /// The first part.
    pub first: Record,
    /// The rest.
    pub second: Record,
}

impl Record {
    /// Builds a record that starts at time zero from `data` (samples x channels).
    ///
    /// # Errors
    /// [`Error::Shape`] unless there is one channel for each column and at least one sample,
    /// [`Error::DuplicateChannel`] for a repeated name, [`Error::NotFiniteSample`] with row and channel.
    ///
    /// ```
    /// use youla::{Mat, lti::Discrete, signal::{Channel, Record}};
    /// let channels = vec![Channel::new("u", "V"), Channel::new("y", "um")];
    /// let record = Record::new("test", channels, Mat::zeros(100, 2), Discrete::new(2e-4)?)?;
    /// assert_eq!(record.column("y")?.len(), 100);
    /// # Ok::<(), youla::Error>(())
    /// ```
    pub fn new(name: impl Into<String>, channels: Vec<Channel>, data: Mat<f64>, time: Discrete) -> Result<Self> {
        let name = name.into();
        check_shape(&format!("the data of {name}"), data.as_ref(), (data.nrows().max(1), channels.len().max(1)))?;
        let mut names = HashSet::new();
        for (j, channel) in channels.iter().enumerate() {
            if !names.insert(&channel.name) {
                return Err(Error::DuplicateChannel { what: name, name: channel.name.clone() });
            }
            if let Some(i) = (0..data.nrows()).find(|&i| !data[(i, j)].is_finite()) {
                return Err(Error::NotFiniteSample { what: name, channel: channel.name.clone(), row: i + 1 });
            }
        }
        Ok(Record { channels, data, time, start: 0.0, name })
    }

    /// The same record with its first sample at `start` seconds.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] unless `start` is finite.
    pub fn starting_at(mut self, start: f64) -> Result<Self> {
        if !start.is_finite() {
            return Err(Error::OutOfRange { what: "the start of a record".into(), value: start, must: "finite" });
        }
        self.start = start;
        Ok(self)
    }

    /// Name of the record, as it appears in messages and reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Names and units of the channels, in the order of the columns.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// All samples, samples x channels.
    pub fn data(&self) -> MatRef<'_, f64> {
        self.data.as_ref()
    }

    /// The clock.
    pub fn time(&self) -> Discrete {
        self.time
    }

    /// Time of the first sample, seconds.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Time of row k (counted from 0), seconds.
    pub fn time_at(&self, k: usize) -> f64 {
        self.start + k as f64 * self.time.ts()
    }

    /// Number of samples, at least one.
    pub fn samples(&self) -> usize {
        self.data.nrows()
    }

    /// One channel as a contiguous slice.
    ///
    /// # Errors
    /// [`Error::UnknownChannel`] with the known names and the most similar one.
    pub fn column(&self, name: &str) -> Result<&[f64]> {
        let j = self.index(name)?;
        Ok(self.data.col_as_slice(j))
    }

    /// All channels in their order, each as a contiguous slice.
    pub fn columns(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        (0..self.channels.len()).map(|j| self.data.col_as_slice(j))
    }

    /// The chosen channels as a matrix, samples x `names.len()`, in the order of `names`.
    ///
    /// # Errors
    /// [`Error::UnknownChannel`] with the known names and the most similar one.
    pub fn matrix(&self, names: &[&str]) -> Result<Mat<f64>> {
        let columns = names.iter().map(|name| self.index(name)).collect::<Result<Vec<_>>>()?;
        Ok(Mat::from_fn(self.samples(), columns.len(), |i, j| self.data[(i, columns[j])]))
    }

    /// The record of the chosen channels only, in the order of `names`.
    ///
    /// # Errors
    /// [`Error::UnknownChannel`], or [`Error::DuplicateChannel`] where a name is given twice.
    pub fn select(&self, names: &[&str]) -> Result<Record> {
        let data = self.matrix(names)?;
        let channels = names.iter().map(|name| Ok(self.channels[self.index(name)?].clone()));
        let channels = channels.collect::<Result<Vec<_>>>()?;
        Record::new(self.name.clone(), channels, data, self.time)?.starting_at(self.start)
    }

    /// Leaves out the first `skip` samples and keeps `take` after them, or all where `take` is `None`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] where the record is too short or nothing would be left.
    pub fn trim(&self, skip: usize, take: Option<usize>) -> Result<Record> {
        let left = self.samples().saturating_sub(skip);
        if left == 0 {
            return Err(self.too_short("samples to skip", skip, "less than the number of samples"));
        }
        match take {
            Some(n) if n == 0 || n > left => {
                Err(self.too_short("samples to take", n, "at least 1 and at most the samples left"))
            }
            _ => Ok(self.rows(skip, take.unwrap_or(left))),
        }
    }

    /// Cuts the record before row `at` (counted from 0), for example into one part to estimate and one to validate.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] where a part would be empty.
    pub fn split(&self, at: usize) -> Result<SplitRecord> {
        if at == 0 || at >= self.samples() {
            return Err(self.too_short("the row to split at", at, "inside of the record"));
        }
        Ok(SplitRecord { first: self.rows(0, at), second: self.rows(at, self.samples() - at) })
    }

    /// The same record with its columns changed in place, for the operations of this module.
    pub(super) fn map_columns(mut self, change: impl Fn(usize, &mut [f64])) -> Result<Record> {
        (0..self.channels.len()).for_each(|j| change(j, self.data.col_as_slice_mut(j)));
        Record::new(self.name, self.channels, self.data, self.time)?.starting_at(self.start)
    }

    fn index(&self, name: &str) -> Result<usize> {
        self.channels
            .iter()
            .position(|c| c.name == name)
            .ok_or_else(|| unknown(&self.name, name, self.channels.iter().map(|c| c.name.clone()).collect()))
    }

    fn rows(&self, first: usize, count: usize) -> Record {
        Record {
            channels: self.channels.clone(),
            data: self.data.as_ref().subrows(first, count).to_owned(),
            time: self.time,
            start: self.time_at(first),
            name: self.name.clone(),
        }
    }

    fn too_short(&self, what: &str, value: usize, must: &'static str) -> Error {
        let what = format!("{}: {what} (record of {} samples)", self.name, self.samples());
        Error::OutOfRange { what, value: value as f64, must }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        let channels = vec![Channel::new("u", "V"), Channel::new("y_a", "um")];
        let data = Mat::from_fn(10, 2, |i, j| (10 * j + i) as f64);
        Record::new("test", channels, data, Discrete::new(0.5).unwrap()).unwrap()
    }

    #[test]
    fn an_unknown_channel_names_the_nearest() {
        let message = record().column("ya").unwrap_err().to_string();
        assert_eq!(message, "test has no \"ya\" (did you mean \"y_a\"?); known: u, y_a");
    }

    #[test]
    fn construction_names_row_and_channel() {
        let mut data = Mat::zeros(3, 1);
        data[(2, 0)] = f64::NAN;
        let time = Discrete::new(1.0).unwrap();
        let error = Record::new("r", vec![Channel::new("u", "")], data, time).unwrap_err();
        assert!(matches!(error, Error::NotFiniteSample { row: 3, ref channel, .. } if channel == "u"), "{error}");
        let twice = vec![Channel::new("u", ""), Channel::new("u", "")];
        let error = Record::new("r", twice, Mat::zeros(3, 2), time).unwrap_err();
        assert!(matches!(error, Error::DuplicateChannel { .. }), "{error}");
        assert!(Record::new("r", vec![], Mat::zeros(3, 0), time).is_err());
        assert!(Record::new("r", vec![Channel::new("u", "")], Mat::zeros(0, 1), time).is_err());
    }

    #[test]
    fn parts_keep_their_time() {
        let record = record();
        let trimmed = record.trim(2, Some(3)).unwrap();
        assert_eq!((trimmed.start(), trimmed.samples(), trimmed.column("u").unwrap()), (1.0, 3, &[2.0, 3.0, 4.0][..]));
        let split = record.split(4).unwrap();
        assert_eq!((split.second.start(), split.second.samples()), (2.0, 6));
        for bad in [record.trim(10, None), record.trim(8, Some(3)), record.trim(0, Some(0))] {
            assert!(matches!(bad, Err(Error::OutOfRange { .. })));
        }
    }

    #[test]
    fn selection_orders_the_columns() {
        let record = record().select(&["y_a", "u"]).unwrap();
        assert_eq!(record.data()[(3, 0)], 13.0);
        assert_eq!(record.channels()[0].label(), "y_a [um]");
    }
}
