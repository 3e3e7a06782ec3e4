//! What is drawn of a log before anything is identified: outlines, spectra, coherence.

use crate::log::read;
use crate::refusal::{Refusal, Result};
use serde::Deserialize;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use youla::MatRef;
use youla::lti::Discrete;
use youla::signal::{ExcitedRecord, LoopRecord, Welch, cross_spectrum, indirect_response};
use youla_io::CsvOptions;
use youla_report::{Timeline, Trace};
use youla_run::{RunSettings, read_records};

/// Longest segment of a spectrum: 1024 frequencies are as many as a screen shows.
const WINDOW: usize = 2048;
/// Least number of segments whose coherence says something.
const SEGMENTS: usize = 8;

/// Columns to draw.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wanted {
    file: PathBuf,
    csv: CsvOptions,
    columns: Vec<String>,
    sample_time: f64,
}

/// Each column as its outline (row and value of minimum and maximum of each bucket) and its spectrum, root of the density.
pub(crate) fn traces(wanted: &Wanted) -> Result<Value> {
    let record = read(&wanted.file, &wanted.csv, &wanted.columns)?;
    let time = Discrete::new(wanted.sample_time)?;
    let clock = Timeline { detail: 0..0, ..Timeline::new(wanted.sample_time, record.samples()) };
    let welch = segments(record.samples());
    let mut curves = Vec::new();
    for (name, values) in wanted.columns.iter().zip(record.columns()) {
        let trace = Trace::new(name, values, &clock)?;
        let rows: Vec<usize> = trace.points().map(|(row, _)| row).collect();
        let x = MatRef::from_column_major_slice(values, values.len(), 1);
        let spectrum = cross_spectrum(x, x, time, &welch)?.density;
        let density: Vec<f64> = spectrum.entry(0, 0).iter().skip(1).map(|s| s.re.max(0.0).sqrt()).collect();
        let hz: Vec<f64> = spectrum.omega.iter().skip(1).map(|w| w / TAU).collect();
        curves.push(json!({ "name": name, "rows": rows, "values": trace.values, "hz": hz, "density": density }));
    }
    Ok(json!({ "samples": record.samples(), "curves": curves }))
}

fn segments(samples: usize) -> Welch {
    let window = (samples / SEGMENTS).clamp(16, WINDOW).min(samples.max(1));
    Welch { window, ..Welch::default() }
}

/// The part of the power of each channel that the known excitation explains, over the frequency; nothing where none is known.
pub(crate) fn coherence(toml: &str) -> Result<Value> {
    let settings = RunSettings::parse(toml, Path::new("run.toml"))?;
    let records = read_records(&settings.data, Path::new(""))?;
    let excitation = |r: &LoopRecord| r.excitation();
    let known: Option<Vec<_>> = records.estimation.iter().map(excitation).collect();
    let Some(known) = known.filter(|known| !known.is_empty()) else { return Ok(json!({ "curves": [] })) };
    let excited: Vec<ExcitedRecord<'_>> = records
        .estimation
        .iter()
        .zip(&known)
        .map(|(r, d)| ExcitedRecord { d: d.as_ref(), u: r.u(), y: r.y() })
        .collect();
    let shortest = records.estimation.iter().map(LoopRecord::samples).min().unwrap_or(0);
    let found = indirect_response(&excited, records.time, &segments(shortest)).map_err(Refusal::from)?;
    let hz: Vec<f64> = found.response.omega.iter().map(|w| w / TAU).collect();
    let column = |name: &str, of: &youla::Mat<f64>, j: usize| json!({ "name": name, "hz": hz, "coherence": of.col(j).iter().collect::<Vec<_>>() });
    let inputs = records.inputs.iter().enumerate().map(|(j, c)| column(&c.name, &found.coherence_u, j));
    let outputs = records.outputs.iter().enumerate().map(|(j, c)| column(&c.name, &found.coherence_y, j));
    Ok(json!({ "curves": inputs.chain(outputs).collect::<Vec<_>>() }))
}
