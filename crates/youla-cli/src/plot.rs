//! `youla plot`: figures of a run as SVG and CSV.

use crate::output::{Failure, Form, lines_of};
use crate::run_folder::place;
use clap::Args;
use std::path::PathBuf;
use youla_report::{FigureChoice, Print};
use youla_run::{Plot, plottable, write_plots};

pub(crate) const EXAMPLES: &str = "\
Examples:
  youla plot runs/drive-001                     which figures the run has
  youla plot runs/drive-001 all                 all of them as SVG and CSV, in runs/drive-001/figures
  youla plot runs/drive-001 bode --output y --input u --width 8.5
                                                one column wide
  youla plot runs/drive-001 poles --methods hansen,direct --out paper/figures";

/// What is drawn, and how.
#[derive(Debug, Args)]
pub(crate) struct PlotArgs {
    /// A run folder.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// data, signals, order, verification, residuals, bode, nyquist, singular-values, poles, hankel, reduction, redesign, or all; without
    /// one, those that the run has are listed.
    #[arg(value_name = "FIGURE")]
    figure: Option<String>,
    /// Write the numbers alone, without the SVG.
    #[arg(long, requires = "figure")]
    csv: bool,
    /// Folder for the files, made if need be; files of the same names are replaced. RUN/figures by default.
    #[arg(long, value_name = "DIR", requires = "figure", value_parser = place())]
    out: Option<PathBuf>,
    /// Width on paper.
    #[arg(long, value_name = "CM", default_value_t = 17.0, allow_negative_numbers = true)]
    width: f64,
    /// Height on paper; what the panels ask for by default.
    #[arg(long, value_name = "CM", allow_negative_numbers = true)]
    height: Option<f64>,
    /// Only this output; all by default.
    #[arg(long, value_name = "NAME")]
    output: Option<String>,
    /// Only this input.
    #[arg(long, value_name = "NAME")]
    input: Option<String>,
    /// Only this record.
    #[arg(long, value_name = "NAME")]
    record: Option<String>,
    /// Only these methods, by their keys in report.json, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    methods: Option<Vec<String>>,
}

/// Writes the files and says which, or lists the figures.
pub(crate) fn plot(form: Form, args: &PlotArgs) -> Result<(), Failure> {
    let Some(figure) = &args.figure else { return list(form, args) };
    let choice = FigureChoice {
        output: args.output.clone(),
        input: args.input.clone(),
        record: args.record.clone(),
        methods: args.methods.clone(),
    };
    let print = Print { width_cm: args.width, height_cm: args.height, ..Print::default() };
    let plots = youla_run::plot(&args.run, figure, &choice, &print)?;
    let files: Vec<_> = plots.iter().flat_map(|plot| files(plot, args.csv)).collect();
    let folder = args.out.clone().unwrap_or_else(|| args.run.join("figures"));
    let paths = write_plots(&folder, &files)?;
    youla_io::folder::add_to_list(&args.run, &paths)?;
    let about = |plot: &Plot| {
        let files = paths.iter().filter(|path| path.file_stem().is_some_and(|stem| stem == plot.name.as_str()));
        let files: Vec<String> = files.map(|path| path.display().to_string()).collect();
        serde_json::json!({ "figure": plot.name, "title": plot.title, "caption": plot.caption, "files": files })
    };
    form.print(|| plots.iter().map(about).collect(), || lines_of(&paths))
}

/// The files of one figure, the numbers last.
fn files(plot: &Plot, only_numbers: bool) -> Vec<(String, Vec<u8>)> {
    let svg = (!only_numbers).then(|| (format!("{}.svg", plot.name), plot.svg.clone().into_bytes()));
    let csv = (format!("{}.csv", plot.name), plot.csv.clone().into_bytes());
    svg.into_iter().chain([csv]).collect()
}

fn list(form: Form, args: &PlotArgs) -> Result<(), Failure> {
    let figures = plottable(&args.run)?;
    form.print(
        || figures.iter().map(|f| serde_json::json!({ "figure": f.key(), "about": f.about() })).collect(),
        || figures.iter().map(|f| format!("{:<16} {}", f.key(), f.about())).collect::<Vec<_>>().join("\n"),
    )
}
