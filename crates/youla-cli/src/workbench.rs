//! `youla workbench`: the page that identifies in a browser.

use crate::output::{Failure, Form};
use crate::run_folder::place;
use clap::Args;
use std::path::PathBuf;
use youla_io::export::write_export;

pub(crate) const EXAMPLES: &str = "\
Example:
  youla workbench
  youla workbench --out rig.html --no-open";

/// Where the page goes.
#[derive(Debug, Args)]
pub(crate) struct WorkbenchArgs {
    /// File to write.
    #[arg(long, value_name = "FILE", default_value = "workbench.html", value_parser = place())]
    out: PathBuf,
    /// Replace it if it is there.
    #[arg(long)]
    force: bool,
    /// Write the page only; do not open it in the browser.
    #[arg(long)]
    no_open: bool,
}

/// Writes the page and opens it; a machine without a browser is told where it is.
pub(crate) fn workbench(form: Form, args: &WorkbenchArgs) -> Result<(), Failure> {
    let page = youla_workbench::page().map_err(youla_run::Error::from)?;
    write_export(&args.out, page.as_bytes(), args.force)?;
    let opened = !args.no_open && open::that_detached(&args.out).is_ok();
    let file = args.out.display().to_string();
    form.print(
        || serde_json::json!({ "page": file, "opened": opened }),
        || if opened { format!("wrote {file} and opened it") } else { format!("wrote {file}: open it in a browser") },
    )
}
