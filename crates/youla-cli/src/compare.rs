//! `youla compare`: finished runs beside each other.

use crate::output::{Failure, Form};
use crate::run_folder::place;
use crate::table::fitted;
use crate::terminal;
use clap::Args;
use std::path::{Path, PathBuf};
use youla_io::folder::require_place;
use youla_io::require_free;
use youla_report::data::EvidenceTable;
use youla_run::{Comparison, compare, write_comparison};

pub(crate) const EXAMPLES: &str = "\
Examples:
  youla compare runs/before-001 runs/after-001
  youla compare runs/order-*-001 --model hansen_reduced --out orders.html";

/// Which runs.
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Run folders; the others are compared with the first.
    #[arg(value_name = "RUN", required = true, num_args = 2..)]
    runs: Vec<PathBuf>,
    /// Model of each run: recommended, hansen, hansen_reduced, direct, grey_box or nominal.
    #[arg(long, value_name = "NAME", default_value = "recommended")]
    model: String,
    /// Page to write; its data are written next to it as JSON.
    #[arg(long, value_name = "FILE", default_value = "comparison.html", value_parser = place())]
    out: PathBuf,
    /// Replace the files if they are there.
    #[arg(long)]
    force: bool,
}

/// Writes page and data and prints the tables.
pub(crate) fn run(form: Form, args: &CompareArgs) -> Result<(), Failure> {
    require_place(&args.out)?;
    let read: Vec<&Path> = args.runs.iter().map(PathBuf::as_path).collect();
    require_free(&args.out, args.force, &read)?;
    require_free(&args.out.with_extension("json"), args.force, &read)?;
    let found = compare(&args.runs, &args.model)?;
    write_comparison(&found, &args.out, args.force)?;
    form.print(|| serde_json::json!(found), || text(&found, args))
}

fn text(found: &Comparison, args: &CompareArgs) -> String {
    let mut text = String::new();
    for table in &found.report.overview {
        text += &format!("{}\n{}\n", table.title, as_text(table));
    }
    for note in &found.report.notes {
        text += &format!("caution: {}\n", note.text);
    }
    text + &format!("report: {}", args.out.display())
}

fn as_text(table: &EvidenceTable) -> String {
    match table.rows.is_empty() {
        true => format!("{}\n", table.text),
        false => {
            let rows = [std::slice::from_ref(&table.columns), &table.rows].concat();
            fitted(&rows, terminal::width().unwrap_or(terminal::PLAIN))
        }
    }
}
