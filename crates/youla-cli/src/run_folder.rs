//! Where a run goes, and where its settings look for files.

use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use std::path::{Path, PathBuf};

/// Where a run goes.
#[derive(Debug, Args)]
pub(crate) struct OutputFolder {
    /// Run folder to write; runs/<name>-<number> by default.
    #[arg(long, value_name = "DIR", value_parser = place())]
    pub(crate) out: Option<PathBuf>,
    /// Replace the run folder given by --out if it is one.
    #[arg(long, requires = "out")]
    pub(crate) force: bool,
}

/// The folder to which the paths in a settings file are relative.
pub(crate) fn folder_of(settings: &Path) -> PathBuf {
    settings.parent().map_or_else(PathBuf::new, Path::to_owned)
}

/// Where results go: a file or a folder, never a stream.
pub(crate) fn place() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| match path.to_str() {
        Some("-") => {
            Err("results go to a file or folder; name one, or `./-`; --json prints the result on standard output")
        }
        _ => Ok(path),
    })
}
