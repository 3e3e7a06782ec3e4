//! The book, `docs/book`: every command runs in the order of its chapter and ends as the chapter says, every edit finds its text,
//! every table of settings is one that run.toml takes, every link leads somewhere.
#![allow(missing_docs)]

mod chapter;

use chapter::{Step, chapters, steps};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
}

#[test]
fn commands_and_edits_do_what_the_chapters_say() {
    for path in chapters(&docs().join("book")) {
        let text = fs::read_to_string(&path).expect("readable");
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if text.contains("../shared/data") || text.contains("examples/qube") {
            let data = docs().join("../../shared/data");
            if !data.is_dir() {
                println!("skipped: {name}: the measured data are not beside the project");
                continue;
            }
        }
        run_chapter(&name, &steps(&text));
    }
}

/// The chapter in a folder of its own, from which `../shared` and `../../examples` lead to where they lead from the project.
fn run_chapter(name: &str, steps: &[Step]) {
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book").join(name);
    let _ = fs::remove_dir_all(&root);
    let folder = root.join("project").join("work");
    fs::create_dir_all(&folder).expect("a temporary folder");
    let project = docs().join("..").canonicalize().expect("the project");
    let at = |text: &str| {
        text.replace("../../examples", &project.join("examples").display().to_string())
            .replace("../shared", &project.join("../shared").display().to_string())
    };
    for step in steps {
        match step {
            Step::Run { arguments, code } => {
                let arguments: Vec<String> = arguments.iter().map(|a| at(a)).collect();
                let output = Command::new(env!("CARGO_BIN_EXE_youla"))
                    .current_dir(&folder)
                    .args(&arguments)
                    .output()
                    .expect("the program starts");
                let errors = String::from_utf8_lossy(&output.stderr);
                assert_eq!(output.status.code(), Some(*code), "{name}: youla {}: {errors}", arguments.join(" "));
            }
            Step::Edit { file, from, to } => {
                let path = folder.join(file);
                let text = fs::read_to_string(&path).expect("readable");
                assert_eq!(text.matches(from.as_str()).count(), 1, "{name}: {from:?} in {file}");
                fs::write(path, text.replace(from, to)).expect("written");
            }
            Step::Settings(text) => {
                let path = docs().join("../examples/flexible-drive/run.toml");
                let base = fs::read_to_string(path).expect("readable");
                let without = base.split("[reduction]").next().expect("a part").to_owned();
                let with = format!("{without}\n{text}");
                youla::run::RunSettings::parse(&with, Path::new("book")).unwrap_or_else(|e| panic!("{name}: {e}"));
            }
        }
    }
}

#[test]
fn links_lead_somewhere() {
    let mut files = chapters(&docs().join("book"));
    files.push(docs().join("SUMMARY.md"));
    for path in files {
        let text = fs::read_to_string(&path).expect("readable");
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = target.split('#').next().unwrap_or_default();
            if file.starts_with("http") || file.is_empty() {
                continue;
            }
            let found = path.parent().expect("a folder").join(file);
            assert!(found.is_file(), "{}: {target}", path.display());
        }
    }
    let summary = fs::read_to_string(docs().join("SUMMARY.md")).expect("readable");
    for path in chapters(&docs().join("book")) {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(summary.contains(&format!("(book/{name})")), "{name} is not in SUMMARY.md");
    }
}
