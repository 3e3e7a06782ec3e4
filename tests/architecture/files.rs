//! Members, sources, the length of files, the size of folders, and the version.

use std::fs;
use std::path::{Path, PathBuf};

/// The folder of the project.
pub(super) fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The manifest of a folder.
pub(super) fn manifest(folder: &Path) -> toml::Table {
    fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest").parse().expect("TOML")
}

/// The folders of all members of the workspace.
pub(super) fn members() -> Vec<PathBuf> {
    let manifest = manifest(&project());
    let patterns = manifest["workspace"]["members"].as_array().expect("members");
    let folders = patterns.iter().flat_map(|pattern| {
        let pattern = pattern.as_str().expect("a text");
        match pattern.strip_suffix("/*") {
            Some(folder) => entries(&project().join(folder)),
            None => vec![project().join(pattern)],
        }
    });
    folders.collect()
}

/// What is in a folder.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = fs::read_dir(folder).expect("readable").map(|e| e.expect("readable").path()).collect();
    all.sort();
    all
}

/// The sources below a folder, empty for none.
pub(super) fn sources(folder: &Path) -> Vec<PathBuf> {
    let inside = if folder.is_dir() { entries(folder) } else { Vec::new() };
    inside
        .into_iter()
        .flat_map(|path| match path.is_dir() {
            true => sources(&path),
            false => path.extension().is_some_and(|e| e == "rs").then_some(path).into_iter().collect(),
        })
        .collect()
}

/// Lines of the longest source; a file with more holds more than one idea.
const LONGEST: usize = 400;

#[test]
fn no_file_is_too_long() {
    for file in members().iter().flat_map(|folder| sources(folder)) {
        let lines = fs::read_to_string(&file).expect("readable").lines().count();
        assert!(lines <= LONGEST, "{} has {lines} lines, at most {LONGEST}", file.display());
    }
}

/// Files of the largest folder of sources; one with more is split by what its files hold.
const MOST: usize = 20;

#[test]
fn no_folder_is_too_full() {
    for folder in members().iter().flat_map(|folder| folders(&folder.join("src"))) {
        let files = entries(&folder).iter().filter(|path| path.is_file()).count();
        assert!(files <= MOST, "{} has {files} files, at most {MOST}", folder.display());
    }
}

/// A folder and those below it.
fn folders(folder: &Path) -> Vec<PathBuf> {
    let inside = if folder.is_dir() { entries(folder) } else { return Vec::new() };
    let below = inside.iter().filter(|path| path.is_dir()).flat_map(|path| folders(path));
    below.chain([folder.to_owned()]).collect()
}

/// The members, the crates that use each other, the citation and the change log name one version.
#[test]
fn one_version_everywhere() {
    let version = env!("CARGO_PKG_VERSION");
    let manifest = manifest(&project());
    let dependencies = manifest["workspace"]["dependencies"].as_table().expect("a table");
    for (name, dependency) in dependencies.iter().filter(|(name, _)| name.starts_with("youla")) {
        assert_eq!(dependency["version"].as_str(), Some(version), "{name}");
    }
    let text = |name: &str| fs::read_to_string(project().join(name)).expect("readable");
    assert!(text("CITATION.cff").lines().any(|line| line == format!("version: {version}")));
    assert!(text("CHANGELOG.md").contains(&format!("\n## [{version}]\n")));
}

/// What a published package states: it inherits the address of the project, and holds both licences.
#[test]
fn every_package_states_what_it_is() {
    let workspace = manifest(&project());
    let package = workspace["workspace"]["package"].as_table().expect("a table");
    assert_eq!(package["repository"], package["homepage"]);
    for folder in members() {
        let manifest = manifest(&folder);
        let package = manifest["package"].as_table().expect("a table");
        if package.get("publish").is_some() {
            continue;
        }
        assert!(package["description"].is_str(), "{}", folder.display());
        for key in ["license", "readme", "repository", "homepage", "keywords", "version"] {
            assert_eq!(package[key]["workspace"].as_bool(), Some(true), "{}: {key}", folder.display());
        }
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let text = |folder: &Path| fs::read_to_string(folder.join(licence)).expect("a licence");
            assert_eq!(text(&folder), text(&project()), "{}: {licence}", folder.display());
        }
    }
}
