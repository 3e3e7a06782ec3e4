//! The arrows of docs/architecture.md: which crate may use which, in its code and in its tests.

use super::files::{manifest, members};
use std::collections::BTreeSet;

/// Each crate with all crates of the workspace that it uses.
const ARROWS: [(&str, &[&str]); 16] = [
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
    ("youla-workbench", &["youla", "youla-io", "youla-loop", "youla-report", "youla-run"]),
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
            "youla-workbench",
        ],
    ),
    (
        "youla-py",
        &["youla", "youla-cli", "youla-greybox", "youla-io", "youla-loop", "youla-report", "youla-run", "youla-twin"],
    ),
    (
        "youla-tests",
        &[
            "youla",
            "youla-commission",
            "youla-greybox",
            "youla-io",
            "youla-link",
            "youla-loop",
            "youla-paper",
            "youla-report",
            "youla-rig",
            "youla-rt",
            "youla-run",
            "youla-twin",
        ],
    ),
];

#[test]
fn crates_use_only_what_the_page_shows() {
    assert_eq!(members().len(), ARROWS.len());
    for folder in members() {
        let manifest = manifest(&folder);
        let name = manifest["package"]["name"].as_str().expect("a name");
        for table in ["dependencies", "build-dependencies"] {
            let used = used(&manifest, table);
            assert!(
                used.is_subset(&arrows(name)),
                "{name} uses {used:?}; docs/architecture.md allows {:?}",
                arrows(name)
            );
        }
        // A feature of the crate itself may be asked for.
        let (used, mut below) = (used(&manifest, "dev-dependencies"), below(name));
        below.insert(name.to_owned());
        assert!(used.is_subset(&below), "the tests of {name} use {used:?}; below it are {below:?}");
    }
}

fn arrows(name: &str) -> BTreeSet<String> {
    let (_, arrows) = ARROWS.iter().find(|(listed, _)| *listed == name).expect("a crate of the page");
    arrows.iter().map(|name| (*name).to_owned()).collect()
}

/// All crates that a crate uses, or that those use.
fn below(name: &str) -> BTreeSet<String> {
    arrows(name).into_iter().flat_map(|used| below(&used).into_iter().chain([used])).collect()
}

/// Crates of the workspace in a table of a manifest, for all targets.
fn used(manifest: &toml::Table, table: &str) -> BTreeSet<String> {
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    let tables = targets.into_iter().flatten().filter_map(|(_, target)| target.get(table)).chain(manifest.get(table));
    let names = tables.filter_map(toml::Value::as_table).flatten().map(|(key, _)| key.clone());
    names.filter(|key| key.starts_with("youla")).collect()
}
