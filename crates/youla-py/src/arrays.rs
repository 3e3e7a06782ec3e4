//! Subspace identification straight from NumPy arrays: no copy of a record is made.

use crate::failure::Failure;
use crate::logs::Log;
use crate::worker::{self, Stop};
use faer::MatMut;
use numpy::ndarray::{ArrayView2, Axis, Slice};
use pyo3::prelude::*;
use youla::Error;
use youla::identify::subspace::{SubspaceModel, SubspaceOptions, subspace_stream};
use youla::lti::Discrete;
use youla::signal::{JoinedStreams, SampleStream};

use youla_run::DataSettings;

/// A record in an array of samples x columns, its means taken out.
struct ArrayStream<'a> {
    name: &'a str,
    rows: ArrayView2<'a, f64>,
    /// Name, column and mean of each input, then of each output.
    channels: Vec<(&'a str, usize, f64)>,
    inputs: usize,
    next: usize,
    stop: &'a Stop,
}

/// Name, channels and rows of a record.
type View<'a> = (String, Vec<(String, String, usize)>, ArrayView2<'a, f64>);

impl<'a> ArrayStream<'a> {
    /// `None` where a channel is no column of the array.
    fn new(log: &'a View<'a>, data: &'a DataSettings, stop: &'a Stop) -> Option<Self> {
        let (name, columns, rows) = log;
        let chosen = data.inputs.iter().chain(&data.outputs).map(|channel| {
            let column = columns.iter().find(|(of, _, _)| *of == channel.name)?.2;
            let mean = rows.columns().into_iter().nth(column)?.sum() / rows.nrows() as f64;
            Some((channel.name.as_str(), column, mean))
        });
        let channels = chosen.collect::<Option<_>>()?;
        Some(ArrayStream { name, rows: *rows, channels, inputs: data.inputs.len(), next: 0, stop })
    }
}

impl SampleStream for ArrayStream<'_> {
    fn inputs(&self) -> usize {
        self.inputs
    }

    fn outputs(&self) -> usize {
        self.channels.len() - self.inputs
    }

    fn rewind(&mut self) -> youla::Result<()> {
        self.next = 0;
        Ok(())
    }

    fn read(&mut self, mut rows: MatMut<'_, f64>) -> youla::Result<usize> {
        self.stop.announce();
        let count = rows.nrows().min(self.rows.nrows() - self.next);
        let piece = self.rows.slice_axis(Axis(0), Slice::from(self.next..self.next + count));
        for (k, row) in piece.rows().into_iter().enumerate() {
            for (j, &(channel, column, mean)) in self.channels.iter().enumerate() {
                let value = row[column];
                if !value.is_finite() {
                    let (what, channel, row) = (self.name.to_owned(), channel.to_owned(), self.next + k + 1);
                    return Err(Error::NotFiniteSample { what, channel, row });
                }
                rows[(k, j)] = value - mean;
            }
        }
        self.next += count;
        Ok(count)
    }

    fn next_experiment(&mut self) -> youla::Result<bool> {
        Ok(false)
    }
}

/// The model of the records in their arrays; `None` where options or records need a copy in memory.
pub(crate) fn in_place(
    py: Python<'_>,
    logs: &[Log<'_>],
    data: &DataSettings,
    options: &SubspaceOptions,
) -> PyResult<Option<SubspaceModel>> {
    let Some(time) = logs.first().map(|log| log.1).filter(|ts| logs.iter().all(|log| log.1 == *ts)) else {
        return Ok(None);
    };
    let views: Vec<View<'_>> = logs.iter().map(|log| (log.0.clone(), log.2.clone(), log.3.as_array())).collect();
    worker::run_borrowed(py, |stop| {
        let streams: Option<Vec<_>> = views.iter().map(|view| ArrayStream::new(view, data, stop)).collect();
        let Some(streams) = streams else { return Ok(None) };
        match subspace_stream(&mut JoinedStreams::new(streams)?, Discrete::new(time)?, options) {
            // What needs all samples at once.
            Err(Error::Unsupported { .. }) => Ok(None),
            found => Ok::<_, Failure>(Some(found?)),
        }
    })
}
