//! `youla subspace`: a model straight from files of any length.

use crate::dialect::Dialect;
use crate::log_flags::places;
use crate::output::{Failure, Form, Reading, say};
use crate::table;
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};
use youla_io::folder::require_writable;
use youla_io::{ChannelRef, TimeSource};
use youla_run::{LongRecords, identify_long, long_model_file, read_subspace_options};

pub(crate) const EXAMPLES: &str = "\
Example:
  youla subspace log.csv.gz --input u --output x,y --time t
  youla subspace long.npy --input '#1,#2' --output '#3,#4' --sample-time 2e-4 --options options.toml --out model.json";

/// Files, channels and clock of `subspace`.
#[derive(Debug, Args)]
pub(crate) struct SubspaceArgs {
    /// Text (plain or gzip) or NumPy .npy (samples x channels); several files are several experiments.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Inputs, by name or as #3 for the third column, separated by commas.
    #[arg(long, value_name = "NAME", required = true, value_delimiter = ',')]
    input: Vec<ChannelRef>,
    /// Outputs, as the inputs.
    #[arg(long, value_name = "NAME", required = true, value_delimiter = ',')]
    output: Vec<ChannelRef>,
    /// Sample time in seconds.
    #[arg(long, value_name = "S", required_unless_present = "time", allow_negative_numbers = true)]
    sample_time: Option<f64>,
    /// Column with the time in seconds, for text files; with --sample-time both must agree.
    #[arg(long, value_name = "NAME")]
    time: Option<ChannelRef>,
    #[command(flatten)]
    dialect: Dialect,
    /// Options of the identification, as in [direct] of run.toml.
    #[arg(long, value_name = "FILE")]
    options: Option<PathBuf>,
    /// File for the model as JSON.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Identifies, writes the model and prints what it is.
pub(crate) fn identify(form: Form, args: &SubspaceArgs) -> Result<(), Failure> {
    let options = args.options.as_ref().map(read_subspace_options).transpose()?.unwrap_or_default();
    if let Some(path) = args.out.as_ref().filter(|path| path.exists()) {
        return Err(youla_io::Error::OutputExists { path: path.clone() }.into());
    }
    args.out.as_ref().map_or(Ok(()), |path| require_writable(path))?;
    args.files.iter().try_for_each(|file| readable(file))?;
    let records = LongRecords {
        files: args.files.clone(),
        inputs: places(&args.input),
        outputs: places(&args.output),
        time: TimeSource { column: args.time.clone(), ts: args.sample_time, ..TimeSource::default() },
        csv: args.dialect.options(),
    };
    let reading = Reading::new(form.quiet || form.json);
    let found = identify_long(&records, &options, &mut |at| reading.at(at))?;
    let file = (form.json || args.out.is_some()).then(|| long_model_file(&found, &records, &options)).transpose()?;
    reading.finish();
    let json = match &file {
        Some(file) => serde_json::to_string_pretty(file).map_err(|e| Failure::io(Path::new("the model"), e.into()))?,
        None => String::new(),
    };
    if let Some(path) = &args.out {
        write(path, &(json.clone() + "\n"))?;
    }
    match (form.json, form.quiet) {
        (true, _) => say(&json),
        (_, true) => Ok(()),
        _ => say(&table::subspace(&found, peak_memory())?),
    }
}

/// Refuses by their names files that are read as a whole, which this verb does not do.
fn readable(file: &Path) -> Result<(), Failure> {
    let extension = file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let found = match extension.as_str() {
        "mat" => "a MATLAB file",
        "h5" | "hdf5" => "an HDF5 file",
        "npz" => "a NumPy archive",
        "parquet" => "a Parquet file",
        _ => return Ok(()),
    };
    let remedy = "`youla subspace` reads text and .npy of any length; `youla identify` reads this file";
    Err(youla_io::Error::FormatNotRead { path: file.to_owned(), found, remedy }.into())
}

/// The most memory that the program has held, bytes; known on Linux only.
fn peak_memory() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024.0 * line.split_whitespace().next()?.parse::<f64>().ok()?)
}

/// All of the file or none of it.
fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    let part = Path::new(&name);
    fs::write(part, text).and_then(|()| fs::rename(part, path)).map_err(|source| {
        // Best effort: the error that led here is the one to report.
        let _ = fs::remove_file(part);
        Failure::io(path, source)
    })
}
