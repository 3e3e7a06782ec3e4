//! `youla check`: what is wrong with the data.

use crate::args::{Args, CheckArgs};
use crate::commands::folder_of;
use crate::output::{Failure, say};
use std::fs;
use std::path::Path;
use youla_loop::check::{Finding, Severity};
use youla_run::{CheckedFiles, DataCheck, RunSettings, check_files, check_run, further, read_check_options};

/// Checks, prints what was found, and says whether there is no defect.
pub(crate) fn check(args: &Args, asked: &CheckArgs) -> Result<bool, Failure> {
    if let Some(folder) = asked.out.as_ref().filter(|folder| folder.exists()) {
        return Err(youla_io::Error::OutputExists { path: folder.clone() }.into());
    }
    let found = if asked.input.is_empty() { of_run(asked)? } else { of_files(asked)? };
    let json =
        serde_json::to_string_pretty(&found.json()).map_err(|e| Failure::io(Path::new("the check"), e.into()))?;
    if let Some(folder) = &asked.out {
        let file = folder.join("check.json");
        fs::create_dir_all(folder).map_err(|source| Failure::io(folder, source))?;
        fs::write(&file, json.clone() + "\n").map_err(|source| Failure::io(&file, source))?;
    }
    match (args.json, args.quiet) {
        (true, _) => say(&json)?,
        (_, true) => {}
        _ => say(&text(&found))?,
    }
    Ok(found.count(Severity::Defect) == 0)
}

fn of_run(asked: &CheckArgs) -> Result<DataCheck, Failure> {
    if asked.dialect.is_given() {
        let problem = "a run.toml declares the form of its text files itself, in [data] csv".to_owned();
        return Err(youla_io::Error::Settings { path: asked.files[0].clone(), at: None, problem }.into());
    }
    let [settings] = &asked.files[..] else {
        let what = "the number of run.toml files (give --input and --output for files of data)".into();
        return Err(youla::Error::Ports { what, expected: 1, found: asked.files.len() }.into());
    };
    Ok(check_run(&RunSettings::read(settings)?, &folder_of(settings))?)
}

fn of_files(asked: &CheckArgs) -> Result<DataCheck, Failure> {
    let options = asked.options.as_ref().map(read_check_options).transpose()?.unwrap_or_default();
    let files = CheckedFiles {
        files: asked.files.clone(),
        inputs: asked.input.clone(),
        outputs: asked.output.clone(),
        input_excitation: asked.excitation.clone(),
        reference: asked.reference.clone(),
        sample_time: asked.sample_time,
        time_column: asked.time.clone(),
        csv: asked.dialect.options(),
    };
    Ok(check_files(&files, &options)?)
}

/// Defects first, a blank line between the severities, and the count of each.
fn text(found: &DataCheck) -> String {
    let mut text = String::new();
    for severity in [Severity::Defect, Severity::Caution, Severity::Note] {
        let of: Vec<(&Finding, usize)> = found.grouped().into_iter().filter(|(f, _)| f.severity == severity).collect();
        for (finding, more) in &of {
            let (word, test) = (severity.word(), finding.test.key());
            text += &format!("{word} ({test}) {}{}\n", finding.sentence(), further(*more));
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
