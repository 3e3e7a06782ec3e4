//! The run folder: written beside its final place and renamed when whole, so that nothing half-written looks finished.

use crate::{Error, Result};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// A run folder that is being written. Dropped before [`RunFolder::finish`], it removes what it wrote.
#[derive(Debug)]
pub struct RunFolder {
    target: PathBuf,
    partial: PathBuf,
    replace: bool,
    finished: bool,
}

impl RunFolder {
    /// Begins a folder that will be `target`. An existing folder is refused unless it is empty, or `replace` is set and it
    /// is a run folder (holds a summary.json).
    ///
    /// # Errors
    /// [`Error::OutputExists`]; [`Error::Io`] where it cannot be written.
    pub fn create(target: &Path, replace: bool) -> Result<Self> {
        let occupied = match fs::read_dir(target) {
            Ok(mut entries) => entries.next().is_some(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => false,
            Err(source) => return Err(Error::Io { path: target.to_owned(), source }),
        };
        let replace = replace && target.join("summary.json").is_file();
        if occupied && !replace {
            return Err(Error::OutputExists { path: target.to_owned() });
        }
        let name = target.file_name().map_or_else(|| "run".into(), |n| n.to_string_lossy().into_owned());
        let partial = target.with_file_name(format!(".{name}.partial-{}", std::process::id()));
        fs::create_dir_all(&partial).map_err(|source| Error::Io { path: partial.clone(), source })?;
        Ok(RunFolder { target: target.to_owned(), partial, replace, finished: false })
    }

    /// Where a file is written now; its folder is made.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn path(&self, name: &str) -> Result<PathBuf> {
        let path = self.partial.join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.to_owned(), source })?;
        }
        Ok(path)
    }

    /// Writes a text file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn text(&self, name: &str, text: &str) -> Result<()> {
        let path = self.path(name)?;
        fs::write(&path, text).map_err(|source| Error::Io { path, source })
    }

    /// Writes a value as JSON for people.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn json(&self, name: &str, value: &impl Serialize) -> Result<()> {
        self.line(name, serde_json::to_string_pretty(value))
    }

    /// Writes a value as JSON on one line: for curves, of which a line per number would be mostly blanks.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn compact_json(&self, name: &str, value: &impl Serialize) -> Result<()> {
        self.line(name, serde_json::to_string(value))
    }

    fn line(&self, name: &str, text: serde_json::Result<String>) -> Result<()> {
        let text = text.map_err(|e| Error::Io { path: self.target.join(name), source: e.into() })?;
        self.text(name, &(text + "\n"))
    }

    /// Moves the whole folder to its place and returns it.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<PathBuf> {
        let io = |source| Error::Io { path: self.target.clone(), source };
        // The old run goes only when the new one is in its place.
        let old = self.partial.with_extension("old");
        if self.replace {
            fs::rename(&self.target, &old).map_err(io)?;
        }
        fs::rename(&self.partial, &self.target).map_err(io)?;
        self.finished = true;
        if self.replace {
            fs::remove_dir_all(&old).map_err(io)?;
        }
        Ok(self.target.clone())
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        if !self.finished {
            // Best effort: the error that led here is the one to report.
            let _ = fs::remove_dir_all(&self.partial);
        }
    }
}

/// The first folder `runs/<name>-<number>` below `parent` that does not exist yet.
pub fn unused_folder(parent: &Path, name: &str) -> PathBuf {
    let slug: String = name
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' })
        .collect::<String>()
        .split('-')
        .filter(|s| !s.is_empty())
        .collect::<Vec<_>>()
        .join("-");
    let slug = if slug.is_empty() { "run".into() } else { slug };
    let numbered = |k: u32| parent.join("runs").join(format!("{slug}-{k:03}"));
    (1..).map(numbered).find(|p| !p.exists()).unwrap_or_else(|| numbered(0))
}
