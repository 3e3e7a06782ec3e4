//! The arrows of docs/architecture.md: which crate may use which, and no circle among the modules of the method.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Each crate with all crates of the workspace that it uses.
const ARROWS: [(&str, &[&str]); 9] = [
    ("youla-rt", &[]),
    ("youla", &["youla-rt"]),
    ("youla-greybox", &["youla"]),
    ("youla-io", &["youla"]),
    ("youla-loop", &["youla"]),
    ("youla-report", &["youla"]),
    ("youla-run", &["youla", "youla-greybox", "youla-io", "youla-loop", "youla-report"]),
    ("youla-paper", &["youla", "youla-greybox", "youla-io", "youla-loop", "youla-report", "youla-rt", "youla-run"]),
    ("youla-cli", &["youla", "youla-io", "youla-loop", "youla-paper", "youla-report", "youla-run"]),
];

fn crates() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn crates_use_only_what_the_page_shows() {
    let mut names: Vec<String> = fs::read_dir(crates())
        .expect("the crates")
        .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let mut listed: Vec<&str> = ARROWS.iter().map(|(name, _)| *name).collect();
    listed.sort_unstable();
    assert_eq!(names, listed);
    for (name, expected) in ARROWS {
        let manifest = fs::read_to_string(crates().join(name).join("Cargo.toml")).expect("a manifest");
        let manifest: toml::Table = manifest.parse().expect("TOML");
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

#[test]
fn modules_of_the_method_form_no_circle() {
    let root = crates().join("youla/src");
    let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in sources(&root) {
        let place = file.strip_prefix(&root).expect("below");
        let module = place.components().next().expect("a module").as_os_str().to_string_lossy();
        let module = module.trim_end_matches(".rs").to_owned();
        if module == "lib" || place.ends_with("tests.rs") || place.ends_with("reference.rs") {
            continue;
        }
        let text = fs::read_to_string(&file).expect("readable");
        let text = text.split("#[cfg(test)]").next().unwrap_or_default();
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let used = code.flat_map(|line| line.split("crate::").skip(1).map(first_name)).filter(|name| *name != module);
        uses.entry(module.clone()).or_default().extend(used.filter(|name| root.join(name).exists()));
    }
    // Take away modules that use no other until none is left.
    while !uses.is_empty() {
        let leaf = uses.iter().find(|(_, used)| used.is_empty()).map(|(module, _)| module.clone());
        let Some(leaf) = leaf else { panic!("a circle among {uses:?}") };
        uses.remove(&leaf);
        for used in uses.values_mut() {
            used.remove(&leaf);
        }
    }
}

/// The module in what follows `crate::`.
fn first_name(path: &str) -> String {
    path.trim_start_matches('{').chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
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
