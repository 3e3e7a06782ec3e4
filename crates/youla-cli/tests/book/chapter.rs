//! What a chapter asks to be done: its fenced blocks.
//!
//! - `console`: lines `$ youla ...`, with `exit code 2` on the line after a command that ends so;
//! - `text edit=FILE`: lines `old => new`, where `\n` is a new line;
//! - `toml`: tables of run.toml;
//! - `rust,noplayground file=FILE`: one of the examples, which other tests run.

use std::fs;
use std::path::{Path, PathBuf};

/// One thing to do.
pub(crate) enum Step {
    Run { arguments: Vec<String>, code: i32 },
    Edit { file: String, from: String, to: String },
    Settings(String),
    Example { file: String, text: String },
}

/// The chapters in a folder, by name.
pub(crate) fn chapters(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the book");
    let mut found: Vec<PathBuf> = entries.map(|e| e.expect("readable").path()).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == "md"));
    found.sort();
    assert!(!found.is_empty());
    found
}

/// The steps of a chapter in their order.
pub(crate) fn steps(text: &str) -> Vec<Step> {
    let mut found = Vec::new();
    for (k, block) in text.split("```").enumerate() {
        if k % 2 == 0 {
            continue;
        }
        let (kind, body) = block.split_once('\n').expect("a kind");
        match kind.split_once(' ').unwrap_or((kind, "")) {
            ("console", _) => found.extend(commands(body)),
            ("toml", _) => found.push(Step::Settings(body.to_owned())),
            ("rust,noplayground", file) => {
                let file = file.strip_prefix("file=").expect("file=FILE").to_owned();
                found.push(Step::Example { file, text: body.to_owned() });
            }
            ("text", rest) => {
                let file = rest.strip_prefix("edit=");
                found.extend(file.into_iter().flat_map(|file| body.lines().map(move |line| edit(file, line))));
            }
            (kind, _) => panic!("a block of the kind {kind:?}"),
        }
    }
    found
}

fn commands(body: &str) -> Vec<Step> {
    let mut found: Vec<Step> = Vec::new();
    for line in body.lines() {
        if let Some(command) = line.strip_prefix("$ youla ") {
            let arguments = command.split_whitespace().map(|word| word.trim_matches('\'').to_owned()).collect();
            found.push(Step::Run { arguments, code: 0 });
        } else if let Some(stated) = line.strip_prefix("exit code ") {
            let stated = stated.parse().expect("a code");
            match found.last_mut() {
                Some(Step::Run { code, .. }) => *code = stated,
                _ => panic!("an exit code without a command"),
            }
        } else {
            panic!("not a command: {line:?}");
        }
    }
    found
}

fn edit(file: &str, line: &str) -> Step {
    let (from, to) = line.split_once(" => ").expect("old => new");
    Step::Edit { file: file.to_owned(), from: from.to_owned(), to: to.replace("\\n", "\n") }
}
