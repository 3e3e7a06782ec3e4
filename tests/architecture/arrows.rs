//! The arrows of docs/architecture.md: which crate may use which. The length of files, and the version.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Each crate with all crates of the workspace that it uses.
const ARROWS: [(&str, &[&str]); 14] = [
    ("youla-rt", &[]),
    ("youla-link", &["youla-rt"]),
    ("youla-rig", &["youla-link", "youla-rt"]),
    ("youla", &["youla-rt"]),
    ("youla-greybox", &["youla"]),
    ("youla-io", &["youla"]),
    ("youla-loop", &["youla"]),
    ("youla-report", &["youla"]),
    ("youla-run", &["youla", "youla-greybox", "youla-io", "youla-loop", "youla-report"]),
    (
        "youla-twin",
        &["youla", "youla-greybox", "youla-io", "youla-link", "youla-loop", "youla-rig", "youla-rt", "youla-run"],
    ),
    (
        "youla-commission",
        &[
            "youla",
            "youla-io",
            "youla-link",
            "youla-loop",
            "youla-report",
            "youla-rig",
            "youla-rt",
            "youla-run",
            "youla-twin",
        ],
    ),
    ("youla-paper", &["youla", "youla-greybox", "youla-io", "youla-report", "youla-rt", "youla-twin"]),
    (
        "youla-cli",
        &[
            "youla",
            "youla-commission",
            "youla-io",
            "youla-loop",
            "youla-paper",
            "youla-report",
            "youla-rig",
            "youla-run",
            "youla-twin",
        ],
    ),
    (
        "youla-py",
        &["youla", "youla-cli", "youla-greybox", "youla-io", "youla-loop", "youla-report", "youla-run", "youla-twin"],
    ),
];

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folders of all members of the workspace.
fn members() -> Vec<PathBuf> {
    let inside = |folder: &str| fs::read_dir(project().join(folder)).expect("members");
    ["crates", "studies"].into_iter().flat_map(inside).map(|entry| entry.expect("readable").path()).collect()
}

#[test]
fn crates_use_only_what_the_page_shows() {
    assert_eq!(members().len(), ARROWS.len());
    for folder in members() {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest");
        let manifest: toml::Table = manifest.parse().expect("TOML");
        let name = manifest["package"]["name"].as_str().expect("a name");
        let (_, expected) = ARROWS.iter().find(|(listed, _)| *listed == name).expect("a crate of the page");
        let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table);
        let found: BTreeSet<&str> = dependencies
            .into_iter()
            .flatten()
            .map(|(key, _)| key.as_str())
            .filter(|key| key.starts_with("youla"))
            .collect();
        let expected: BTreeSet<&str> = expected.iter().copied().collect();
        assert!(found.is_subset(&expected), "{name} uses {found:?}; docs/architecture.md allows {expected:?}");
    }
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

/// The program, the crates that use each other, the citation and the change log name one version.
#[test]
fn one_version_everywhere() {
    let version = env!("CARGO_PKG_VERSION");
    let text = |name: &str| fs::read_to_string(project().join(name)).expect("readable");
    let manifest: toml::Table = text("Cargo.toml").parse().expect("TOML");
    let dependencies = manifest["workspace"]["dependencies"].as_table().expect("a table");
    for (name, dependency) in dependencies.iter().filter(|(name, _)| name.starts_with("youla")) {
        assert_eq!(dependency["version"].as_str(), Some(version), "{name}");
    }
    assert!(text("CITATION.cff").lines().any(|line| line == format!("version: {version}")));
    assert!(text("CHANGELOG.md").contains(&format!("\n## [{version}]\n")));
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        match path.is_dir() {
            true => all.extend(sources(&path)),
            false => all.extend(path.extension().is_some_and(|e| e == "rs").then_some(path)),
        }
    }
    all
}
