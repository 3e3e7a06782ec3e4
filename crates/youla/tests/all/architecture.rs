//! The order of the modules and of the crates: arrows go one way only.

use std::fs;
use std::path::{Path, PathBuf};

/// Each module uses only those before it.
const MODULES: [&str; 10] =
    ["error", "statistics", "linalg", "lti", "signal", "control", "factor", "identify", "reduce", "validate"];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(sources(&path)),
            false if path.extension().is_some_and(|e| e == "rs") => found.push(path),
            false => (),
        }
    }
    found
}

/// The text of a source without its comments and its unit tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

fn is_test(path: &Path) -> bool {
    path.iter().any(|part| {
        let part = part.to_string_lossy();
        let stem = part.trim_end_matches(".rs");
        stem == "fixtures" || stem == "reference" || stem.ends_with("tests")
    })
}

/// The modules of the crate that a source names, alone or in a list in braces.
fn named(code: &str) -> Vec<&'static str> {
    let mut found = Vec::new();
    for rest in code.split("crate::").skip(1) {
        let list = if rest.starts_with('{') { rest.split(';').next().unwrap_or(rest) } else { rest };
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let words = list.split(|c| !is_word(c)).filter(|word| !word.is_empty());
        let count = if rest.starts_with('{') { usize::MAX } else { 1 };
        let words: Vec<&str> = words.take(count).collect();
        found.extend(MODULES.into_iter().filter(|module| words.contains(module)));
    }
    found
}

#[test]
fn modules_use_only_those_before_them() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = Vec::new();
    let mut arrows = 0;
    for (place, module) in MODULES.iter().enumerate() {
        for path in sources(&root.join(module)).into_iter().filter(|path| !is_test(path)) {
            for used in named(&code(&path)) {
                let before = MODULES.iter().position(|m| *m == used).unwrap();
                arrows += usize::from(before < place);
                if before > place {
                    wrong.push(format!("{} uses {used}", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(arrows > 100, "only {arrows} arrows were found");
}

/// The method is compiled without files, charts and settings: its dependencies are these.
#[test]
fn the_method_depends_on_no_crate_above_it() {
    let manifest = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let mut names: Vec<&str> = manifest["dependencies"].as_table().unwrap().keys().map(String::as_str).collect();
    names.sort_unstable();
    let expected = [
        "faer",
        "pulp",
        "rand",
        "rand_chacha",
        "rand_distr",
        "rayon",
        "rustfft",
        "schemars",
        "serde",
        "thiserror",
        "youla-rt",
    ];
    assert_eq!(names, expected);
}
