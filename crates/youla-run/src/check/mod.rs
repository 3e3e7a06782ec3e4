//! `youla check`: problems in the records of a run, or of files alone, before identification.
//!
//! Records are read as they are, without taking means out and without refusing time columns that are not uniform: what the reader
//! would refuse is what the check is to describe. Where the time column has gaps or repetitions, the other tests look at the longest
//! stretch without any.

mod files;
mod repeated;
mod result;
mod sign;

pub use result::{CheckedRecord, DataCheck, DataCheckEntry, further};
pub use sign::{agreement, parse_settings, read_settings};

use crate::records::RunRecords;
use crate::settings::computed::ComputedChannels;
use crate::settings::{DataFile, DataSettings, RunSettings};
use crate::stages::factors::{DeclaredLoop, declared_loop};
use crate::{Error, Result};
use files::{Job, check_all, collected, logged, names};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use youla::ErrorKind;
use youla::identify::subspace::SubspaceOptions;
use youla::lti::Discrete;
use youla::signal::LoopRecord;
use youla_io::{ChannelRef, ChannelSpec, CsvOptions};
use youla_loop::check::{CheckOptions, Declared, Finding, Severity, Test, by_severity, check_record};

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
    settings.check()?;
    let d = &settings.data;
    let job = job(d, with_order(&settings.check, settings.hansen.as_ref()))?;
    let controller = |time: Discrete| Ok(Some(DeclaredLoop::new(settings, folder, time)?));
    let mut found = check_all(&job, &d.labelled(), folder, &controller)?;
    found.findings.extend(method_finding(settings));
    by_severity(&mut found.findings);
    Ok(found)
}

/// Checks files alone; no controller is known.
///
/// # Errors
/// As [`check_run`]; [`youla_io::Error::SampleTimeMissing`] without sample time and time column; [`youla::Error::Ports`] for excitations that
/// are not one per input, references that are not one per output.
pub fn check_files(files: &CheckedFiles, options: &CheckOptions) -> Result<DataCheck> {
    for (what, found, expected) in [
        ("the number of excitations", files.input_excitation.len(), files.inputs.len()),
        ("the number of references", files.reference.len(), files.outputs.len()),
    ] {
        if found != 0 && found != expected {
            return Err(Error::Method(youla::Error::Ports { what: what.into(), expected, found }));
        }
    }
    let file = |path: &PathBuf| DataFile { file: path.clone(), skip: 0, take: None, segments: Vec::new(), name: None };
    let [inputs, outputs] = [&files.inputs, &files.outputs].map(|chosen| ChannelSpec::chosen(chosen));
    let data = DataSettings {
        sample_time: files.sample_time,
        time_column: files.time_column.clone(),
        input_excitation: ChannelSpec::chosen(&files.input_excitation),
        reference: ChannelSpec::chosen(&files.reference),
        csv: files.csv.clone(),
        ..DataSettings::new(inputs, outputs, files.files.iter().map(file).collect())
    };
    let mut found = check_all(&job(&data, options.clone())?, &data.labelled(), Path::new(""), &|_| Ok(None))?;
    by_severity(&mut found.findings);
    Ok(found)
}

fn job(data: &DataSettings, options: CheckOptions) -> Result<Job> {
    Ok(Job {
        groups: data.groups().map(Clone::clone),
        computed: ComputedChannels::new(data)?,
        time: data.clock(),
        csv: data.csv.clone(),
        options,
        estimation: data.estimation.len(),
    })
}

/// Checks the records of a run as it uses them, with its controller where `controller` says so; paths are relative to `folder`.
///
/// # Errors
/// As [`check_run`].
pub fn check_in_memory(
    settings: &RunSettings,
    records: &RunRecords,
    folder: &Path,
    controller: bool,
) -> Result<DataCheck> {
    settings.check()?;
    settings.check.check()?;
    let declared = controller.then(|| declared_loop(settings, records, folder)).transpose()?;
    check_records(settings, records, declared.as_ref().map(DeclaredLoop::stated))
}

/// The same tests on the records of a run as it uses them, for its report.
pub(super) fn check_records(
    settings: &RunSettings,
    records: &RunRecords,
    controller: Option<Declared<'_>>,
) -> Result<DataCheck> {
    let d = &settings.data;
    let names = names(d.groups());
    let options = with_order(&settings.check, settings.hansen.as_ref());
    let all: Vec<&LoopRecord> = records.estimation.iter().chain(&records.verification).collect();
    let computed = ComputedChannels::new(d)?;
    let channels: Vec<&ChannelSpec> = d.groups().into_iter().flatten().collect();
    let one = |record: &&LoopRecord| {
        let (file, first) = place(settings, records, record.name());
        let logged = logged(record, first);
        // A test that cannot be computed does not end a run.
        let findings = match check_record(&logged, &names, controller, &options) {
            Err(error) if error.kind() == ErrorKind::Numerical => {
                vec![finding(Severity::Note, record.name(), format!("the record could not be checked: {error}"), "")]
            }
            found => found?,
        };
        let findings = computed.without_expected(&channels, findings);
        let rows = [first, first + record.samples() - 1];
        Ok((CheckedRecord { record: record.name().to_owned(), file, rows, sample_time: record.time().ts() }, findings))
    };
    let mut found = collected(all.par_iter().map(one).collect())?;
    found.findings.extend(method_finding(settings));
    found.findings.extend(repeated::repeated(records));
    by_severity(&mut found.findings);
    Ok(found)
}

/// File and first row of a record of a run.
fn place(settings: &RunSettings, records: &RunRecords, name: &str) -> (String, usize) {
    if let Some(segment) = records.segments.iter().find(|s| s.record == name) {
        return (segment.file.clone(), segment.rows[0]);
    }
    let files = settings.data.labelled();
    let found = files.iter().find(|(label, _)| label == name);
    found.map_or((String::new(), 1), |(_, f)| (f.file.display().to_string(), f.skip.saturating_add(1)))
}

fn with_order(options: &CheckOptions, hansen: Option<&SubspaceOptions>) -> CheckOptions {
    let rows = |options: &SubspaceOptions| {
        let (past, future) = options.block_rows();
        past.saturating_add(future)
    };
    // A short horizon of the scheme does not make a poor excitation a rich one.
    let horizons = rows(&SubspaceOptions::default()).max(hansen.map_or(0, rows));
    CheckOptions { excitation_order: options.excitation_order.or(Some(horizons)), ..options.clone() }
}

/// What stands for a record in findings on the settings.
pub(super) const OF_SETTINGS: &str = "run.toml";

/// Whether the direct method is one that feedback biases.
fn method_finding(settings: &RunSettings) -> Option<Finding> {
    let direct = settings.direct.as_ref().filter(|direct| !direct.method.is_for_closed_loops())?;
    let method =
        serde_json::to_value(direct.method).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let what = format!(
        "[direct] method = \"{method}\" assumes inputs that do not depend on the noise, but the records are from a closed loop"
    );
    let advice = "Use method = \"pbsid-opt\" or \"ssarx\" in [direct], or keep this one only for comparison";
    Some(finding(Severity::Caution, OF_SETTINGS, what, advice))
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
/// [`youla_io::Error::MissingFile`], [`youla_io::Error::Io`], [`youla_io::Error::Settings`].
pub fn read_check_options(path: impl AsRef<Path>) -> Result<CheckOptions> {
    let path = path.as_ref();
    Ok(youla_io::toml_file::parse(&youla_io::read_text(path)?, path)?)
}
