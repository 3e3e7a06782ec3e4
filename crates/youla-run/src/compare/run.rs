//! What a comparison needs of a finished run.

use crate::finished::export::model_for_export;
use crate::finished::redraw::read_report;
use crate::folder::ModelFacts;
use crate::method::Method;
use crate::stages::validate::robustness::{DiskEntry, RobustnessEntry};
use crate::summary::Summary;
use crate::summary::entries::{ModeEntry, pairs};
use crate::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use youla::control::ChannelScales;
use youla::lti::VisibleMode;
use youla_io::export::NamedModel;
use youla_report::data::{Certificate, Fit, LoopMargins, Mode, ReportData};

/// A finished run with the model that is compared.
pub(super) struct FinishedRun {
    /// Key of the run as a method of the page.
    pub(super) key: String,
    /// Name of its folder, or its path where two folders have the same name.
    pub(super) name: String,
    /// What its report draws: curves and predictions.
    pub(super) report: ReportData,
    pub(super) summary: Summary,
    /// What the verification found of the model; `None` for a system that is not verified, as S.
    facts: Option<ModelFacts>,
    pub(super) model: NamedModel,
    /// Sizes of the channels of its estimation records, where there are any.
    pub(super) scales: Option<ChannelScales>,
}

impl FinishedRun {
    fn read(folder: &Path, place: usize, name: String, model: &str) -> Result<Self> {
        // The file of the recommended model has not the name of its method.
        let file = if model == Method::Likelihood.key() { "recommended" } else { model };
        let system = model_for_export(folder, Some(file))?;
        let (report, summary) = (read_report(folder)?, Summary::read(folder)?);
        let scales = summary.channel_scales.value().map(|s| ChannelScales::new(s.inputs.clone(), s.outputs.clone()));
        let scales = scales.transpose()?;
        let facts = facts(folder, model)?;
        Ok(FinishedRun { key: format!("run{}", place + 1), name, report, summary, facts, model: system, scales })
    }

    /// Fits of the model under the key of the run.
    pub(super) fn fits(&self) -> Vec<Fit> {
        let mut all = Vec::new();
        for r in self.facts.iter().flat_map(|facts| &facts.records) {
            let (method, record) = (&self.key, &r.record);
            let of = |(output, fit): (usize, &Option<f64>)| Fit {
                record: record.clone(),
                output,
                method: method.clone(),
                fit: *fit,
            };
            all.extend(r.fit.iter().enumerate().map(of));
        }
        all
    }

    /// Modes that the response of the model shows, with deviations where they are known.
    pub(super) fn modes(&self, model: &str) -> Vec<Mode> {
        let visible = self.model.system.visible_modes().ok();
        let residue = |hz: f64, zeta: f64| match &visible {
            None => Some(Vec::new()),
            Some(visible) => {
                let same = |m: &&VisibleMode| (m.mode.hz / hz - 1.0).abs() < 1e-4 && (m.mode.zeta - zeta).abs() < 1e-4;
                visible.modes.iter().find(same).map(|m| pairs(&m.residue))
            }
        };
        let of = |m: &ModeEntry| {
            let (hz, zeta) = (m.hz?, m.zeta?);
            let deviation = m.hz_deviation.zip(m.zeta_deviation).map(|(hz, zeta)| [hz, zeta]);
            Some(Mode { method: self.key.clone(), hz, zeta, deviation, residue: residue(hz, zeta)? })
        };
        let identified = self.summary.methods.get(model).map(|m| &m.modes);
        let modes = identified.or(self.facts.as_ref().map(|facts| &facts.modes));
        modes.into_iter().flatten().filter_map(of).collect()
    }

    /// The loop of the model with the controller that ran.
    pub(super) fn certificate(&self, model: &str) -> Option<Certificate> {
        let (facts, entry) = (self.facts.as_ref()?, self.summary.methods.get(model));
        let radius = |p: &[f64; 2]| p[0].hypot(p[1]);
        let worst = facts.closed_loop_poles.iter().copied().max_by(|a, b| radius(a).total_cmp(&radius(b)));
        Some(Certificate {
            method: self.key.clone(),
            order: facts.order,
            s_order: entry.and_then(|m| m.s_order),
            s_stable: entry.and_then(|m| m.s_stable),
            stabilised_by_controller: Some(facts.stabilised_by_controller),
            worst_closed_loop_pole: worst,
        })
    }

    /// Margins of that loop.
    pub(super) fn margins(&self, model: &str) -> Option<LoopMargins> {
        let given = self.summary.nominal.as_ref().filter(|_| model == "nominal").map(|n| &n.robustness);
        let known = self.summary.methods.get(model).map(|m| &m.robustness).or(given)?;
        Some(margins(&self.key, known))
    }
}

fn margins(key: &str, known: &RobustnessEntry) -> LoopMargins {
    let disks = [&known.input_disk_margin, &known.output_disk_margin].into_iter().flatten();
    let size = |d: &&DiskEntry| d.alpha.unwrap_or(f64::INFINITY);
    let disk = disks.min_by(|a, b| size(a).total_cmp(&size(b)));
    LoopMargins {
        method: key.to_owned(),
        refusal: known.refused.clone(),
        peak_sensitivity: known.peak_sensitivity,
        zone: known.iso_14839_zone.map(|zone| zone.to_string()),
        lowest_gain: known.lowest_gain,
        highest_gain: known.highest_gain,
        phase_deg: known.phase_margin_deg,
        delay_ms: known.delay_margin_s.map(|seconds| 1e3 * seconds),
        disk: disk.and_then(|d| d.alpha),
        disk_phase_deg: disk.and_then(|d| d.phase_deg),
        coprime: known.coprime_margin,
        gap_to_nominal: known.nu_gap_to_nominal,
        gap_to_hansen: known.nu_gap_to_hansen,
    }
}

/// The model in `7-validate/verdict.json`.
fn facts(folder: &Path, model: &str) -> Result<Option<ModelFacts>> {
    #[derive(Deserialize)]
    struct Verified {
        models: BTreeMap<String, ModelFacts>,
    }
    let path = folder.join("7-validate/verdict.json");
    let text = youla_io::read_text(&path)?;
    let mut verified: Verified =
        serde_json::from_str(&text).map_err(|source| Error::NotASummary { path: path.clone(), source })?;
    Ok(verified.models.remove(model))
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
