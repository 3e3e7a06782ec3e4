//! Files as they are read and tested one record at a time.

use super::{CheckedRecord, DataCheck};
use crate::records::segments::{Part, parts};
use crate::records::{UsedRows, channels_of, loop_record, refuse_overlap};
use crate::settings::DataFile;
use crate::settings::computed::ComputedChannels;
use crate::stages::factors::DeclaredLoop;
use crate::{Error, Result};
use rayon::prelude::*;
use std::path::Path;
use youla::lti::Discrete;
use youla::signal::LoopRecord;
use youla::signal::Record;
use youla_io::{ChannelSpec, CsvOptions, Format, Gaps, Source, TimeSource, check_unit, read, read_rows, sha256};
use youla_loop::check::{ChannelNames, CheckOptions, Finding, LoggedRecord, check_record, timing};

/// What all records of a check share.
pub(super) struct Job {
    /// Inputs, outputs, excitation, reference, alpha.
    pub(super) groups: [Vec<ChannelSpec>; 5],
    /// Channels that are not in the files.
    pub(super) computed: ComputedChannels,
    pub(super) time: TimeSource,
    pub(super) csv: CsvOptions,
    pub(super) options: CheckOptions,
    /// How many of the files are to identify from; they come first.
    pub(super) estimation: usize,
}

/// A record with its findings.
pub(super) type CheckedPart = (CheckedRecord, Vec<Finding>);

pub(super) type DeclaredController<'a> = dyn Fn(Discrete) -> Result<Option<DeclaredLoop>> + Sync + 'a;

/// Name of the time column while a file is read.
const TIME: &str = "(time)";

pub(super) fn check_all(
    job: &Job,
    files: &[(String, &DataFile)],
    folder: &Path,
    controller: &DeclaredController<'_>,
) -> Result<DataCheck> {
    job.options.check()?;
    let one = |(label, file): &(String, &DataFile)| check_file(job, (label, file), folder, controller);
    let parts: Vec<Result<Vec<CheckedPart>>> = files.par_iter().map(one).collect();
    let parts = parts.into_iter().collect::<Result<Vec<_>>>()?;
    let used: Vec<UsedRows> = files
        .iter()
        .zip(&parts)
        .map(|((label, file), parts)| {
            let rows = parts.iter().map(|(record, _)| record.rows).collect();
            let (path, sha256) = (file.file.display().to_string(), sha256(folder.join(&file.file))?);
            Ok(UsedRows { path, label: label.clone(), sha256, rows })
        })
        .collect::<Result<_>>()?;
    refuse_overlap(&used, job.estimation)?;
    collected(parts.into_iter().flatten().map(Ok).collect())
}

pub(super) fn collected(all: Vec<Result<CheckedPart>>) -> Result<DataCheck> {
    let mut check = DataCheck { records: Vec::new(), findings: Vec::new() };
    for one in all {
        let (record, findings) = one?;
        check.records.push(record);
        check.findings.extend(findings);
    }
    Ok(check)
}

fn check_file(
    job: &Job,
    (label, file): (&str, &DataFile),
    folder: &Path,
    controller: &DeclaredController<'_>,
) -> Result<Vec<CheckedPart>> {
    let path = folder.join(&file.file);
    if job.time.column.is_none() && job.time.ts.is_none() {
        return Err(Error::File(youla_io::Error::SampleTimeMissing { what: path.display().to_string() }));
    }
    let clock = job.time.column.clone().map(|place| ChannelSpec::from(TIME, place, ""));
    let wanted: Vec<ChannelSpec> = job.groups.iter().flat_map(|g| g.iter().cloned()).chain(clock.clone()).collect();
    let clock_is_a_channel = clock.is_some();
    let source = Source {
        path,
        format: Format::Detect,
        time: job.time.clone(),
        channels: job.computed.to_read(&wanted),
        csv: job.csv.clone(),
    };
    if let Some(clock) = clock.filter(|clock| job.computed.formula_of(clock).is_none()) {
        check_unit(&source, &clock.source())?;
    }
    // A time column is a channel here; whatever it holds, the rows are read.
    let rows = if clock_is_a_channel { read_rows(&source)? } else { read(&source)? };
    let record = job.computed.apply(&wanted, rows, 1)?;
    let continuous = if job.time.gaps == Gaps::Split { between_gaps(job, record)? } else { vec![record] };
    let found = parts(file, label, continuous)?;
    found.iter().map(|part| check_part(job, file, part, controller)).collect()
}

/// The stretches between the gaps of the time column, as a run uses them.
fn between_gaps(job: &Job, record: Record) -> Result<Vec<Record>> {
    let Some(found) = timing(record.column(TIME)?, job.time.ts, job.time.tolerance) else { return Ok(vec![record]) };
    let starts = std::iter::once(0).chain(found.gaps.iter().map(|gap| gap.row - 1));
    let ends = found.gaps.iter().map(|gap| gap.row - 1).chain([record.samples()]);
    starts.zip(ends).map(|(from, to)| Ok(record.clone().trim(from, Some(to - from))?)).collect()
}

fn check_part(job: &Job, file: &DataFile, part: &Part, controller: &DeclaredController<'_>) -> Result<CheckedPart> {
    let mut findings = Vec::new();
    let (mut record, mut first, mut time) = (part.record.clone(), part.rows[0], part.record.time());
    if job.time.column.is_some() {
        let times = record.column(TIME)?.to_vec();
        let Some(found) = timing(&times, job.time.ts, job.time.tolerance) else {
            let what = file.file.display().to_string();
            if times.len() > 1 {
                job.time.of_column(&what, &times)?;
            }
            let problem = format!(
                "rows {first} to {} between two gaps of the time are too few to determine the sample time: the steps of the time are irregular. \
                 `youla synchronise` brings the channels to one clock; sample_time in [data] states it where the time is only logged unsteadily",
                first + times.len() - 1
            );
            return Err(Error::File(youla_io::Error::Clock { what, problem }));
        };
        findings = found.findings(&part.name, first);
        time = Discrete::new(job.time.ts.filter(|_| found.unit.is_none()).unwrap_or(found.step))?;
        let mut breaks: Vec<usize> = found.gaps.iter().map(|g| g.row).chain(found.repeated).chain(found.back).collect();
        breaks.sort_unstable();
        let (from, to) = longest(&breaks, times.len());
        record = record.trim(from, Some(to - from))?;
        first += from;
    }
    let logged = loop_record(&record, time, &part.name, job.groups.each_ref())?;
    let names = names(job.groups.each_ref());
    let declared = controller(time)?;
    let (m, p) = (logged.inputs(), logged.outputs());
    if let Some(k) = declared.as_ref().map(DeclaredLoop::controller).filter(|k| (k.outputs(), k.inputs()) != (m, p)) {
        let (expected, found) = ((m, p), (k.outputs(), k.inputs()));
        return Err(Error::Method(youla::Error::Shape {
            what: "[controller], inputs x outputs of the plant".into(),
            expected,
            found,
        }));
    }
    let stated = declared.as_ref().map(DeclaredLoop::stated);
    let of_record = check_record(&self::logged(&logged, first), &names, stated, &job.options)?;
    let channels: Vec<&ChannelSpec> = job.groups.iter().flatten().collect();
    findings.extend(job.computed.without_expected(&channels, of_record));
    let rows = [first, first + logged.samples() - 1];
    let file = file.file.display().to_string();
    Ok((CheckedRecord { record: part.name.clone(), file, rows, sample_time: time.ts() }, findings))
}

/// The longest stretch between breaks, which are rows counted from 1; from and up to, counted from 0.
fn longest(breaks: &[usize], samples: usize) -> (usize, usize) {
    let starts = std::iter::once(0).chain(breaks.iter().map(|row| row - 1));
    let ends = breaks.iter().map(|row| row - 1).chain([samples]);
    starts.zip(ends).fold((0, 0), |best, part| if part.1 - part.0 > best.1 - best.0 { part } else { best })
}

pub(super) fn logged(record: &LoopRecord, first_row: usize) -> LoggedRecord<'_> {
    LoggedRecord {
        name: record.name(),
        time: record.time(),
        first_row,
        u: record.u(),
        y: record.y(),
        input_excitation: record.input_excitation(),
        reference: record.reference(),
        alpha: record.alpha(),
    }
}

pub(super) fn names(groups: [&Vec<ChannelSpec>; 5]) -> ChannelNames {
    let [inputs, outputs, input_excitation, reference, alpha] = groups.map(|g| channels_of(g));
    ChannelNames { inputs, outputs, input_excitation, reference, alpha }
}
