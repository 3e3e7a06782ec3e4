//! Records between NumPy and the library.

use crate::failure::Failure;
use crate::worker;
use numpy::{Complex64, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use std::path::PathBuf;
use youla::identify::likelihood::{ResponseTable, ResponseVariance};
use youla::lti::Discrete;
use youla::signal::{Channel, Record};
use youla::{Mat, c64};
use youla_io::{ChannelRef, ChannelRole, ChannelSpec, Source, StampedChannel, TimeSource};

/// A record as Python holds it: name, sample time, channels with name, unit and column, and an array of samples x columns.
pub(crate) type Log<'py> = (String, f64, Vec<(String, String, usize)>, PyReadonlyArray2<'py, f64>);

/// A measured response: angular frequencies, values `[frequency, row, column]`, their variances, whether these are known in full, and
/// whether it is that of the loop, rows u and y.
pub(crate) type TableIn<'py> =
    (PyReadonlyArray1<'py, f64>, PyReadonlyArray3<'py, Complex64>, Option<PyReadonlyArray3<'py, f64>>, bool, bool);

/// A measured response out of its arrays, and whether it is that of the loop.
pub(crate) fn table((omega, values, variance, known, of_loop): TableIn<'_>) -> (ResponseTable, bool) {
    let view = values.as_array();
    let (n, rows, columns) = view.dim();
    let value = |k: usize| Mat::from_fn(rows, columns, |i, j| c64::new(view[[k, i, j]].re, view[[k, i, j]].im));
    let variance = variance.map(|given| {
        let view = given.as_array();
        (0..n).map(|k| Mat::from_fn(rows, columns, |i, j| view[[k, i, j]])).collect()
    });
    let variance = match variance {
        None => ResponseVariance::Unknown,
        Some(all) if known => ResponseVariance::Known(all),
        Some(all) => ResponseVariance::Proportional(all),
    };
    let omega = omega.as_array().to_vec();
    (ResponseTable { omega, values: (0..n).map(value).collect(), variance }, of_loop)
}

/// Copies records out of their arrays, which are only read.
pub(crate) fn records(py: Python<'_>, logs: Vec<Log<'_>>) -> PyResult<Vec<Record>> {
    let one = |(name, ts, channels, data): Log<'_>| -> PyResult<Record> {
        let view = data.as_array();
        let record = py.detach(|| {
            if let Some((channel, _, column)) = channels.iter().find(|(_, _, column)| *column >= view.ncols()) {
                let columns = view.ncols();
                let what = format!("channel {channel:?} is column {column}, but the array has {columns} columns");
                return Err(Failure::input(what));
            }
            let matrix = Mat::from_fn(view.nrows(), channels.len(), |i, j| view[[i, channels[j].2]]);
            let channels = channels.iter().map(|(name, unit, _)| Channel::new(name, unit)).collect();
            Ok::<_, Failure>(Record::new(name, channels, matrix, Discrete::new(ts)?)?)
        });
        Ok(record?)
    };
    logs.into_iter().map(one).collect()
}

/// A record that was read: rows, sample time, names and units.
type ReadLog<'py> = (Bound<'py, numpy::PyArray2<f64>>, f64, Vec<(String, String)>);

/// Reads a file: text, MATLAB or NumPy. Channels are name, place in the file and unit.
#[pyfunction]
#[pyo3(signature = (path, channels, time, dt))]
pub(crate) fn read_log<'py>(
    py: Python<'py>,
    path: PathBuf,
    channels: Vec<(String, String, String)>,
    time: Option<String>,
    dt: Option<f64>,
) -> PyResult<ReadLog<'py>> {
    let record = worker::run(py, false, move |_| {
        let time = TimeSource { column: time.as_deref().map(column), ts: dt, ..TimeSource::default() };
        let spec = |(name, from, unit): &(String, String, String)| ChannelSpec::from(name, column(from), unit);
        let channels = channels.iter().map(spec).collect();
        let source = Source { path, format: Default::default(), time, channels, csv: Default::default() };
        youla_io::read(&source).map_err(of_log)
    })?;
    let channels = record.channels().iter().map(|c| (c.name.clone(), c.unit.clone())).collect();
    Ok((crate::matrices::array(py, record.data()), record.time().ts(), channels))
}

fn column(place: &str) -> ChannelRef {
    place.parse().unwrap_or_else(|never: std::convert::Infallible| match never {})
}

/// What is wrong with a log, with the remedy in the words of Python in place of those of run.toml, which follow a semicolon.
fn of_log(error: youla_io::Error) -> Failure {
    use youla_io::Error;
    let frame = || "read it with pandas.read_csv (sep=, decimal=, skiprows=) and give the data frame".to_owned();
    let remedy = match &error {
        Error::TimeUnit { to_seconds, .. } => format!(
            "leave time out and give the sample time as dt=, or give a mapping with a column of seconds (the column {to_seconds})"
        ),
        Error::NonUniformTime { .. } => {
            "cut at gaps and give identify a list of records, or bring it to one clock: youla.Channels(frame, time=...).synchronise(dt=...)".into()
        }
        Error::Cell { .. } | Error::FieldCount { .. } | Error::Delimiter { .. } => frame(),
        _ => return error.into(),
    };
    let text = error.to_string();
    Failure::input(format!("{}; {remedy}", text.split("; ").next().unwrap_or(&text)))
}

/// The unit that the heading of a time column states, other than seconds, and how seconds are made of it.
#[pyfunction]
pub(crate) fn unit_of_time(heading: &str) -> Option<(&'static str, &'static str)> {
    youla_io::unit_of_time(heading)
}

/// The sample time that a time column shows; `dt` must agree with it where it is given.
#[pyfunction]
#[pyo3(signature = (what, times, dt))]
pub(crate) fn clock(what: &str, times: PyReadonlyArray1<'_, f64>, dt: Option<f64>) -> PyResult<f64> {
    let times: Vec<f64> = times.as_array().iter().copied().collect();
    let time = TimeSource { ts: dt, ..TimeSource::default() }.of_column(what, &times);
    Ok(time.map_err(Failure::from)?.ts())
}

/// A channel with its own time stamps: name, unit, role, whether it is written when it changes, times, values.
type Stamped<'py> = (String, String, String, bool, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);

/// Records and their beginnings, timing of the channels as JSON, drift of the clock, rows left out.
type SynchronisedOut<'py> = (Vec<(Bound<'py, numpy::PyArray2<f64>>, f64)>, String, f64, usize);

/// Brings channels to the clock of the controller.
#[pyfunction]
pub(crate) fn synchronise<'py>(
    py: Python<'py>,
    name: String,
    channels: Vec<Stamped<'py>>,
    dt: f64,
) -> PyResult<SynchronisedOut<'py>> {
    let one = |(name, unit, role, changes_only, times, values): Stamped<'_>| {
        let role = match role.as_str() {
            "inputs" => ChannelRole::Input,
            "outputs" => ChannelRole::Output,
            _ => ChannelRole::External,
        };
        let of = |array: PyReadonlyArray1<'_, f64>| array.as_array().to_vec();
        StampedChannel { channel: Channel::new(name, unit), role, changes_only, times: of(times), values: of(values) }
    };
    let channels: Vec<StampedChannel> = channels.into_iter().map(one).collect();
    let found = worker::run(py, false, move |_| Ok(youla_io::synchronise(&name, &channels, Discrete::new(dt)?)?))?;
    let timing = serde_json::to_string(&found.timing).map_err(Failure::from)?;
    let records = found.records.iter().map(|r| (crate::matrices::array(py, r.data()), r.start())).collect();
    Ok((records, timing, found.drift, found.left_out))
}
