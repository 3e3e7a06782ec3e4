//! Check, identification and comparison, as the program does them.

use crate::refusal::{Refusal, Result};
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use youla_io::folder::RunFolder;
use youla_run::{DataCheck, Stage, StageClock, check_run, parse_settings, read_records, write_into};
use zip::write::SimpleFileOptions;

/// The name of the settings in messages.
const SETTINGS: &str = "run.toml";

/// Findings with the rows in which they are, for the traces, and what was found of the declared controller.
pub(crate) fn check(toml: &str) -> Result<Value> {
    let found = check_run(&parse_settings(toml, Path::new(SETTINGS))?, Path::new(""))?;
    Ok(described(&found))
}

fn described(found: &DataCheck) -> Value {
    let finding = |f: &youla_loop::check::Finding| {
        json!({
            "severity": f.severity.word(), "test": f.test.key(), "channel": f.channel, "rows": f.rows, "sentence": f.sentence(),
        })
    };
    let controller = found.controller().map(|f| json!({ "severity": f.severity.word(), "sentence": f.what }));
    json!({
        "records": found.records, "findings": found.findings.iter().map(finding).collect::<Vec<_>>(), "controller": controller,
    })
}

/// Identifies and writes the run folder `out`, as `youla identify run.toml --out` does.
pub(crate) fn identify(toml: &str, out: &Path, announce: &mut dyn FnMut(&str)) -> Result<Value> {
    let chosen = parse_settings(toml, Path::new(SETTINGS))?;
    let folder = RunFolder::create(out, true)?;
    let mut stage = |stage: Stage| announce(&format!("{} {} {}", stage as usize + 1, Stage::COUNT, stage.name()));
    let mut clock = StageClock::new(&mut stage);
    let records = clock.run(Stage::Record, || read_records(&chosen.data, Path::new("")))?;
    let found = youla_run::identify(chosen, records, Path::new(""), &mut clock)?;
    let written = write_into(&found, folder, &mut clock)?;
    let sentence = match &found.recommended {
        Ok(model) => model.sentence(),
        Err(why) => format!("There is no recommended model: {why}"),
    };
    let reasons = found.recommended.as_ref().map(|model| model.reasons()).unwrap_or_default();
    Ok(json!({
        "sentence": sentence, "reasons": reasons, "summary": written.summary, "data": described(&found.data),
        "reservation": found.pid_reservation(),
    }))
}

/// The page of a comparison, which is also written beside the runs.
pub(crate) fn compare(runs: &[PathBuf; 2]) -> Result<Value> {
    let found = youla_run::compare(runs, "recommended")?;
    Ok(json!({ "html": youla_report::html(&found.report)?, "distances": found.distances }))
}

/// Packs a run folder into one file.
pub(crate) fn archive(run: &Path, file: &Path) -> Result<Value> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| Refusal::at(&path, source)
    };
    let mut archive = zip::ZipWriter::new(fs::File::create(file).map_err(io(file))?);
    let zipped = |e: zip::result::ZipError| Refusal::Text(format!("{}: {e}", file.display()));
    let mut open = vec![run.to_owned()];
    while let Some(folder) = open.pop() {
        let mut entries: Vec<PathBuf> = Vec::new();
        for entry in fs::read_dir(&folder).map_err(io(&folder))? {
            entries.push(entry.map_err(io(&folder))?.path());
        }
        entries.sort();
        for path in entries {
            if path.is_dir() {
                open.push(path);
                continue;
            }
            let bytes = fs::read(&path).map_err(io(&path))?;
            archive.start_file(path.to_string_lossy(), SimpleFileOptions::default()).map_err(zipped)?;
            archive.write_all(&bytes).map_err(io(&path))?;
        }
    }
    archive.finish().map_err(zipped)?;
    Ok(json!({ "file": file }))
}
