//! `youla subspace`: a model straight from files of any length.

use crate::args::{Args, SubspaceArgs};
use crate::output::{Failure, Reading, say};
use crate::table;
use std::fs;
use std::path::Path;
use youla_io::TimeSource;
use youla_run::{LongRecords, identify_long, long_model_file, read_subspace_options};

/// Identifies, writes the model and prints what it is.
pub(crate) fn identify(args: &Args, asked: &SubspaceArgs) -> Result<(), Failure> {
    let options = asked.options.as_ref().map(read_subspace_options).transpose()?.unwrap_or_default();
    if let Some(path) = asked.out.as_ref().filter(|path| path.exists()) {
        return Err(youla_io::Error::OutputExists { path: path.clone() }.into());
    }
    let records = LongRecords {
        files: asked.files.clone(),
        inputs: asked.input.clone(),
        outputs: asked.output.clone(),
        time: TimeSource { column: asked.time.clone(), ts: asked.sample_time, ..TimeSource::default() },
        csv: asked.dialect.options(),
    };
    let reading = Reading::new(args.quiet || args.json);
    let found = identify_long(&records, &options, &mut |at| reading.at(at))?;
    let file = (args.json || asked.out.is_some()).then(|| long_model_file(&found, &records, &options)).transpose()?;
    reading.finish();
    let json = match &file {
        Some(file) => serde_json::to_string_pretty(file).map_err(|e| Failure::io(Path::new("the model"), e.into()))?,
        None => String::new(),
    };
    if let Some(path) = &asked.out {
        write(path, &(json.clone() + "\n"))?;
    }
    match (args.json, args.quiet) {
        (true, _) => say(&json),
        (_, true) => Ok(()),
        _ => say(&table::subspace(&found, peak_memory())?),
    }
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
