//! `youla plot`: figures of a run as SVG, PNG and CSV.

use crate::output::{Failure, Form, say};
use crate::raster;
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
  youla plot runs/drive-001 verification --png --dpi 600 --out paper/figures
  youla plot runs/drive-001 poles --methods hansen,direct --outlines
                                                for programs that do not take the font in the file: Inkscape, LaTeX";

/// What is drawn, and how.
#[derive(Debug, Args)]
pub(crate) struct PlotArgs {
    /// A run folder.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// data, signals, order, stabilisation, verification, residuals, bode, nyquist, singular-values, poles, hankel, reduction, redesign, or all; without
    /// one, those that the run has are listed.
    #[arg(value_name = "FIGURE")]
    figure: Option<String>,
    /// Write SVG; so it is where neither --png nor --csv is given.
    #[arg(long, requires = "figure")]
    svg: bool,
    /// Write PNG.
    #[arg(long, requires = "figure")]
    png: bool,
    /// Write the numbers alone; SVG and PNG always have them beside them.
    #[arg(long, requires = "figure")]
    csv: bool,
    /// Folder for the files, made if need be; files of the same names are replaced. RUN/figures by default.
    #[arg(long, value_name = "DIR", requires = "figure")]
    out: Option<PathBuf>,
    /// Width on paper.
    #[arg(long, value_name = "CM", default_value_t = 17.0, allow_negative_numbers = true)]
    width: f64,
    /// Height on paper; what the panels ask for by default.
    #[arg(long, value_name = "CM", allow_negative_numbers = true)]
    height: Option<f64>,
    /// Pixels per inch of PNG.
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u32).range(30..=2400))]
    dpi: u32,
    /// In SVG, texts as outlines instead of the font, for programs that do not take a font from the file.
    #[arg(long, requires = "figure")]
    outlines: bool,
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
    let files = plots.iter().map(|plot| files(plot, args)).collect::<Result<Vec<_>, Failure>>()?.concat();
    let folder = args.out.clone().unwrap_or_else(|| args.run.join("figures"));
    let paths = write_plots(&folder, &files)?;
    youla_io::folder::add_to_list(&args.run, &paths)?;
    match (form.json, form.quiet) {
        (true, _) => {
            let about = |plot: &Plot| {
                let files = paths.iter().filter(|path| path.file_stem().is_some_and(|stem| stem == plot.name.as_str()));
                let files: Vec<String> = files.map(|path| path.display().to_string()).collect();
                serde_json::json!({ "figure": plot.name, "title": plot.title, "caption": plot.caption, "files": files })
            };
            say(&serde_json::Value::from(plots.iter().map(about).collect::<Vec<_>>()).to_string())
        }
        (_, true) => Ok(()),
        _ => paths.iter().try_for_each(|path| say(&path.display().to_string())),
    }
}

/// The files of one figure, the numbers last.
fn files(plot: &Plot, args: &PlotArgs) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let mut files = Vec::new();
    let mut add = |ending: &str, bytes: Vec<u8>| files.push((format!("{}.{ending}", plot.name), bytes));
    if args.svg || !(args.png || args.csv) {
        let svg = if args.outlines { raster::outlined(&plot.svg)? } else { plot.svg.clone() };
        add("svg", svg.into_bytes());
    }
    if args.png {
        add("png", raster::drawn(&plot.svg, args.dpi)?);
    }
    add("csv", plot.csv.clone().into_bytes());
    Ok(files)
}

fn list(form: Form, args: &PlotArgs) -> Result<(), Failure> {
    let figures = plottable(&args.run)?;
    match (form.json, form.quiet) {
        (true, _) => {
            let all = figures.iter().map(|f| serde_json::json!({ "figure": f.key(), "about": f.about() }));
            say(&serde_json::Value::from(all.collect::<Vec<_>>()).to_string())
        }
        (_, true) => Ok(()),
        _ => figures.iter().try_for_each(|figure| say(&format!("{:<16} {}", figure.key(), figure.about()))),
    }
}
