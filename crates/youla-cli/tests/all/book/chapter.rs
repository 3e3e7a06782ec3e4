//! What a chapter asks to be done: its fenced blocks.
//!
//! - nothing: lines `youla ...`, and `cargo ...` for the project itself, whose benches and examples must be there;
//! - `console`: lines `$ youla ...`, with `exit code 2` on the line after a command that ends so;
//! - `text edit=FILE`: lines `old => new`, where `\n` is a new line;
//! - `toml`: tables of run.toml; with `file=FILE` the whole of it, which is written;
//! - `rust,noplayground file=FILE`: one of the examples, which other tests run;
//! - `rust,ignore file=FILE`: lines of one of the examples;
//! - `python`, `matlab`, `c`: run or compiled by ignored tests, which need the language;
//! - `python,package`: run by the tests of `crates/youla-py`, which have the package `youla`;
//! - `json keys=FILE`: an extract of a file;
//! - `sh`: commands for the project;
//! - `text` alone and `latex` are to be read.

use super::blocks::Language;

/// One thing to do.
pub(crate) enum Step {
    /// Standard output goes to the file, where one is named.
    Run {
        arguments: Vec<String>,
        code: i32,
        to: Option<String>,
    },
    Edit {
        file: String,
        from: String,
        to: String,
    },
    Settings(String),
    Write {
        file: String,
        text: String,
    },
    Example {
        file: String,
        text: String,
    },
    Excerpt {
        file: String,
        text: String,
    },
    Other {
        language: Language,
        text: String,
    },
    Keys {
        file: String,
        text: String,
    },
    Project {
        command: String,
    },
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
            ("", _) => found.extend(body.lines().map(plain)),
            ("toml", file) if !file.is_empty() => {
                let file = file.strip_prefix("file=").expect("file=FILE").to_owned();
                found.push(Step::Write { file, text: body.to_owned() });
            }
            ("toml", _) => found.push(Step::Settings(body.to_owned())),
            ("rust,noplayground", file) => {
                let file = file.strip_prefix("file=").expect("file=FILE").to_owned();
                found.push(Step::Example { file, text: body.to_owned() });
            }
            ("rust,ignore", file) => {
                let file = file.strip_prefix("file=").expect("file=FILE").to_owned();
                found.push(Step::Excerpt { file, text: body.to_owned() });
            }
            ("text", rest) => {
                let file = rest.strip_prefix("edit=");
                found.extend(file.into_iter().flat_map(|file| body.lines().map(move |line| edit(file, line))));
            }
            ("python", _) => found.push(Step::Other { language: Language::Python, text: body.to_owned() }),
            ("matlab", _) => found.push(Step::Other { language: Language::Matlab, text: body.to_owned() }),
            ("c", _) => found.push(Step::Other { language: Language::C, text: body.to_owned() }),
            ("json", file) => {
                let file = file.strip_prefix("keys=").expect("keys=FILE").to_owned();
                found.push(Step::Keys { file, text: body.to_owned() });
            }
            ("sh", _) => found.extend(body.lines().map(|line| Step::Project { command: line.to_owned() })),
            ("latex" | "python,package", _) => {}
            (kind, _) => panic!("a block of the kind {kind:?}"),
        }
    }
    found
}

fn commands(body: &str) -> Vec<Step> {
    let mut found: Vec<Step> = Vec::new();
    for line in body.lines() {
        if let Some(command) = line.strip_prefix("$ youla ") {
            found.push(run(command));
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

fn run(command: &str) -> Step {
    let (command, to) = command.split_once(" > ").map_or((command, None), |(c, to)| (c, Some(to.to_owned())));
    let arguments = command.split_whitespace().map(|word| word.trim_matches('\'').to_owned()).collect();
    Step::Run { arguments, code: 0, to }
}

fn plain(line: &str) -> Step {
    match line.strip_prefix("youla ") {
        Some(command) => run(command),
        None if line.starts_with("cargo ") => Step::Project { command: line.to_owned() },
        None => panic!("not a command: {line:?}"),
    }
}

fn edit(file: &str, line: &str) -> Step {
    let (from, to) = line.split_once(" => ").expect("old => new");
    Step::Edit { file: file.to_owned(), from: from.to_owned(), to: to.replace("\\n", "\n") }
}
