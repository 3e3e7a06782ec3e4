//! The run folder: written beside its final place and renamed when whole, so that nothing half-written looks finished.

use crate::error::{Error, Result};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// A run folder that is being written. Dropped before [`RunFolder::finish`], it removes what it wrote.
#[derive(Debug)]
pub struct RunFolder {
    target: PathBuf,
    partial: PathBuf,
    /// Folders above that did not exist before, innermost first.
    parents: Vec<PathBuf>,
    replace: bool,
    finished: bool,
}

impl RunFolder {
    /// Whether `target` can become a run folder: it does not exist, is empty, or is to be replaced and is a run folder
    /// (contains a summary.json). Nothing is written; call it before a long computation.
    ///
    /// # Errors
    /// [`Error::OutputExists`]; [`Error::Io`] where it cannot be read or is a file.
    pub fn check(target: &Path, replace: bool) -> Result<()> {
        let occupied = match fs::read_dir(target) {
            Ok(mut entries) => entries.next().is_some(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => false,
            Err(source) => return Err(Error::Io { path: target.to_owned(), source }),
        };
        if occupied && !(replace && is_run_folder(target)) {
            return Err(Error::OutputExists { path: target.to_owned() });
        }
        Ok(())
    }

    /// Begins a folder that will be `target`, under the conditions of [`RunFolder::check`].
    ///
    /// # Errors
    /// Those of [`RunFolder::check`]; [`Error::Io`] where it cannot be written.
    pub fn create(target: &Path, replace: bool) -> Result<Self> {
        Self::check(target, replace)?;
        let name = target.file_name().map_or_else(|| "run".into(), |n| n.to_string_lossy().into_owned());
        let partial = target.with_file_name(format!(".{name}.partial-{}", std::process::id()));
        let new = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let parents = target.ancestors().skip(1).take_while(new).map(Path::to_owned).collect();
        let replace = replace && is_run_folder(target);
        let folder = RunFolder { target: target.to_owned(), partial, parents, replace, finished: false };
        fs::create_dir_all(&folder.partial).map_err(|source| Error::Io { path: target.to_owned(), source })?;
        Ok(folder)
    }

    /// Writes a file by `write`, which is called with its temporary path; creates its folder. Errors state the final path.
    ///
    /// # Errors
    /// [`Error::Io`], and those of `write`.
    pub fn file(&self, name: &str, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let path = self.partial.join(name);
        let at_target = |source| Error::Io { path: self.target.join(name), source };
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(at_target)?;
        }
        write(&path).map_err(|error| match error {
            Error::Io { source, .. } => at_target(source),
            other => other,
        })
    }

    /// Writes a text file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn text(&self, name: &str, text: &str) -> Result<()> {
        self.file(name, |path| fs::write(path, text).map_err(|source| Error::Io { path: path.to_owned(), source }))
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
        // The old run is removed after the new one is in its place.
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
            // Only those that are empty go.
            let _ = self.parents.iter().try_for_each(fs::remove_dir);
        }
    }
}

fn is_run_folder(folder: &Path) -> bool {
    folder.join("summary.json").is_file()
}

/// Writes a text beside its final place and moves it there when whole; an older file stays until then.
pub fn replace_file(path: &Path, text: &str) -> Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let partial = path.with_file_name(format!(".{name}.partial-{}", std::process::id()));
    fs::write(&partial, text).and_then(|()| fs::rename(&partial, path)).map_err(|source| {
        // Best effort: the error that led here is the one to report.
        let _ = fs::remove_file(&partial);
        Error::Io { path: path.to_owned(), source }
    })
}

/// Rejects names of files that exist in a folder.
///
/// # Errors
/// [`Error::FileExists`] with the first.
pub fn refuse_existing(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<()> {
    match files.iter().map(|(name, _)| folder.join(name)).find(|path| path.exists()) {
        Some(path) => Err(Error::FileExists { path }),
        None => Ok(()),
    }
}

/// Writes files beside their final places and moves them there when all are whole; after an error none is changed.
pub fn replace_files(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<Vec<PathBuf>> {
    let new = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
    let parents: Vec<PathBuf> = folder.ancestors().take_while(new).map(Path::to_owned).collect();
    let partial = |name: &str| folder.join(format!(".{name}.partial-{}", std::process::id()));
    let written = fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.to_owned(), source });
    let written = written.and_then(|()| {
        files.iter().try_for_each(|(name, bytes)| {
            // A file cannot take the place of a folder, which would be found only when others have been moved.
            let place = match folder.join(name).is_dir() {
                true => Err(std::io::ErrorKind::IsADirectory.into()),
                false => Ok(()),
            };
            place
                .and_then(|()| fs::write(partial(name), bytes))
                .map_err(|source| Error::Io { path: folder.join(name), source })
        })
    });
    let moved = written.and_then(|()| {
        let place = |(name, _): &(String, Vec<u8>)| {
            let path = folder.join(name);
            fs::rename(partial(name), &path).map_err(|source| Error::Io { path: path.clone(), source }).map(|()| path)
        };
        files.iter().map(place).collect::<Result<Vec<_>>>()
    });
    moved.inspect_err(|_| {
        // Best effort: the error that led here is the one to report. Only folders that are empty go.
        files.iter().for_each(|(name, _)| drop(fs::remove_file(partial(name))));
        let _ = parents.iter().try_for_each(fs::remove_dir);
    })
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
