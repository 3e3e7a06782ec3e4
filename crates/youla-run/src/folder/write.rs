//! Writes a run folder: data first, then the report drawn from them, summary.json last.

use crate::folder::write_artefacts;
use crate::page::page;
use crate::result::Identification;
use crate::stages::clock::{Stage, StageClock};
use crate::summary::{Summary, summary};
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use youla_io::folder::RunFolder;
use youla_report::{ReportData, html};

/// A finished run folder.
#[derive(Debug, Clone)]
pub struct WrittenRun {
    /// Where it is.
    pub folder: PathBuf,
    /// Its summary.json.
    pub summary: Summary,
}

/// Writes all artefacts, `report.json`, `report.html`, `response.json` and `summary.json` to `target`. Nothing is left behind on failure.
///
/// # Errors
/// [`youla_io::Error::OutputExists`], [`youla_io::Error::Io`].
pub fn write_run(
    found: &Identification,
    target: &Path,
    replace: bool,
    clock: &mut StageClock<'_>,
) -> Result<WrittenRun> {
    write_into(found, RunFolder::create(target, replace)?, clock)
}

/// The same to a folder that was claimed before the computation.
///
/// # Errors
/// As [`write_run`].
pub fn write_into(found: &Identification, folder: RunFolder, clock: &mut StageClock<'_>) -> Result<WrittenRun> {
    clock.run(Stage::Write, || write_artefacts(found, &folder))?;
    let name = folder.target().file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let so_far = clock.seconds.clone();
    clock.run(Stage::Report, || {
        let page = page(found, &summary(found, &so_far)?, &name)?;
        folder.compact_json("report.json", &page)?;
        // Drawn from the rounded numbers of report.json, so that `youla report` draws the same page again.
        let as_written = serde_json::to_string(&page).and_then(|text| serde_json::from_str(&text));
        let page: ReportData = as_written.map_err(|source| youla_report::Error::ReportData { source })?;
        folder.compact_json("response.json", &page.frequency)?;
        Ok::<_, Error>(folder.text("report.html", &html(&page)?)?)
    })?;
    let summary = summary(found, &clock.seconds)?;
    folder.json("summary.json", &summary)?;
    Ok(WrittenRun { folder: folder.finish()?, summary })
}
