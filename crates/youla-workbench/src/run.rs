//! Check, identification and comparison, as the program does them.

use crate::refusal::Result;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use youla_io::folder::RunFolder;
use youla_loop::check::Finding;
use youla_run::{Stage, StageClock, check_run, parse_settings, read_records, write_into};

/// The name of the settings in messages.
const SETTINGS: &str = "run.toml";

/// Findings with the rows in which they are, for the traces, and what was found of the declared controller.
pub(crate) fn check(toml: &str) -> Result<Value> {
    let found = check_run(&parse_settings(toml, Path::new(SETTINGS))?, Path::new(""))?;
    let finding = |f: &Finding| {
        json!({
            "severity": f.severity.word(), "test": f.test.key(), "channel": f.channel, "rows": f.rows, "sentence": f.sentence(),
        })
    };
    let controller = found.controller().map(|f| json!({ "severity": f.severity.word(), "sentence": f.what }));
    Ok(json!({ "findings": found.findings.iter().map(finding).collect::<Vec<_>>(), "controller": controller }))
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
    Ok(json!({ "sentence": sentence, "reasons": reasons, "summary": written.summary }))
}

/// The page of a comparison.
pub(crate) fn compare(runs: &[PathBuf; 2]) -> Result<Value> {
    let found = youla_run::compare(runs, "recommended")?;
    Ok(json!({ "html": youla_report::html(&found.report)? }))
}
