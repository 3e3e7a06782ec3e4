//! What a comparison needs of a finished run.

use crate::finished::export::model_for_export;
use crate::finished::redraw::read_report;
use crate::method::Method;
use crate::summary::Summary;
use crate::summary::model::ModelEntry;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use youla::control::ChannelScales;
use youla_io::export::NamedModel;
use youla_report::data::ReportData;

/// A finished run with the model that is compared.
pub(super) struct FinishedRun {
    /// Key of the run as a method of the page.
    pub(super) key: String,
    /// Name of its folder, or its path where two folders have the same name.
    pub(super) name: String,
    /// What its report draws: curves and predictions.
    pub(super) report: ReportData,
    pub(super) summary: Summary,
    /// Key of the model that is compared.
    compared: String,
    pub(super) model: NamedModel,
    /// Sizes of the channels of its estimation records, where there are any.
    pub(super) scales: Option<ChannelScales>,
}

impl FinishedRun {
    fn read(folder: &Path, place: usize, name: String, model: &str) -> Result<Self> {
        // The file of the recommended model has not the name of its method.
        let file = if model == Method::Likelihood.key() { "recommended" } else { model };
        let (report, summary) = (read_report(folder)?, Summary::read(folder)?);
        let system = model_for_export(folder, Some(file))?;
        let scales = summary.channel_scales.value().map(|s| ChannelScales::new(s.inputs.clone(), s.outputs.clone()));
        let scales = scales.transpose()?;
        Ok(FinishedRun {
            key: format!("run{}", place + 1),
            name,
            report,
            summary,
            compared: model.to_owned(),
            model: system,
            scales,
        })
    }

    /// What the run found of the model; `None` for a system that is not verified, as S.
    pub(super) fn entry(&self) -> Option<&ModelEntry> {
        let method = Method::ALL.into_iter().find(|method| method.key() == self.compared)?;
        self.summary.model(method)
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
