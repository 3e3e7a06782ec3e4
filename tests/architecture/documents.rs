//! What the documents name exists: files of the project, and items of its libraries.

use super::files::{project, sources};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Named in the documents, but made by whoever reads them or by the program.
const MADE: [&str; 3] = ["docs/decisions/NNNN-title.md", "8-redesign/controller.rs", "recommended.py"];

/// Folders of what is built or fetched.
const FOREIGN: [&str; 4] = ["target", ".git", "node_modules", ".venv"];

/// All files of the project.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("readable").map(|e| e.expect("readable").path());
    let is_ours = |path: &PathBuf| !FOREIGN.iter().any(|name| path.ends_with(name));
    entries.filter(is_ours).flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// The texts between single backquotes, with the file that has them; blocks of code are left out.
fn spans() -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for path in files(&project()) {
        let of_past = path.ends_with("CHANGELOG.md") || path.parent().is_some_and(|p| p.ends_with("docs/decisions"));
        if of_past || path.extension().is_none_or(|e| e != "md") {
            continue;
        }
        let text = fs::read_to_string(&path).expect("readable");
        let prose = text.split("```").step_by(2);
        let spans = prose.flat_map(|part| part.split('`').skip(1).step_by(2));
        found.extend(spans.map(|span| (path.clone(), span.to_owned())));
    }
    found
}

#[test]
fn files_that_the_documents_name_exist() {
    let there: Vec<PathBuf> = files(&project());
    let (mut missing, mut count) = (Vec::new(), 0);
    for (document, span) in spans() {
        let name = span.trim_start_matches("../").trim_start_matches("./");
        let is_path = name.chars().all(|c| c.is_ascii_alphanumeric() || "./_-".contains(c));
        let is_text = [".rs", ".md", ".py"].iter().any(|ending| name.len() > 3 && name.ends_with(ending));
        if !(is_path && is_text) || MADE.contains(&name) {
            continue;
        }
        count += 1;
        if !there.iter().any(|path| path.ends_with(name)) {
            missing.push(format!("{}: {span}", document.display()));
        }
    }
    assert!(missing.is_empty(), "no file of the project ends so: {missing:#?}");
    assert!(count > 100, "{count}");
}

#[test]
fn items_that_the_documents_name_exist() {
    let mut words = BTreeSet::new();
    for folder in ["crates", "studies", "firmware", "tests"] {
        for path in sources(&project().join(folder)) {
            let text = fs::read_to_string(path).expect("readable");
            words.extend(identifiers(&text).map(str::to_owned));
        }
    }
    let (mut missing, mut count) = (Vec::new(), 0);
    for (document, span) in spans() {
        if !span.contains("::") || span.contains(['"', '/', '=']) {
            continue;
        }
        count += 1;
        let unknown: Vec<&str> = identifiers(&span).filter(|word| !words.contains(*word)).collect();
        if !unknown.is_empty() {
            missing.push(format!("{}: {span}: {unknown:?}", document.display()));
        }
    }
    assert!(missing.is_empty(), "no source names these: {missing:#?}");
    assert!(count > 50, "{count}");
}

/// The words of a text that can be names of items.
pub(super) fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    words.filter(|word| word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_'))
}
