//! The file of a log: CSV, or Parquet by its ending.

use crate::output::Failure;
use std::path::Path;
use youla_io::{ColumnValues, ParquetWriter};
use youla_rig::{Description, LogRow, RowSink};

/// Rows of a group.
const GROUP: usize = 65_536;

/// A Parquet file with the columns of the CSV file: `t` in double, the signals in single precision.
pub(super) struct ParquetLog {
    /// Until the log is finished.
    file: Option<ParquetWriter>,
    times: Vec<f64>,
    signals: Vec<Vec<f32>>,
    status: Vec<i32>,
}

impl ParquetLog {
    pub(super) fn create(path: &Path, machine: &Description) -> Result<Self, Failure> {
        let columns = machine.columns();
        let file = ParquetWriter::create(path, &columns)?;
        let signals = vec![Vec::new(); columns.len().saturating_sub(2)];
        Ok(ParquetLog { file: Some(file), times: Vec::new(), signals, status: Vec::new() })
    }

    fn write(&mut self) -> std::io::Result<()> {
        let Some(file) = self.file.as_mut().filter(|_| !self.times.is_empty()) else { return Ok(()) };
        let signals = self.signals.iter().map(|values| ColumnValues::Float(values));
        let ends = (ColumnValues::Double(&self.times), ColumnValues::Integer(&self.status));
        let columns: Vec<ColumnValues<'_>> = [ends.0].into_iter().chain(signals).chain([ends.1]).collect();
        file.group(&columns).map_err(std::io::Error::other)?;
        self.times.clear();
        self.status.clear();
        self.signals.iter_mut().for_each(Vec::clear);
        Ok(())
    }
}

impl RowSink for ParquetLog {
    fn take(&mut self, row: &LogRow<'_>) -> std::io::Result<()> {
        self.times.push(row.time);
        self.signals.iter_mut().zip(row.values).for_each(|(signal, value)| signal.push(*value));
        self.status.push(row.status.bits().cast_signed());
        if self.times.len() >= GROUP { self.write() } else { Ok(()) }
    }

    fn finish(&mut self) -> std::io::Result<()> {
        self.write()?;
        self.file.take().map_or(Ok(()), |file| file.finish().map_err(std::io::Error::other))
    }
}
