//! The files of a results folder beside the rows of the loops: data first, then what is drawn from them.

use crate::story::{paper_figures, paper_story, paper_summary, story_methods};
use crate::study::Paper;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use youla_io::folder::replace_file;
use youla_report::story::Block;
use youla_report::{figure_csv, story_html, svg, table_csv};

/// Rows of Figs 4 and 5.
pub(super) const STUDY: &str = "study.csv";
/// Rows of the crossover map.
pub(super) const CROSSOVER: &str = "crossover.csv";

/// `summary.json`, then every figure as CSV and as SVG.
pub(super) fn write_figures(paper: &Paper, target: &Path) -> Result<()> {
    json(&target.join("summary.json"), &paper_summary(paper)?)?;
    let figures = folder(target, "figures")?;
    let methods = story_methods();
    for figure in &paper_figures(paper)? {
        replace_file(&figures.join(format!("{}.csv", figure.key)), figure_csv(figure, &methods))?;
        replace_file(&figures.join(format!("{}.svg", figure.key)), &svg(figure, &methods)?)?;
    }
    Ok(())
}

/// `timing.json`, every table as CSV, those of times included, and the page.
pub(super) fn write_page(paper: &Paper, target: &Path) -> Result<()> {
    json(&target.join("timing.json"), &paper.timing)?;
    let story = paper_story(paper)?;
    let tables = folder(target, "tables")?;
    for block in story.sections.iter().flat_map(|section| &section.blocks) {
        if let Block::Table(table) = block {
            replace_file(&tables.join(format!("{}.csv", table.key)), table_csv(table))?;
        }
    }
    Ok(replace_file(&target.join("report.html"), &story_html(&story)?)?)
}

/// Makes a folder of the results.
fn folder(target: &Path, name: &str) -> Result<PathBuf> {
    let path = target.join(name);
    std::fs::create_dir_all(&path).map_err(|source| Error::File(youla_io::Error::Io { path: path.clone(), source }))?;
    Ok(path)
}

fn json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::File(youla_io::Error::Io { path: path.to_owned(), source: e.into() }))?;
    Ok(replace_file(path, &(text + "\n"))?)
}
