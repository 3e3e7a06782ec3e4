//! The book, `docs/book`: every command runs in the order of its chapter and ends as the chapter says, every edit finds its text,
//! every table of settings is one that run.toml takes, every program is that of the examples, every link leads to a page of the book.
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
            Step::Example { file, text } => {
                let path = docs().join("../crates/youla/examples").join(file);
                assert_eq!(*text, fs::read_to_string(path).expect("readable"), "{name}: {file} has changed");
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

/// mdBook makes pages of what SUMMARY.md lists and copies the rest of `docs`; a link out of it would lead nowhere.
#[test]
fn links_lead_to_pages_of_the_book() {
    let docs = docs().canonicalize().expect("the book");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).expect("readable");
    let linked = |text: &str| -> Vec<String> {
        let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let files = targets.map(|target| target.split('#').next().unwrap_or_default().to_owned());
        files.filter(|file| !file.starts_with("http") && !file.is_empty()).collect()
    };
    let pages: Vec<PathBuf> = linked(&summary).into_iter().map(|page| docs.join(page)).collect();
    for page in &pages {
        let text = fs::read_to_string(page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        for target in linked(&text) {
            let found = page.parent().expect("a folder").join(&target).canonicalize();
            let found = found.unwrap_or_else(|e| panic!("{}: {target}: {e}", page.display()));
            let page_of_book = found.extension().is_none_or(|e| e != "md") || pages.contains(&found);
            assert!(found.is_file() && found.starts_with(&docs) && page_of_book, "{}: {target}", page.display());
        }
    }
    for path in chapters(&docs.join("book")) {
        assert!(pages.contains(&path), "{} is not in SUMMARY.md", path.display());
    }
}
