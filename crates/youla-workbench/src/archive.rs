//! A run folder as one zip file, and back.

use crate::refusal::{Refusal, Result};
use serde_json::{Value, json};
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use youla_io::folder::files_below;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// The file by which an archive is known as that of a run.
const REPORT: &str = "report.json";
/// Bytes of all files of an archive of a run, at most: a folder of 1e7 samples has 0.3 GB, and the page keeps its files in memory.
const MOST: u64 = 1 << 30;

/// Packs a run folder into one file, in a folder of its name.
pub(crate) fn archive(run: &Path, file: &Path) -> Result<Value> {
    let io = |source| Refusal::at(run, source);
    let mut archive = ZipWriter::new(fs::File::create(file).map_err(|source| Refusal::at(file, source))?);
    let inside = run.file_name().map(PathBuf::from).unwrap_or_default();
    for name in files_below(run).map_err(io)? {
        let content = fs::read(run.join(&name)).map_err(io)?;
        let name = inside.join(name).to_string_lossy().replace('\\', "/");
        archive.start_file(name, SimpleFileOptions::default()).map_err(|e| zipped(file, &e))?;
        archive.write_all(&content).map_err(io)?;
    }
    archive.finish().map_err(|e| zipped(file, &e))?;
    Ok(json!({ "file": file }))
}

/// Unpacks the run folder of an archive into `out`; `run` is false where it holds none, and then nothing is written.
pub(crate) fn unpack(file: &Path, out: &Path) -> Result<Value> {
    unpack_at_most(file, out, MOST)
}

fn unpack_at_most(file: &Path, out: &Path, most: u64) -> Result<Value> {
    let mut archive = fs::File::open(file)
        .map_err(|source| Refusal::at(file, source))
        .and_then(|open| ZipArchive::new(open).map_err(|e| zipped(file, &e)))?;
    let reports = archive.file_names().filter(|name| Path::new(name).file_name().is_some_and(|last| last == REPORT));
    let Some(root) = reports.min_by_key(|name| name.len()).map(|name| Path::new(name).with_file_name("")) else {
        return Ok(json!({ "run": false }));
    };
    let mut left = most;
    for place in 0..archive.len() {
        let mut entry = archive.by_index(place).map_err(|e| zipped(file, &e))?;
        // A name that leads out of the archive is no file of a run.
        let Some(name) = entry.enclosed_name().filter(|_| entry.is_file()) else { continue };
        let Ok(name) = name.strip_prefix(&root) else { continue };
        let (path, mut content) = (out.join(name), Vec::new());
        // What an archive states of its sizes is not relied on.
        entry.by_ref().take(left + 1).read_to_end(&mut content).map_err(|source| Refusal::at(file, source))?;
        left = left.checked_sub(content.len() as u64).ok_or_else(|| too_large(file, most))?;
        let written = path.parent().map_or(Ok(()), fs::create_dir_all).and_then(|()| fs::write(&path, content));
        written.map_err(|source| Refusal::at(&path, source))?;
    }
    Ok(json!({ "run": true }))
}

fn too_large(file: &Path, most: u64) -> Refusal {
    Refusal::Text(format!("{}: its files have more than {most} bytes; drop the folder itself", file.display()))
}

fn zipped(file: &Path, problem: &ZipError) -> Refusal {
    Refusal::Text(format!("{}: {problem}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of 4000 bytes is unpacked where as many are allowed, and refused with that number where fewer are.
    #[test]
    fn an_archive_is_read_up_to_a_size() {
        let folder = std::env::temp_dir().join(format!("youla-archive-{}", std::process::id()));
        let (run, file) = (folder.join("run"), folder.join("run.zip"));
        fs::create_dir_all(&run).unwrap();
        fs::write(run.join(REPORT), vec![b' '; 4000]).unwrap();
        archive(&run, &file).unwrap();
        let [all, few] = [4000, 3999].map(|most| unpack_at_most(&file, &folder.join("out"), most));
        assert_eq!(all.unwrap(), json!({ "run": true }));
        assert_eq!(fs::read(folder.join("out").join(REPORT)).unwrap().len(), 4000);
        assert!(few.unwrap_err().to_string().contains("more than 3999 bytes"));
        fs::remove_dir_all(&folder).unwrap();
    }
}
