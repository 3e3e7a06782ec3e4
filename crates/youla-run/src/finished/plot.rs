//! Figures of a finished run for papers, from its data.

use crate::finished::redraw::read_report;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use youla::signal::unknown;
use youla_io::folder::replace_files;
use youla_report::{
    FigureChoice, Print, ReportData, RunDrawing, RunFigure, figure_csv, run_drawings, run_figures, svg_for,
};

/// Every figure that the run has.
const ALL: &str = "all";

/// A figure as it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Name of its files without ending.
    pub name: String,
    /// Title.
    pub title: String,
    /// What it shows, for the caption in the paper.
    pub caption: String,
    /// The drawing.
    pub svg: String,
    /// Its numbers.
    pub csv: String,
}

/// The figures that a finished run has, in the order of its page.
///
/// # Errors
/// [`youla_io::Error::MissingFile`] where there is no `report.json`, [`Error::NotAReport`] where it is of another kind, [`youla_io::Error::Io`].
pub fn plottable(run: &Path) -> Result<Vec<RunFigure>> {
    Ok(run_figures(&read_report(run)?)?)
}

/// Draws a figure of a finished run by its name, or `all` that it has, from its `report.json`. Nothing is written.
///
/// # Errors
/// Those of [`plottable`]; [`youla::Error::UnknownChannel`] for a figure, output, input, record or method that the run does not have,
/// with those it has; [`Error::ChoiceOfFigure`] for a choice that a figure does not know (`all` takes them where they are
/// known); [`Error::NothingToDraw`] where nothing of the figure is chosen; [`youla::Error::OutOfRange`] for a size that is too small.
pub fn plot(run: &Path, figure: &str, choice: &FigureChoice, print: &Print) -> Result<Vec<Plot>> {
    let report = read_report(run)?;
    let drawings = wanted(run, &report, figure, choice)?
        .into_iter()
        .map(|kind| run_drawings(&report, kind, choice))
        .collect::<Result<Vec<_>, _>>()?
        .concat();
    if drawings.is_empty() {
        return Err(Error::NothingToDraw { figure: figure.to_owned() });
    }
    let drawn = |RunDrawing { figure, methods }: &RunDrawing| {
        let svg = svg_for(figure, methods, print).map_err(|error| error.within(format!("figure {}", figure.key)))?;
        let (title, caption) = (figure.title.clone(), figure.caption.clone());
        Ok(Plot { name: figure.key.clone(), title, caption, svg, csv: figure_csv(figure, methods) })
    };
    drawings.iter().map(drawn).collect()
}

fn wanted(run: &Path, report: &ReportData, figure: &str, choice: &FigureChoice) -> Result<Vec<RunFigure>> {
    let there = run_figures(report)?;
    if figure == ALL {
        return Ok(there);
    }
    match there.iter().find(|kind| kind.key() == figure) {
        Some(kind) => match choice.made().find(|field| !kind.chosen_by().contains(field)) {
            None => Ok(vec![*kind]),
            Some(choice) => {
                let known = kind.chosen_by().iter().map(|field| (*field).to_owned()).collect();
                Err(Error::ChoiceOfFigure { figure: kind.key(), choice, known })
            }
        },
        None => {
            let known = [ALL].into_iter().chain(there.iter().map(|kind| kind.key())).map(String::from).collect();
            Err(unknown(&format!("the run {}", run.display()), figure, known).into())
        }
    }
}

/// Writes files into a folder, which is made, and returns their paths. Files of the same names are replaced; after an error none is.
///
/// # Errors
/// [`youla_io::Error::Io`].
pub fn write_plots(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<Vec<PathBuf>> {
    Ok(replace_files(folder, files)?)
}
