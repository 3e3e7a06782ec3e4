//! `youla check`: what is wrong with the records of a run, or of files alone, before anything is identified.
//!
//! Records are read as they stand, without taking means out and without refusing time columns that are not uniform: what the reader
//! would refuse is what the check is to describe. Where the time column has gaps or repetitions, the other tests look at the longest
//! stretch without any.

use super::models::Controller;
use super::records::{LoopRecord, RunRecords, channels_of};
use super::segments::{Part, parts};
use super::settings::{DataFile, RunSettings};
use crate::check::{
    ChannelNames, CheckOptions, Finding, LoggedRecord, Severity, Test, by_severity, check_record, timing,
};
use crate::control::observer_controller;
use crate::identify::subspace::SubspaceOptions;
use crate::lti::{Discrete, StateSpace};
use crate::record::{ChannelRef, ChannelSpec, CsvOptions, Format, Source, TimeSource, read};
use crate::{Error, ErrorKind, Mat, Result};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A record that was checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckedRecord {
    /// Name in findings.
    pub record: String,
    /// Its file, as given.
    pub file: String,
    /// First and last row of the file, counted from 1, that the tests beside that of the clock looked at.
    pub rows: [usize; 2],
    /// Sample time, seconds.
    pub sample_time: f64,
}

/// What a check found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataCheck {
    /// What was checked.
    pub records: Vec<CheckedRecord>,
    /// Findings, the most serious first.
    pub findings: Vec<Finding>,
}

impl DataCheck {
    /// Number of findings of a severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|f| f.severity == severity).count()
    }

    /// Findings of the same test, severity and channel in several records as one: the first of them, with the number of further
    /// ones. In the order of the findings.
    pub fn grouped(&self) -> Vec<(&Finding, usize)> {
        let mut groups: Vec<(&Finding, usize)> = Vec::new();
        for finding in &self.findings {
            let same = |g: &&mut (&Finding, usize)| {
                let first = g.0;
                let one_record = first.record == finding.record;
                (first.test, first.severity, &first.channel) == (finding.test, finding.severity, &finding.channel)
                    && !one_record
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.1 += 1,
                None => groups.push((finding, 0)),
            }
        }
        groups
    }

    /// The findings that are more than notes, grouped, as plain text.
    pub fn sentences(&self) -> Vec<String> {
        let worth = self.grouped().into_iter().filter(|(f, _)| f.severity > Severity::Note);
        worth.map(|(f, more)| format!("data, {}{}", f.sentence(), further(more))).collect()
    }

    /// As JSON: `defects`, `cautions`, `notes` (numbers), `records` and `findings`.
    pub fn json(&self) -> serde_json::Value {
        let mut all = serde_json::json!(self);
        for (key, severity) in
            [("defects", Severity::Defect), ("cautions", Severity::Caution), ("notes", Severity::Note)]
        {
            all[key] = self.count(severity).into();
        }
        all
    }
}

/// In how many more records a finding was made, in words.
pub fn further(records: usize) -> String {
    match records {
        0 => String::new(),
        1 => " The same in 1 more record.".into(),
        n => format!(" The same in {n} more records."),
    }
}

/// Files to check without a run.toml; channels by name or number.
#[derive(Debug, Clone, Default)]
pub struct CheckedFiles {
    /// The files, one record each.
    pub files: Vec<PathBuf>,
    /// Plant inputs.
    pub inputs: Vec<ChannelRef>,
    /// Plant outputs.
    pub outputs: Vec<ChannelRef>,
    /// Known excitation at the plant input, one per input, or none.
    pub input_excitation: Vec<ChannelRef>,
    /// Known reference, one per output, or none.
    pub reference: Vec<ChannelRef>,
    /// Sample time in seconds.
    pub sample_time: Option<f64>,
    /// Column with the time in seconds.
    pub time_column: Option<ChannelRef>,
    /// Form of text files.
    pub csv: CsvOptions,
}

/// Checks all records that a run.toml names, with its controller; paths are relative to `folder`.
///
/// # Errors
/// Files that cannot be read, channels that do not exist, a controller that is not one. What a file holds is described, not
/// refused.
pub fn check_run(settings: &RunSettings, folder: &Path) -> Result<DataCheck> {
    let d = &settings.data;
    let job = Job {
        groups: [&d.inputs, &d.outputs, &d.input_excitation, &d.reference, &d.alpha].map(Clone::clone),
        time: TimeSource {
            column: d.time_column.clone(),
            ts: d.sample_time,
            tolerance: d.time_tolerance,
            ..Default::default()
        },
        csv: d.csv.clone(),
        options: with_order(&settings.check, &settings.hansen),
    };
    let files: Vec<&DataFile> = d.estimation.iter().chain(&d.verification).collect();
    let controller = |time: Discrete| declared(settings, folder, time).map(Some);
    let mut found = check_all(&job, &files, folder, &controller)?;
    found.findings.extend(method_finding(settings));
    by_severity(&mut found.findings);
    Ok(found)
}

/// Checks files alone; no controller is known.
///
/// # Errors
/// As [`check_run`]; [`Error::SampleTimeMissing`] without sample time and time column; [`Error::Ports`] for excitations that
/// are not one per input, references that are not one per output.
pub fn check_files(files: &CheckedFiles, options: &CheckOptions) -> Result<DataCheck> {
    for (what, found, expected) in [
        ("the number of excitations", files.input_excitation.len(), files.inputs.len()),
        ("the number of references", files.reference.len(), files.outputs.len()),
    ] {
        if found != 0 && found != expected {
            return Err(Error::Ports { what: what.into(), expected, found });
        }
    }
    let specs = |chosen: &[ChannelRef]| -> Vec<ChannelSpec> {
        chosen.iter().map(|c| ChannelSpec::from(c.to_string(), c.clone(), "")).collect()
    };
    let job = Job {
        groups: [
            specs(&files.inputs),
            specs(&files.outputs),
            specs(&files.input_excitation),
            specs(&files.reference),
            Vec::new(),
        ],
        time: TimeSource { column: files.time_column.clone(), ts: files.sample_time, ..Default::default() },
        csv: files.csv.clone(),
        options: options.clone(),
    };
    let file = |path: &PathBuf| DataFile { file: path.clone(), skip: 0, take: None, segments: Vec::new(), name: None };
    let all: Vec<DataFile> = files.files.iter().map(file).collect();
    let mut found = check_all(&job, &all.iter().collect::<Vec<_>>(), Path::new(""), &|_| Ok(None))?;
    by_severity(&mut found.findings);
    Ok(found)
}

/// The same tests on the records of a run as it uses them, for its report; `controller` with positive feedback.
pub(super) fn check_records(
    settings: &RunSettings,
    records: &RunRecords,
    controller: &StateSpace<Discrete>,
) -> Result<DataCheck> {
    let d = &settings.data;
    let names = names([&d.inputs, &d.outputs, &d.input_excitation, &d.reference, &d.alpha]);
    let options = with_order(&settings.check, &settings.hansen);
    let all: Vec<&LoopRecord> = records.estimation.iter().chain(&records.verification).collect();
    let one = |record: &&LoopRecord| {
        let (file, first) = place(settings, records, &record.name);
        let logged = logged(record, first);
        // A test that cannot be computed does not end a run.
        let findings = match check_record(&logged, &names, Some(controller), &options) {
            Err(error) if error.kind() == ErrorKind::Numerical => {
                vec![finding(Severity::Note, &record.name, format!("it could not be checked: {error}"), "")]
            }
            found => found?,
        };
        let rows = [first, first + record.samples() - 1];
        Ok((CheckedRecord { record: record.name.clone(), file, rows, sample_time: record.time.ts() }, findings))
    };
    let mut found = collected(all.par_iter().map(one).collect())?;
    found.findings.extend(method_finding(settings));
    by_severity(&mut found.findings);
    Ok(found)
}

/// What all records of a check share.
struct Job {
    /// Inputs, outputs, excitation, reference, alpha.
    groups: [Vec<ChannelSpec>; 5],
    time: TimeSource,
    csv: CsvOptions,
    options: CheckOptions,
}

/// A record with its findings.
type CheckedPart = (CheckedRecord, Vec<Finding>);

type DeclaredController<'a> = dyn Fn(Discrete) -> Result<Option<StateSpace<Discrete>>> + Sync + 'a;

/// Name of the time column while a file is read.
const TIME: &str = "(time)";

fn check_all(job: &Job, files: &[&DataFile], folder: &Path, controller: &DeclaredController<'_>) -> Result<DataCheck> {
    job.options.check()?;
    let one = |file: &&DataFile| check_file(job, file, folder, controller);
    let parts: Vec<Result<Vec<CheckedPart>>> = files.par_iter().map(one).collect();
    let mut all = Vec::new();
    for part in parts {
        all.extend(part?.into_iter().map(Ok));
    }
    collected(all)
}

fn collected(all: Vec<Result<CheckedPart>>) -> Result<DataCheck> {
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
    file: &DataFile,
    folder: &Path,
    controller: &DeclaredController<'_>,
) -> Result<Vec<CheckedPart>> {
    let path = folder.join(&file.file);
    if job.time.column.is_none() && job.time.ts.is_none() {
        return Err(Error::SampleTimeMissing { what: path.display().to_string() });
    }
    let clock = job.time.column.iter().map(|place| ChannelSpec::from(TIME, place.clone(), ""));
    let source = Source {
        path,
        format: Format::Detect,
        // The time column is a channel here; whatever it holds, the rows are read.
        time: TimeSource::ts(job.time.ts.unwrap_or(1.0)),
        channels: job.groups.iter().flat_map(|g| g.iter().cloned()).chain(clock).collect(),
        csv: job.csv.clone(),
    };
    let found = parts(file, vec![read(&source)?])?;
    found.iter().map(|part| check_part(job, file, part, controller)).collect()
}

fn check_part(job: &Job, file: &DataFile, part: &Part, controller: &DeclaredController<'_>) -> Result<CheckedPart> {
    let mut findings = Vec::new();
    let (mut record, mut first, mut time) = (part.record.clone(), part.rows[0], part.record.time());
    if job.time.column.is_some() {
        let times = record.column(TIME)?.to_vec();
        let Some(found) = timing(&times, job.time.ts, job.time.tolerance) else {
            let what = file.file.display().to_string();
            return Err(Error::NonUniformTime { what, row: 2, dt: times.last().unwrap_or(&0.0) - times[0], ts: 0.0 });
        };
        findings = found.findings(&part.name, first);
        time = Discrete::new(job.time.ts.filter(|_| found.unit.is_none()).unwrap_or(found.step))?;
        let mut breaks: Vec<usize> = found.gaps.iter().map(|g| g.row).chain(found.repeated).chain(found.back).collect();
        breaks.sort_unstable();
        let (from, to) = longest(&breaks, times.len());
        record = record.trim(from, Some(to - from))?;
        first += from;
    }
    let logged = LoopRecord::from_record(&record, part.name.clone(), job.groups.each_ref())?;
    let logged = LoopRecord { time, ..logged };
    let names = names(job.groups.each_ref());
    let controller = controller(time)?;
    let (m, p) = (logged.u.ncols(), logged.y.ncols());
    if let Some(k) = controller.as_ref().filter(|k| (k.outputs(), k.inputs()) != (m, p)) {
        let (expected, found) = ((m, p), (k.outputs(), k.inputs()));
        return Err(Error::Shape { what: "[controller], inputs x outputs of the plant".into(), expected, found });
    }
    findings.extend(check_record(&self::logged(&logged, first), &names, controller.as_ref(), &job.options)?);
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

fn logged(record: &LoopRecord, first_row: usize) -> LoggedRecord<'_> {
    fn of(x: &Option<Mat<f64>>) -> Option<crate::MatRef<'_, f64>> {
        x.as_ref().map(|x| x.as_ref())
    }
    LoggedRecord {
        name: &record.name,
        time: record.time,
        first_row,
        u: record.u.as_ref(),
        y: record.y.as_ref(),
        input_excitation: of(&record.input_excitation),
        reference: of(&record.reference),
        alpha: of(&record.alpha),
    }
}

fn names(groups: [&Vec<ChannelSpec>; 5]) -> ChannelNames {
    let [inputs, outputs, input_excitation, reference, alpha] = groups.map(|g| channels_of(g));
    ChannelNames { inputs, outputs, input_excitation, reference, alpha }
}

/// File and first row of a record of a run.
fn place(settings: &RunSettings, records: &RunRecords, name: &str) -> (String, usize) {
    if let Some(segment) = records.segments.iter().find(|s| s.record == name) {
        return (segment.file.clone(), segment.rows[0]);
    }
    let mut files = settings.data.estimation.iter().chain(&settings.data.verification);
    files.find(|f| f.label() == name).map_or((String::new(), 1), |f| (f.file.display().to_string(), f.skip + 1))
}

fn with_order(options: &CheckOptions, hansen: &SubspaceOptions) -> CheckOptions {
    let horizons = hansen.automatic_horizon.is_none().then(|| hansen.past() + hansen.horizon);
    CheckOptions { excitation_order: options.excitation_order.or(horizons), ..options.clone() }
}

/// The declared controller with positive feedback.
fn declared(settings: &RunSettings, folder: &Path, time: Discrete) -> Result<StateSpace<Discrete>> {
    match settings.controller.realise(folder, time)? {
        Controller::System(k) => Ok(k),
        Controller::Observer { f, l } => {
            let nominal = settings.nominal.realise(folder, time)?;
            observer_controller(&nominal, f.as_ref(), l.as_ref()).map_err(|e| e.within("[controller]"))
        }
    }
}

/// Whether the direct method is one that feedback biases.
fn method_finding(settings: &RunSettings) -> Option<Finding> {
    let direct = settings.direct.as_ref().filter(|direct| !direct.weight.is_for_closed_loops())?;
    let weight =
        serde_json::to_value(direct.weight).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let what = format!(
        "[direct] weight = \"{weight}\" is for inputs that do not depend on the noise, but the records are of a closed loop"
    );
    let advice = "Take weight = \"pbsid-opt\", \"ssarx\" or \"parsim-s\" in [direct]; as a comparison with the scheme it may stay";
    Some(finding(Severity::Caution, "run.toml", what, advice))
}

/// A finding on the method or the record as a whole.
fn finding(severity: Severity, record: &str, what: String, advice: &str) -> Finding {
    Finding {
        test: Test::Feedback,
        severity,
        record: record.to_owned(),
        channel: None,
        rows: None,
        what,
        numbers: BTreeMap::new(),
        advice: advice.to_owned(),
    }
}

/// Reads the options of a check from a TOML file, as `[check]` has them.
///
/// # Errors
/// [`Error::MissingFile`], [`Error::Io`], [`Error::Settings`].
pub fn read_check_options(path: impl AsRef<Path>) -> Result<CheckOptions> {
    use std::io::Read;
    let path = path.as_ref();
    let mut text = String::new();
    let read = crate::record::open(path)?.read_to_string(&mut text);
    read.map_err(|source| Error::Io { path: path.to_owned(), source })?;
    crate::toml_file::parse(&text, path)
}
