//! `youla check`: what is wrong with the data.

use crate::log_flags::{LogFlags, places};
use crate::output::{Failure, Form};
use crate::run_folder::{folder_of, place};
use clap::Args;
use std::fs;
use std::path::PathBuf;
use youla_io::folder::require_place;
use youla_loop::check::Severity;
use youla_run::{CheckedFiles, DataCheck, check_files, check_run, read_check_options, read_settings};

pub(crate) const EXAMPLES: &str = "\
Example:
  youla check run.toml
  youla check log.csv --input u --output y --time t
  youla check log.csv --input u --output y --time t --delimiter semicolon --decimal comma
  youla check log.csv --input u --output y --excitation d --sample-time 1e-3 --json

Exit codes: 0 no defect, 1 a defect was found, 2 the input cannot be read, 3 a test could not be computed.";

/// What is to be checked.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// A run.toml; or, with --input and --output, text, MATLAB or NumPy files, one record each.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    log: LogFlags,
    /// Thresholds, as in [check] of run.toml.
    #[arg(long, value_name = "FILE", requires = "input")]
    options: Option<PathBuf>,
    /// Folder for check.json; it must not exist.
    #[arg(long, value_name = "DIR", value_parser = place())]
    out: Option<PathBuf>,
}

/// Checks, prints what was found, and says whether there is no defect.
pub(crate) fn check(form: Form, args: &CheckArgs) -> Result<bool, Failure> {
    if let Some(folder) = args.out.as_ref().filter(|folder| folder.exists()) {
        return Err(youla_io::Error::OutputExists { path: folder.clone() }.into());
    }
    args.out.as_ref().map_or(Ok(()), |folder| require_place(&folder.join("check.json")))?;
    let found = if args.log.input.is_empty() { of_run(args)? } else { of_files(args)? };
    let json = serde_json::json!(found.entry());
    if let Some(folder) = &args.out {
        let file = folder.join("check.json");
        fs::create_dir_all(folder).map_err(|source| Failure::io(folder, source))?;
        fs::write(&file, format!("{json:#}\n")).map_err(|source| Failure::io(&file, source))?;
    }
    form.print(|| json, || text(&found))?;
    Ok(found.count(Severity::Defect) == 0)
}

fn of_run(args: &CheckArgs) -> Result<DataCheck, Failure> {
    if args.log.dialect.is_given() {
        let problem = "a run.toml declares the form of its text files itself, in [data] csv".to_owned();
        return Err(youla_io::Error::Settings { path: args.files[0].clone(), at: None, problem }.into());
    }
    let [settings] = &args.files[..] else {
        let what = "the number of run.toml files (give --input and --output for files of data)".into();
        return Err(youla::Error::Ports { what, expected: 1, found: args.files.len() }.into());
    };
    Ok(check_run(&read_settings(settings)?, &folder_of(settings))?)
}

fn of_files(args: &CheckArgs) -> Result<DataCheck, Failure> {
    let options = args.options.as_ref().map(read_check_options).transpose()?.unwrap_or_default();
    let files = CheckedFiles {
        files: args.files.clone(),
        inputs: places(&args.log.input),
        outputs: places(&args.log.output),
        input_excitation: places(&args.log.excitation),
        reference: places(&args.log.reference),
        sample_time: args.log.sample_time,
        time_column: args.log.time.clone(),
        csv: args.log.dialect.options(),
    };
    Ok(check_files(&files, &options)?)
}

/// Findings of one severity that are printed, at most, and records.
const MOST: usize = 10;

/// The records and the controller, then defects first, a blank line between the severities, and the count of each.
fn text(found: &DataCheck) -> String {
    let mut text = head(found);
    let controller = found.controller().filter(|f| f.severity == Severity::Note);
    for severity in [Severity::Defect, Severity::Caution, Severity::Note] {
        let most = if severity == Severity::Note { MOST } else { usize::MAX };
        let of = found.alike(severity, most);
        let of: Vec<_> = of.iter().filter(|(f, _)| controller.is_none_or(|said| said.test != f.test)).collect();
        for (finding, more) in &of {
            let (word, test) = (severity.word(), finding.test.key());
            text += &format!("{word} ({test}) {}{more}\n", finding.sentence());
        }
        if !of.is_empty() {
            text.push('\n');
        }
    }
    let count = |severity, one: &str| match found.count(severity) {
        1 => format!("1 {one}"),
        n => format!("{n} {one}s"),
    };
    let records = match found.records.len() {
        1 => "1 record".to_owned(),
        n => format!("{n} records"),
    };
    let counts =
        [count(Severity::Defect, "defect"), count(Severity::Caution, "caution"), count(Severity::Note, "note")];
    text + &format!("{records}: {}", counts.join(", "))
}

/// Rows, sample time and length of each record, and whether the declared controller agrees.
fn head(found: &DataCheck) -> String {
    let mut text = String::new();
    for r in found.records.iter().take(MOST) {
        let samples = r.rows[1] + 1 - r.rows[0];
        // The median step of a time column has digits of rounding.
        let ts = (r.sample_time * 1e12).round() / 1e12;
        let length = (samples as f64 * r.sample_time * 1e4).round() / 1e4;
        let rate = (1e6 / r.sample_time).round() / 1e6;
        let [first, last] = r.rows;
        text += &format!(
            "{}, rows {first} to {last}: {samples} samples, sample time {ts} s ({rate} Hz), length {length} s\n",
            r.record
        );
    }
    if found.records.len() > MOST {
        text += &format!("and {} more records\n", found.records.len() - MOST);
    }
    if let Some(f) = found.controller() {
        text += &format!("{}.\n", f.what);
    }
    text + "\n"
}
