//! The records of a run: read, cut, detrended, and split by the meaning of their channels.

pub(crate) mod disturbance;
pub(crate) mod measured;
pub(crate) mod segments;

use crate::records::disturbance::disturbance_signals;
use crate::records::measured::{MeasuredTable, read_measured};
use crate::records::segments::{Part, RecordSegment, parts};
use crate::settings::computed::ComputedChannels;
use crate::settings::{DataFile, DataSettings, DisturbanceSettings};
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::HashSet;
use std::path::Path;
use youla::MatRef;
use youla::identify::likelihood::ResponseTable;
use youla::identify::subspace::Experiment;
use youla::lti::{Discrete, StateSpace};
use youla::signal::{Channel, LoopRecord, Record};
use youla_io::{ChannelSpec, Format, Source, TimeSource, read_parts, sha256, sha256_of};
pub use youla_report::data::SourceFile;

/// All records of a run.
#[derive(Debug, Clone)]
pub struct RunRecords {
    /// Clock common to all records.
    pub time: Discrete,
    /// Plant inputs.
    pub inputs: Vec<Channel>,
    /// Plant outputs.
    pub outputs: Vec<Channel>,
    /// Records to identify from.
    pub estimation: Vec<LoopRecord>,
    /// Records to verify on.
    pub verification: Vec<LoopRecord>,
    /// Where they came from.
    pub sources: Vec<SourceFile>,
    /// The records that are parts of a file, cut at gaps or as the settings say.
    pub segments: Vec<RecordSegment>,
    /// The response that was measured instead of estimation records.
    pub measured: Option<MeasuredTable>,
    /// The plant itself, known in simulations only.
    pub true_plant: Option<StateSpace<Discrete>>,
}

impl RunRecords {
    /// Root mean square of each input and of each output over the estimation records, 1 for a channel that is zero throughout; of a
    /// measured response over its frequencies.
    pub fn sizes(&self) -> (Vec<f64>, Vec<f64>) {
        if let Some(measured) = &self.measured {
            return measured.sizes(self.inputs.len());
        }
        let estimation = self.estimation.iter();
        let u = rms(estimation.clone().map(LoopRecord::u), self.inputs.len());
        (u, rms(estimation.map(LoopRecord::y), self.outputs.len()))
    }

    /// The estimation records as (u, y), with their known lines.
    pub fn experiments(&self) -> Vec<Experiment<'_>> {
        self.estimation.iter().map(Experiment::from).collect()
    }
}

/// Reads all records that the settings name, files in parallel; paths are relative to `folder`.
///
/// # Errors
/// [`youla_io::Error::Settings`] as of [`DataSettings::check`]; the first bad file in the order of the settings, with what is wrong in it; sample times that differ between files.
pub fn read_records(settings: &DataSettings, folder: &Path) -> Result<RunRecords> {
    settings.check()?;
    let read: Vec<Result<FileRecords>> = settings
        .labelled()
        .into_par_iter()
        .enumerate()
        .map(|(k, (label, file))| read_file(settings, folder, (purpose(settings, k), &label), file))
        .collect();
    let measured = settings.response.first().map(|file| read_measured(settings, folder, file)).transpose()?;
    assembled(settings, read.into_iter().collect::<Result<_>>()?, measured)
}

/// The records of a run from logs in memory, one for each file that the settings name, in their order; the channels of a log have the
/// names of those of the settings.
///
/// # Errors
/// As [`read_records`]; [`youla::Error::Ports`] unless there is one log for each file.
pub fn records_in_memory(settings: &DataSettings, logs: Vec<Record>) -> Result<RunRecords> {
    settings.check()?;
    let files = settings.labelled();
    if files.len() != logs.len() {
        let what = "the number of records in memory".into();
        return Err(Error::Method(youla::Error::Ports { what, expected: files.len(), found: logs.len() }));
    }
    let computed = ComputedChannels::new(settings)?;
    let wanted: Vec<ChannelSpec> = settings.groups().into_iter().flatten().cloned().collect();
    let of = |(k, ((label, file), log)): (usize, ((String, &DataFile), Record))| {
        let sha256 = sha256_of(log.columns());
        let named = FileOfRun { purpose: purpose(settings, k), label: &label, file, sha256 };
        file_records(settings, named, vec![computed.apply(&wanted, log, 1)?])
    };
    let read = files.into_iter().zip(logs).enumerate().map(of).collect::<Result<_>>()?;
    assembled(settings, read, None)
}

/// The records of a run from a measured response in memory, and logs to verify on.
///
/// # Errors
/// As [`records_in_memory`].
pub fn response_in_memory(
    settings: &DataSettings,
    (table, of_loop): (ResponseTable, bool),
    logs: Vec<Record>,
) -> Result<RunRecords> {
    let records = records_in_memory(settings, logs)?;
    let name = settings.response.first().and_then(|file| file.name.clone()).unwrap_or_else(|| "response".into());
    let numbers: Vec<f64> =
        table.values.iter().flat_map(|v| v.col_iter()).flat_map(|c| c.iter()).flat_map(|v| [v.re, v.im]).collect();
    let sha256 = sha256_of([&table.omega[..], &numbers].into_iter());
    let source = SourceFile { path: name.clone(), purpose: "response".into(), sha256 };
    let measured = MeasuredTable { name, table, of_loop, source: source.clone() };
    let sources = [vec![source], records.sources].concat();
    Ok(RunRecords { measured: Some(measured), sources, ..records })
}

fn purpose(settings: &DataSettings, k: usize) -> &'static str {
    if k < settings.estimation.len() { "estimation" } else { "verification" }
}

/// The records of all files, in the order of the settings.
fn assembled(settings: &DataSettings, read: Vec<FileRecords>, measured: Option<MeasuredTable>) -> Result<RunRecords> {
    let used = |f: &FileRecords| UsedRows {
        path: f.source.path.clone(),
        label: f.label.clone(),
        sha256: f.source.sha256.clone(),
        rows: f.rows.clone(),
    };
    refuse_overlap(&read.iter().map(used).collect::<Vec<_>>(), settings.estimation.len())?;
    let (mut records, mut segments): (Vec<LoopRecord>, _) = (Vec::new(), Vec::new());
    let mut sources: Vec<SourceFile> = measured.iter().map(|m| m.source.clone()).collect();
    let mut of_estimation = 0;
    for (k, file) in read.into_iter().enumerate() {
        of_estimation += if k < settings.estimation.len() { file.records.len() } else { 0 };
        records.extend(file.records);
        sources.push(file.source);
        segments.extend(file.segments);
        let (time, last): (Discrete, Discrete) = (records[0].time(), records[records.len() - 1].time());
        if (last.ts() / time.ts() - 1.0).abs() > TimeSource::default().tolerance {
            let what = format!("{} and {}", sources[0].path, sources[sources.len() - 1].path);
            return Err(Error::Method(youla::Error::SampleTimeMismatch { what, left: time.ts(), right: last.ts() }));
        }
    }
    let mut names = HashSet::new();
    if let Some(twice) = records.iter().find(|r| !names.insert(r.name().to_owned())) {
        return Err(Error::DuplicateRecord { name: twice.name().to_owned() });
    }
    let time = match (records.first(), settings.sample_time) {
        (Some(record), _) => record.time(),
        (None, ts) => Discrete::new(ts.unwrap_or(f64::NAN))?,
    };
    let verification = records.split_off(of_estimation);
    Ok(RunRecords {
        time,
        inputs: channels_of(&settings.inputs),
        outputs: channels_of(&settings.outputs),
        estimation: records,
        verification,
        sources,
        segments,
        measured,
        true_plant: None,
    })
}

/// The rows of a file that are used.
pub(crate) struct UsedRows {
    /// As in run.toml.
    pub(crate) path: String,
    /// Name in reports.
    pub(crate) label: String,
    pub(crate) sha256: String,
    /// First and last row of each stretch, counted from 1.
    pub(crate) rows: Vec<[usize; 2]>,
}

/// Refuses rows that both identify and verify, and rows that would identify twice: of one file under any name, by its bytes. The first
/// files are those to identify from.
pub(crate) fn refuse_overlap(files: &[UsedRows], estimation: usize) -> Result<()> {
    for (k, later) in files.iter().enumerate() {
        for used in files[..k.min(estimation)].iter().filter(|f| f.sha256 == later.sha256) {
            let pairs = later.rows.iter().flat_map(|a| used.rows.iter().map(move |b| [a[0].max(b[0]), a[1].min(b[1])]));
            if let Some([from, to]) = pairs.into_iter().find(|[from, to]| from <= to) {
                let (path, at) = (Path::new("run.toml").to_owned(), None);
                let problem = if k < estimation {
                    format!(
                        "[[data.estimation]] the records {:?} and {:?} share rows {from} to {to} of {}: what they tell would count twice. \
                         Keep them apart with `skip` and `take`, for example skip = {to} in the second",
                        used.label, later.label, later.path
                    )
                } else {
                    format!(
                        "[[data.verification]] {} uses rows {from} to {to}, from which the models are identified: that would verify \
                         nothing. Keep them apart with `skip` and `take`, for example skip = {to} here",
                        later.path
                    )
                };
                return Err(Error::File(youla_io::Error::Settings { path, at, problem }));
            }
        }
    }
    Ok(())
}

/// What one file gave.
struct FileRecords {
    /// Name in reports.
    label: String,
    records: Vec<LoopRecord>,
    /// First and last row of each record in the file, counted from 1.
    rows: Vec<[usize; 2]>,
    source: SourceFile,
    segments: Vec<RecordSegment>,
}

fn read_file(
    settings: &DataSettings,
    folder: &Path,
    (purpose, label): (&str, &str),
    file: &DataFile,
) -> Result<FileRecords> {
    let path = folder.join(&file.file);
    let tacho = settings.disturbance.as_ref().and_then(DisturbanceSettings::channel);
    let computed = ComputedChannels::new(settings)?;
    let wanted: Vec<ChannelSpec> = settings.groups().into_iter().flatten().cloned().chain(tacho).collect();
    let of_file = |e: youla_io::Error| match e {
        youla_io::Error::MissingFile { .. } => e.within(format!("[data] {purpose}")),
        other => other,
    };
    let clock = settings.clock();
    let source = |time: TimeSource, channels: &[ChannelSpec]| Source {
        path: path.clone(),
        format: Format::Detect,
        time,
        channels: computed.to_read(channels),
        csv: settings.csv.clone(),
    };
    let read = match computed.time(settings) {
        None => read_parts(&source(clock, &wanted)).map_err(of_file)?,
        Some(time) => {
            // The rows first, whatever their time; then their time from their columns.
            let all = [&wanted[..], std::slice::from_ref(&time)].concat();
            let rows = youla_io::read_rows(&source(clock.clone(), &all)).map_err(of_file)?;
            let times = computed.apply(std::slice::from_ref(&time), rows.clone(), 1)?.column(&time.name)?.to_vec();
            clock.cut(&rows, &times)?
        }
    };
    let mut first = 1;
    let compute = |record: Record| {
        let from = first;
        first += record.samples();
        computed.apply(&wanted, record, from)
    };
    let read = read.into_iter().map(compute).collect::<Result<Vec<_>>>()?;
    file_records(settings, FileOfRun { purpose, label, file, sha256: sha256(&path)? }, read)
}

/// A file with its place in the run.
struct FileOfRun<'a> {
    purpose: &'a str,
    /// Name in reports.
    label: &'a str,
    file: &'a DataFile,
    sha256: String,
}

/// The records of a file from its parts without gaps: cut, without known lines, detrended.
fn file_records(settings: &DataSettings, of: FileOfRun<'_>, read: Vec<Record>) -> Result<FileRecords> {
    let path = of.file.file.display().to_string();
    let (mut records, mut segments, mut all_rows) = (Vec::new(), Vec::new(), Vec::new());
    for Part { record, name, rows, cut } in parts(of.file, of.label, read)? {
        all_rows.push(rows);
        let disturbance = settings.disturbance.as_ref().map(|d| disturbance_signals(d, &record)).transpose()?;
        let record = record.detrend(settings.detrend)?.record;
        if cut {
            segments.push(RecordSegment { record: name.clone(), file: path.clone(), rows });
        }
        let logged = loop_record(&record, record.time(), &name, settings.groups())?;
        records.push(match disturbance {
            Some(lines) => logged.with_disturbance(lines)?,
            None => logged,
        });
    }
    let source = SourceFile { path, purpose: of.purpose.to_owned(), sha256: of.sha256 };
    Ok(FileRecords { label: of.label.to_owned(), records, rows: all_rows, source, segments })
}

/// The record of a loop from the channels of these groups: inputs, outputs, excitation of the inputs, reference, alpha.
pub(crate) fn loop_record(
    record: &Record,
    time: Discrete,
    name: &str,
    groups: [&Vec<ChannelSpec>; 5],
) -> Result<LoopRecord> {
    let matrix = |group: &[ChannelSpec]| {
        let names: Vec<&str> = group.iter().map(|c| c.name.as_str()).collect();
        record.matrix(&names)
    };
    let [inputs, outputs, input_excitation, reference, alpha] = groups;
    let mut found = LoopRecord::new(time, matrix(inputs)?, matrix(outputs)?)?.named(name);
    if !input_excitation.is_empty() {
        found = found.with_input_excitation(matrix(input_excitation)?)?;
    }
    if !reference.is_empty() {
        found = found.with_reference(matrix(reference)?)?;
    }
    if !alpha.is_empty() {
        found = found.with_alpha(matrix(alpha)?)?;
    }
    Ok(found)
}

/// Names and units without the places in the files.
pub(crate) fn channels_of(specs: &[ChannelSpec]) -> Vec<Channel> {
    specs.iter().map(|s| Channel::new(&s.name, &s.unit)).collect()
}

/// Root mean square of each channel over several records, 1 for a channel that is zero throughout.
pub(crate) fn rms<'a>(records: impl Iterator<Item = MatRef<'a, f64>> + Clone, channels: usize) -> Vec<f64> {
    let samples: usize = records.clone().map(|r| r.nrows()).sum();
    (0..channels)
        .map(|j| {
            let energy: f64 = records.clone().map(|r| r.col(j).squared_norm_l2()).sum();
            if energy > 0.0 { (energy / samples as f64).sqrt() } else { 1.0 }
        })
        .collect()
}
