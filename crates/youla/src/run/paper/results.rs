//! The files of a results folder beside the rows of the loops: data first, then what is drawn from them.

use super::super::folder::replace_file;
use crate::report::story::{Block, Table};
use crate::report::{
    figure_csv, paper_figures, paper_story, paper_summary, paper_tables, story_html, story_methods, svg, table_csv,
};
use crate::study::Paper;
use crate::{Error, Result};
use std::path::Path;

/// Rows of Figs 4 and 5.
pub(super) const STUDY: &str = "study.csv";
/// Rows of the crossover map.
pub(super) const CROSSOVER: &str = "crossover.csv";

/// `summary.json`, then every figure as CSV and SVG and every table as CSV.
pub(super) fn write_figures(paper: &Paper, target: &Path) -> Result<()> {
    json(&target.join("summary.json"), &paper_summary(paper)?)?;
    let [figures, tables] = ["figures", "tables"].map(|name| target.join(name));
    for folder in [&figures, &tables] {
        std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.clone(), source })?;
    }
    let methods = story_methods();
    for table in paper_tables(paper)? {
        write_table(&table, target)?;
    }
    let drawn = paper_figures(paper)?;
    for figure in &drawn {
        replace_file(&figures.join(format!("{}.csv", figure.key)), &figure_csv(figure, &methods))?;
    }
    for figure in &drawn {
        replace_file(&figures.join(format!("{}.svg", figure.key)), &svg(figure, &methods)?)?;
    }
    Ok(())
}

/// `timing.json`, the tables of times, which [`paper_tables`] leaves out, and the page.
pub(super) fn write_page(paper: &Paper, target: &Path) -> Result<()> {
    json(&target.join("timing.json"), &paper.timing)?;
    let story = paper_story(paper)?;
    for block in story.sections.iter().flat_map(|section| &section.blocks) {
        if let Block::Table(table) = block {
            write_table(table, target)?;
        }
    }
    replace_file(&target.join("report.html"), &story_html(&story)?)
}

fn write_table(table: &Table, target: &Path) -> Result<()> {
    replace_file(&target.join("tables").join(format!("{}.csv", table.key)), &table_csv(table))
}

fn json(path: &Path, value: &impl serde::Serialize) -> Result<()> {
    let text =
        serde_json::to_string_pretty(value).map_err(|e| Error::Io { path: path.to_owned(), source: e.into() })?;
    replace_file(path, &(text + "\n"))
}
