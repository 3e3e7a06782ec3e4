//! The report of a finished run, drawn again from its data.

use crate::{Error, Result};
use std::path::{Path, PathBuf};
use youla_io::folder::{is_partial, replace_file};
use youla_report::{ReportData, html};

/// Draws `report.html` of a run folder again from its `report.json` and returns its path.
///
/// # Errors
/// [`youla_io::Error::MissingFile`] where there is no `report.json`, [`Error::NotAReport`] where it is of another kind,
/// [`youla_io::Error::Io`]; the old report stays then.
pub fn redraw(run: &Path) -> Result<PathBuf> {
    let report = read_report(run)?;
    let path = run.join("report.html");
    replace_file(&path, html(&report)?)?;
    Ok(path)
}

/// The `report.json` of a run folder.
///
/// # Errors
/// [`youla_io::Error::MissingFile`], [`Error::NotAReport`], [`youla_io::Error::Io`].
pub(crate) fn read_report(run: &Path) -> Result<ReportData> {
    if run.is_file() {
        let problem = "this is a file; give the folder of a run, which holds report.json".into();
        return Err(Error::File(youla_io::Error::NotAModel { path: run.to_owned(), problem }));
    }
    let data = run.join("report.json");
    let unfinished = |problem| youla_io::Error::NotAModel { path: run.to_owned(), problem };
    let text = youla_io::read_text(&data).map_err(|error| interrupted(run).map_or(error, unfinished))?;
    serde_json::from_str(&text).map_err(|source| Error::NotAReport { path: data.clone(), source })
}

/// Of a folder without a report: whose it is, and the command that finishes it.
fn interrupted(run: &Path) -> Option<String> {
    let resumable = [("configuration.toml", "paper"), ("campaign.json", "commission")];
    if let Some((_, verb)) = resumable.into_iter().find(|(file, _)| run.join(file).is_file()) {
        let what = format!("this folder is of `youla {verb}`, not of `youla identify`, and has a page of its own");
        return Some(format!(
            "{what}; where it was interrupted, the same `youla {verb}` command with this --out resumes it"
        ));
    }
    let again = "the run was interrupted or still runs; a run is written as a whole: start the same `youla identify` command again";
    is_partial(run).then(|| again.to_owned())
}
