//! Several finished runs beside each other: fits, modes, responses and settings, and the distance of the models.
//!
//! A comparison is a report whose methods are the runs, so that one page draws both. Everything comes from the run folders
//! (numbers from `summary.json`, `7-validate/verdict.json` and the models, curves from `report.json`); nothing is identified again.

mod distances;
mod figures;
mod run;
mod settings;
mod tables;

pub use distances::Distance;

use crate::method;
use crate::page::models;
use crate::{Error, Result};
use run::FinishedRun;
use serde::Serialize;
use std::path::{Path, PathBuf};
use youla_io::folder::replace_files;
use youla_io::require_free;
use youla_report::data::{DrawnMethod, MethodRole, ReportData, SourceFile};
use youla_report::html;

/// Roles give each run a colour, dash and marker of its own.
const ROLES: [MethodRole; 6] = [
    MethodRole::Hansen,
    MethodRole::Direct,
    MethodRole::HansenReduced,
    MethodRole::Pem,
    MethodRole::HansenPem,
    MethodRole::PemMultiStart,
];

/// What a comparison found.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Names of the runs.
    pub runs: Vec<String>,
    /// Key of the model that is compared.
    pub model: String,
    /// The nu-gap of each pair, the first run of a pair before the second.
    pub distances: Vec<Distance>,
    /// The page as data.
    pub report: ReportData,
}

/// Compares one model (`recommended`, `hansen`, `hansen_reduced`, `direct`, `nominal`, `grey_box`) of several runs of one machine.
///
/// Responses are evaluated again from the models on the frequencies of all runs together. Runs must have the same numbers of
/// inputs and outputs; differing names, units, records and sample times are said on the page.
///
/// # Errors
/// [`youla::Error::OutOfRange`] for fewer than two runs, [`Error::NotAReport`], [`Error::NotASummary`], [`youla_io::Error::MissingFile`], [`youla_io::Error::NotAModel`] for
/// folders that are no finished runs, [`youla::Error::UnknownChannel`] for a model that a run does not hold, [`youla::Error::Ports`] where the
/// runs have different numbers of channels; those of the frequency responses.
///
/// ```no_run
/// let found = youla_run::compare(&["runs/before-001".into(), "runs/after-001".into()], "hansen")?;
/// youla_run::write_comparison(&found, "comparison.html".as_ref(), false)?;
/// # Ok::<(), youla_run::Error>(())
/// ```
pub fn compare(folders: &[PathBuf], model: &str) -> Result<Comparison> {
    if folders.len() < 2 {
        let what = "the number of runs to compare".into();
        return Err(Error::Method(youla::Error::OutOfRange { what, value: folders.len() as f64, must: "at least 2" }));
    }
    let model = if model == "recommended" { method::Method::Likelihood.key() } else { model };
    let runs = run::read(folders, model)?;
    let distances = distances::distances(&runs);
    let report = page(&runs, model, &distances)?;
    Ok(Comparison { runs: runs.into_iter().map(|r| r.name).collect(), model: model.to_owned(), distances, report })
}

/// Writes the page of a comparison, and its data as JSON beside it; neither where one of them cannot be written.
///
/// # Errors
/// [`youla_greybox::Error::BadName`] for a page that ends in `.json`, as the data do; [`youla_io::Error::FileExists`] for a file that is there, unless
/// `replace` is set; [`youla_io::Error::Io`], and those of [`html`].
pub fn write_comparison(found: &Comparison, page: &Path, replace: bool) -> Result<()> {
    let data = page.with_extension("json");
    let json = serde_json::to_vec(found).map_err(|source| Error::Report(youla_report::Error::ReportData { source }))?;
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if data == page {
        return Err(Error::GreyBox(youla_greybox::Error::BadName {
            name: name(page),
            problem: "is that of the data; a page ends in .html",
        }));
    }
    let files = [(name(&data), json), (name(page), html(&found.report)?.into_bytes())];
    let folder = page.parent().unwrap_or(Path::new(""));
    files.iter().try_for_each(|(name, _)| require_free(&folder.join(name), replace, &[]))?;
    Ok(replace_files(folder, &files).map(|_| ())?)
}

fn page(runs: &[FinishedRun], model: &str, distances: &[Distance]) -> Result<ReportData> {
    let first = &runs[0].report;
    let label = |key: &str| first.methods.iter().find(|m| m.key == key).map_or(key.to_owned(), |m| m.label.clone());
    let entries = || runs.iter().filter_map(|r| Some((r.key.as_str(), r.entry()?)));
    let same_time = runs.iter().all(|r| r.report.sample_time == first.sample_time);
    Ok(ReportData {
        title: format!("Comparison of {} runs", runs.len()),
        summary: format!("{} of each run, side by side.", label(model)),
        program: concat!("youla ", env!("CARGO_PKG_VERSION")).into(),
        sources: runs.iter().flat_map(sources).collect(),
        inputs: first.inputs.clone(),
        outputs: first.outputs.clone(),
        sample_time: first.sample_time.filter(|_| same_time),
        methods: runs.iter().enumerate().map(|(k, r)| method(k, r)).collect(),
        overview: vec![
            tables::overview(runs),
            tables::modes(runs),
            distances::table(runs, distances),
            settings::differences(runs)?,
        ],
        notes: tables::notes(runs),
        fits: entries().flat_map(|(key, model)| models::fits(key, model)).collect(),
        verification: figures::verification(runs, model),
        frequency: Some(figures::frequency(runs, model)?),
        poles: runs.iter().map(|r| figures::poles(r, same_time)).collect::<Result<_>>()?,
        modes: entries().flat_map(|(key, model)| models::modes(key, model)).collect(),
        certificates: entries().map(|(key, model)| models::certificate(key, model)).collect(),
        margins: entries().map(|(key, model)| models::margins(key, model)).collect(),
        margins_caption: "The gaps are those of each run to its own nominal and recommended model, in its own scales."
            .into(),
        ..ReportData::default()
    })
}

fn method(place: usize, run: &FinishedRun) -> DrawnMethod {
    DrawnMethod::new(&run.key, &run.name, ROLES.get(place).copied().unwrap_or(MethodRole::Other))
}

fn sources(run: &FinishedRun) -> Vec<SourceFile> {
    let of = |s: &SourceFile| SourceFile { purpose: format!("{}: {}", run.name, s.purpose), ..s.clone() };
    run.report.sources.iter().map(of).collect()
}
