//! Writes a run folder: data first, then the report drawn from them, summary.json last.

use super::artefacts::write_artefacts;
use super::folder::RunFolder;
use super::page::page;
use super::pipeline::{Identification, Stage, StageClock};
use super::summary::summary;
use crate::Result;
use crate::report::html;
use std::path::{Path, PathBuf};

/// A finished run folder.
#[derive(Debug, Clone)]
pub struct WrittenRun {
    /// Where it is.
    pub folder: PathBuf,
    /// What stands in its summary.json.
    pub summary: serde_json::Value,
}

/// Writes all artefacts, `report.json`, `report.html` and `summary.json` to `target`. Nothing is left behind on failure.
///
/// # Errors
/// [`crate::Error::OutputExists`], [`crate::Error::Io`].
pub fn write_run(
    found: &Identification,
    target: &Path,
    replace: bool,
    clock: &mut StageClock<'_>,
) -> Result<WrittenRun> {
    let folder = RunFolder::create(target, replace)?;
    clock.run(Stage::Write, || write_artefacts(found, &folder))?;
    let name = target.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let so_far = clock.seconds.clone();
    clock.run(Stage::Report, || {
        let page = page(found, &so_far, &name)?;
        folder.compact_json("report.json", &page)?;
        folder.text("report.html", &html(&page)?)
    })?;
    let summary = summary(found, &clock.seconds)?;
    folder.json("summary.json", &summary)?;
    Ok(WrittenRun { folder: folder.finish()?, summary })
}
