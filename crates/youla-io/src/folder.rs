//! The run folder: written beside its final place and renamed when whole, so that nothing half-written looks finished.

use crate::error::{Error, Result};
use crate::open::{open, read_text};
use crate::target::is_within;
use serde::Serialize;
use std::collections::HashSet;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The list of all files of a run folder, one a line: what `--force` may replace.
const FILES: &str = "files.txt";
/// Held by the writer of an unfinished folder; the system lets go of it when the program ends in any way. It is empty until it is held:
/// who finds it empty cannot take it from a writer that has made it and not yet locked it.
const LOCK: &str = ".lock";

/// A run folder that is being written. Dropped before [`RunFolder::finish`], it removes what it wrote.
#[derive(Debug)]
pub struct RunFolder {
    target: PathBuf,
    partial: PathBuf,
    /// Folders above that did not exist before, innermost first.
    parents: Vec<PathBuf>,
    replace: bool,
    lock: Option<fs::File>,
    finished: bool,
}

impl RunFolder {
    /// Whether `target` can become a run folder: it does not exist, is empty, or is to be replaced and holds nothing but the files that a
    /// run wrote (they are listed in its files.txt). It must be possible to write it: what is made for
    /// that is removed again. Call it before a long computation.
    ///
    /// # Errors
    /// [`Error::OutputExists`]; [`Error::NotReplaced`] with the first foreign file; [`Error::Unwritable`] where it
    /// cannot be read or written, or is a file.
    pub fn check(target: &Path, replace: bool) -> Result<()> {
        Self::create(target, replace).map(drop)
    }

    fn check_free(target: &Path, replace: bool) -> Result<()> {
        let occupied = match fs::read_dir(target) {
            Ok(mut entries) => entries.next().is_some(),
            Err(e) if e.kind() == ErrorKind::NotFound => false,
            Err(source) => return Err(Error::Unwritable { path: target.to_owned(), source }),
        };
        match (occupied, replace) {
            (false, _) => Ok(()),
            (true, false) => Err(Error::OutputExists { path: target.to_owned() }),
            (true, true) => own_files(target).map(|_| ()),
        }
    }

    /// Begins a folder that will be `target`, under the conditions of [`RunFolder::check`]; until it is finished or dropped no other
    /// run can begin the same. What a killed program left of it is removed.
    ///
    /// # Errors
    /// Those of [`RunFolder::check`]; [`Error::BeingWritten`].
    pub fn create(target: &Path, replace: bool) -> Result<Self> {
        Self::check_free(target, replace)?;
        let name = target.file_name().map_or_else(|| "run".into(), |n| n.to_string_lossy().into_owned());
        let prefix = format!(".{name}.partial-");
        let taken = |partial: PathBuf| Error::BeingWritten { path: target.to_owned(), partial };
        if let Some(partial) = remove_left_over(target.parent().unwrap_or(Path::new("")), &prefix) {
            return Err(taken(partial));
        }
        let partial = target.with_file_name(format!("{prefix}{}", process()));
        let new = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let parents = target.ancestors().skip(1).take_while(new).map(Path::to_owned).collect();
        let io = |source| Error::Unwritable { path: target.to_owned(), source };
        let mut folder =
            RunFolder { target: target.to_owned(), partial, parents, replace, lock: None, finished: false };
        let above = folder.partial.parent().filter(|p| !p.as_os_str().is_empty());
        let made = above.map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::create_dir(&folder.partial));
        if let Err(source) = made {
            // It is another's: nothing of it is removed.
            folder.finished = source.kind() == ErrorKind::AlreadyExists;
            return Err(if folder.finished { taken(folder.partial.clone()) } else { io(source) });
        }
        let mut lock = fs::File::create(folder.partial.join(LOCK)).map_err(io)?;
        // On a file system without locks nobody else gets one either: then nothing is ever taken for left over.
        let _ = lock.try_lock();
        lock.write_all(b"held").map_err(io)?;
        folder.lock = Some(lock);
        Ok(folder)
    }

    /// Begins the first folder `runs/<name>-<number>` below `parent` that is not there or empty and that no other run writes.
    ///
    /// # Errors
    /// [`Error::Unwritable`] where it cannot be made.
    pub fn numbered(parent: &Path, name: &str) -> Result<Self> {
        let (runs, slug) = (parent.join("runs"), slug(name));
        for k in 1..u32::MAX {
            match Self::create(&runs.join(format!("{slug}-{k:03}")), false) {
                Err(Error::OutputExists { .. } | Error::BeingWritten { .. }) => {}
                other => return other,
            }
        }
        Err(Error::OutputExists { path: runs })
    }

    /// Where the files are until the folder is finished.
    pub fn unfinished(&self) -> &Path {
        &self.partial
    }

    /// Refuses to replace an older run from which a file is `read`: what it was made from would be lost.
    ///
    /// # Errors
    /// [`Error::NotReplaced`].
    pub fn require_unread(&self, read: &[PathBuf]) -> Result<()> {
        let Some(file) = read.iter().find(|file| is_within(file, &self.target)) else { return Ok(()) };
        let problem = format!("the run reads {} from it", file.display());
        Err(Error::NotReplaced { path: self.target.clone(), problem })
    }

    /// Where it will be.
    pub fn target(&self) -> &Path {
        &self.target
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

    /// Moves the whole folder to its place and returns it. Of an older run exactly its own files are removed.
    ///
    /// # Errors
    /// [`Error::Io`]; those of [`RunFolder::check`] where the place has changed since.
    pub fn finish(mut self) -> Result<PathBuf> {
        Self::check_free(&self.target, self.replace)?;
        let io = |source| Error::Io { path: self.target.clone(), source };
        // Removed while it is held: no other run can lock a file of this folder.
        fs::remove_file(self.partial.join(LOCK)).map_err(io)?;
        self.lock = None;
        let files = files_below(&self.partial).map_err(io)?;
        let list: String = files.iter().map(|name| format!("{}\n", name.display())).collect();
        fs::write(self.partial.join(FILES), list).map_err(io)?;
        let occupied = fs::read_dir(&self.target).is_ok_and(|mut entries| entries.next().is_some());
        let old = self.partial.with_extension("old");
        if occupied {
            // The old run is removed after the new one is in its place.
            own_files(&self.target)?;
            fs::rename(&self.target, &old).map_err(io)?;
        } else {
            // Some systems do not rename to an empty folder.
            let _ = fs::remove_dir(&self.target);
        }
        fs::rename(&self.partial, &self.target).map_err(io)?;
        self.finished = true;
        if occupied {
            remove_own(&old)?;
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

/// What tells this program from others that write beside it; in a browser there are none.
fn process() -> u32 {
    if cfg!(target_family = "wasm") { 0 } else { std::process::id() }
}

/// All files below a folder, relative to it, in order.
///
/// # Errors
/// Those of the file system.
pub fn files_below(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let (mut found, mut open) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(inner) = open.pop() {
        for entry in fs::read_dir(folder.join(&inner))? {
            let entry = entry?;
            let path = inner.join(entry.file_name());
            // A link is a file, wherever it leads.
            if entry.file_type()?.is_dir() { open.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    Ok(found)
}

/// The files of a run folder, if it holds no others.
fn own_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let io = |source| Error::Io { path: folder.to_owned(), source };
    let refused = |problem: String| Error::NotReplaced { path: folder.to_owned(), problem };
    let Ok(list) = read_text(&folder.join(FILES)) else {
        return Err(refused(format!("it has no {FILES}, which every run of this version writes")));
    };
    let listed: HashSet<PathBuf> = list.lines().chain([FILES]).map(PathBuf::from).collect();
    let files = files_below(folder).map_err(io)?;
    match files.iter().find(|name| !listed.contains(*name)) {
        Some(foreign) => Err(refused(format!("it holds {}, which no run wrote", foreign.display()))),
        None => Ok(files),
    }
}

/// Removes exactly the files of a run, and the folders that are empty then.
fn remove_own(folder: &Path) -> Result<()> {
    let io = |source| Error::Io { path: folder.to_owned(), source };
    let files = own_files(folder)?;
    files.iter().try_for_each(|name| fs::remove_file(folder.join(name))).map_err(io)?;
    let mut folders: Vec<&Path> = files.iter().filter_map(|name| name.parent()).collect();
    folders.sort_by_key(|name| std::cmp::Reverse(name.components().count()));
    folders.dedup();
    folders.iter().for_each(|name| drop(fs::remove_dir(folder.join(name))));
    Ok(())
}

/// Whether a folder, or a folder that is not there yet, is one that a run has begun and not finished.
pub fn is_partial(target: &Path) -> bool {
    let name = target.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let parent = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let begun = |entry: fs::DirEntry| entry.file_name().to_string_lossy().starts_with(&format!(".{name}.partial-"));
    name.starts_with('.') && name.contains(".partial-")
        || fs::read_dir(parent).into_iter().flatten().flatten().any(begun)
}

/// Removes unfinished folders whose writer has ended without removing them, and returns one whose writer has not, or of which the
/// system does not tell.
fn remove_left_over(parent: &Path, prefix: &str) -> Option<PathBuf> {
    let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    let mut written = None;
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.strip_prefix(prefix).is_none_or(|rest| rest.parse::<u32>().is_err()) {
            continue;
        }
        let path = entry.path().join(LOCK);
        let held = open(&path).ok().filter(|lock| lock.metadata().is_ok_and(|m| m.len() > 0));
        let abandoned = match held {
            // The lock of a writer that has just finished is no longer in the folder.
            Some(lock) => lock.try_lock().is_ok() && path.exists(),
            // Its writer is between two steps, or was killed there: a step takes far less than a minute.
            None => {
                entry.metadata().and_then(|m| m.modified()).is_ok_and(|t| t.elapsed().is_ok_and(|t| t.as_secs() > 60))
            }
        };
        let removed = abandoned && fs::remove_dir_all(entry.path()).is_ok();
        if !removed {
            written = Some(entry.path());
        }
    }
    written
}

/// Writes a file beside its final place and moves it there when whole; an older file stays until then.
pub fn replace_file(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let partial = path.with_file_name(format!(".{name}.partial-{}", process()));
    fs::write(&partial, content).and_then(|()| fs::rename(&partial, path)).map_err(|source| {
        // Best effort: the error that led here is the one to report.
        let _ = fs::remove_file(&partial);
        Error::Io { path: path.to_owned(), source }
    })
}

/// Whether a file can be written, before a long computation; what is made for that is removed again.
///
/// # Errors
/// [`Error::Unwritable`].
fn require_writable(path: &Path) -> Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let probe = path.with_file_name(format!(".{name}.partial-{}", process()));
    let made = fs::write(&probe, "").and_then(|()| fs::remove_file(&probe));
    made.map_err(|source| Error::Unwritable { path: path.to_owned(), source })
}

/// The same for a file whose folders are made if need be.
///
/// # Errors
/// [`Error::Unwritable`] with the path that is given.
pub fn require_place(path: &Path) -> Result<()> {
    let there = path.ancestors().skip(1).find(|p| p.as_os_str().is_empty() || p.exists()).unwrap_or(Path::new(""));
    require_writable(&there.join(path.file_name().unwrap_or_default())).map_err(|error| match error {
        Error::Unwritable { source, .. } => Error::Unwritable { path: path.to_owned(), source },
        other => other,
    })
}

/// Adds files that the program wrote into a run folder later to its list, so that they do not keep the folder from being replaced. Files
/// elsewhere, and folders without a list, are left alone.
///
/// # Errors
/// [`Error::Io`].
pub fn add_to_list(run: &Path, files: &[PathBuf]) -> Result<()> {
    let path = run.join(FILES);
    let Ok(list) = read_text(&path) else { return Ok(()) };
    let mut names: Vec<String> = list.lines().map(str::to_owned).collect();
    let inside = files.iter().filter_map(|file| file.strip_prefix(run).ok());
    for name in inside.map(|name| name.display().to_string()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    replace_file(&path, names.iter().map(|name| format!("{name}\n")).collect::<String>())
}

/// Writes files beside their final places and moves them there when all are whole; after an error none is changed.
pub fn replace_files(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<Vec<PathBuf>> {
    let new = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
    let parents: Vec<PathBuf> = folder.ancestors().take_while(new).map(Path::to_owned).collect();
    let partial = |name: &str| folder.join(format!(".{name}.partial-{}", process()));
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

/// The name as part of a file name.
fn slug(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    let words: Vec<&str> = plain.split('-').filter(|s| !s.is_empty()).collect();
    if words.is_empty() { "run".into() } else { words.join("-") }
}

#[cfg(test)]
mod tests;
