//! Blocks that are no commands, in the folder of their chapter.

use std::fs;
use std::path::Path;
use std::process::Command;

/// The language of a block.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Language {
    /// With scipy; `PYTHON` names the interpreter.
    Python,
    /// In Octave with its package control.
    Matlab,
    /// The body of a function with `u`, `y`, `alpha` and `beta` for one sample.
    C,
}

/// Runs the block, or compiles it.
pub(crate) fn run(name: &str, language: Language, text: &str, folder: &Path) {
    let mut command = match language {
        Language::Python => {
            let mut python = Command::new(std::env::var("PYTHON").unwrap_or_else(|_| "python3".into()));
            python.args(["-c", text]);
            python
        }
        Language::Matlab => {
            let mut octave = Command::new("octave-cli");
            octave.args(["--no-history", "--eval", &format!("pkg load control\n{text}")]);
            octave
        }
        Language::C => {
            fs::write(folder.join("block.c"), program(text)).expect("written");
            let mut gcc = Command::new("gcc");
            gcc.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "block.c"]);
            gcc
        }
    };
    let found = command.current_dir(folder).output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    assert!(found.status.success(), "{name}:\n{text}\n{}", String::from_utf8_lossy(&found.stderr));
}

fn program(text: &str) -> String {
    let (includes, body): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with("#include"));
    format!(
        "{}\nextern double u[8], y[8], alpha[8], beta[8];\nvoid block(void);\nvoid block(void)\n{{\n{}\n}}\n",
        includes.join("\n"),
        body.join("\n")
    )
}

/// Every key that a page shows is one of the file; `<...>` stands for any, and a list shows its first entry.
pub(crate) fn keys_are_of(place: &str, shown: &serde_json::Value, file: &serde_json::Value) {
    use serde_json::Value::{Array, Object};
    match (shown, file) {
        (Object(shown), Object(file)) => {
            for (key, value) in shown {
                let found = if key.starts_with('<') { file.values().next() } else { file.get(key) };
                let Some(found) = found else {
                    assert!(key.starts_with('<'), "{place}: no {key}");
                    continue;
                };
                keys_are_of(&format!("{place}.{key}"), value, found);
            }
        }
        (Array(shown), Array(file)) => {
            for (shown, file) in shown.iter().zip(file).take(1) {
                keys_are_of(&format!("{place}[0]"), shown, file);
            }
        }
        (Object(_) | Array(_), serde_json::Value::Null) => {}
        (Object(_) | Array(_), _) | (_, Object(_) | Array(_)) => panic!("{place}: {shown} is {file} in the file"),
        _ => {}
    }
}

/// Benches and examples that a command of cargo names are there.
pub(crate) fn targets_are_there(place: &str, command: &str, project: &Path) {
    let words: Vec<&str> = command.split_whitespace().collect();
    for pair in words.windows(2) {
        let folder = match pair[0] {
            "--bench" => "benches",
            "--example" => "examples",
            _ => continue,
        };
        let at = project.join("crates/youla-cli").join(folder);
        let there = at.join(format!("{}.rs", pair[1])).is_file() || at.join(pair[1]).join("main.rs").is_file();
        assert!(there, "{place}: {command}: no {}", pair[1]);
    }
}

/// A whole run.toml as it is; tables of one in place of those of the flexible drive, `[data]` in addition to its own; the declaration of a structure in a
/// table of its own.
pub(crate) fn run_settings(place: &str, text: &str, project: &Path) -> String {
    let read = |text: &str| text.parse::<toml::Table>().unwrap_or_else(|e| panic!("{place}: {e}\n{text}"));
    let mut block = read(text);
    if block.contains_key("name") {
        return text.to_owned();
    }
    if ["template", "a"].iter().any(|key| block.contains_key(*key)) {
        block = toml::Table::from_iter([("structure".to_owned(), block.into())]);
        block = toml::Table::from_iter([("grey_box".to_owned(), block.into())]);
    } else if let Some(grey_box) = block.get_mut("grey_box").and_then(toml::Value::as_table_mut) {
        let any = || read("template = \"mass-spring-damper\"").into();
        grey_box.entry("structure").or_insert_with(any);
    }
    let mut with = read(&fs::read_to_string(project.join("examples/flexible-drive/run.toml")).expect("readable"));
    with.remove("reduction");
    if let (Some(toml::Value::Table(more)), Some(toml::Value::Table(data))) =
        (block.remove("data"), with.get_mut("data"))
    {
        data.extend(more);
    }
    with.extend(block);
    with.to_string()
}
