//! What a comparison needs of a finished run.

use crate::export::model_for_export;
use crate::redraw::read_report;
use crate::{Error, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};
use youla::control::ChannelScales;
use youla_io::export::NamedModel;
use youla_report::data::{Certificate, Fit, LoopMargins, Mode, ReportData};

/// A finished run with the model that is compared.
pub(super) struct FinishedRun {
    /// Key of the run as a method of the page.
    pub(super) key: String,
    /// Name of its folder, or its path where two folders have the same name.
    pub(super) name: String,
    pub(super) report: ReportData,
    pub(super) model: NamedModel,
    /// Sizes of the channels of its estimation records, where there are any.
    pub(super) scales: Option<ChannelScales>,
}

impl FinishedRun {
    fn read(folder: &Path, place: usize, name: String, model: &str) -> Result<Self> {
        let model = model_for_export(folder, Some(model))?;
        let report = read_report(folder)?;
        Ok(FinishedRun { key: format!("run{}", place + 1), name, report, model, scales: scales(folder)? })
    }

    /// What the run says of the model, under its own key.
    pub(super) fn fits(&self, model: &str) -> Vec<Fit> {
        let of = |f: &Fit| Fit { method: self.key.clone(), ..f.clone() };
        self.report.fits.iter().filter(|f| f.method == model).map(of).collect()
    }

    pub(super) fn modes(&self, model: &str) -> Vec<Mode> {
        let of = |m: &Mode| Mode { method: self.key.clone(), ..m.clone() };
        self.report.modes.iter().filter(|m| m.method == model).map(of).collect()
    }

    pub(super) fn certificates(&self, model: &str) -> Vec<Certificate> {
        let of = |c: &Certificate| Certificate { method: self.key.clone(), ..c.clone() };
        self.report.certificates.iter().filter(|c| c.method == model).map(of).collect()
    }

    pub(super) fn margins(&self, model: &str) -> Vec<LoopMargins> {
        let of = |m: &LoopMargins| LoopMargins { method: self.key.clone(), ..m.clone() };
        self.report.margins.iter().filter(|m| m.method == model).map(of).collect()
    }
}

/// Reads the runs.
///
/// # Errors
/// As [`super::compare`].
pub(super) fn read(folders: &[PathBuf], model: &str) -> Result<Vec<FinishedRun>> {
    let runs: Vec<FinishedRun> = folders
        .iter()
        .enumerate()
        .map(|(k, folder)| FinishedRun::read(folder, k, name(folders, folder), model))
        .collect::<Result<_>>()?;
    let first = (&runs[0].name, runs[0].model.system.inputs(), runs[0].model.system.outputs());
    for run in &runs[1..] {
        for (what, expected, found) in
            [("inputs", first.1, run.model.system.inputs()), ("outputs", first.2, run.model.system.outputs())]
        {
            if expected != found {
                let what = format!("the number of {what} of {}, compared with {},", run.name, first.0);
                return Err(Error::Method(youla::Error::Ports { what, expected, found }));
            }
        }
    }
    Ok(runs)
}

fn name(folders: &[PathBuf], folder: &Path) -> String {
    let short = |f: &Path| f.file_name().map(|n| n.to_string_lossy().into_owned());
    let alone = folders.iter().filter(|f| short(f) == short(folder)).count() == 1;
    short(folder).filter(|_| alone).unwrap_or_else(|| folder.display().to_string())
}

/// The sizes of the channels from `summary.json`.
fn scales(folder: &Path) -> Result<Option<ChannelScales>> {
    let path = folder.join("summary.json");
    let text = std::fs::read_to_string(&path)
        .map_err(|source| Error::File(youla_io::Error::Io { path: path.clone(), source }))?;
    let summary: Value =
        serde_json::from_str(&text).map_err(|source| Error::NotAReport { path: path.clone(), source })?;
    let sizes = |of: &str| -> Option<Vec<f64>> {
        summary["channel_scales"][of].as_array()?.iter().map(Value::as_f64).collect()
    };
    Ok(sizes("inputs").zip(sizes("outputs")).map(|(u, y)| ChannelScales::new(u, y)).transpose()?)
}
