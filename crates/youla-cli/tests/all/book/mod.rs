//! The book, all pages of `docs`: every command runs in the order of its page and ends as the page says, every edit finds its text,
//! every table of settings is one that run.toml takes, every program is that of the examples or compiles, every link leads to a page.

mod blocks;
mod chapter;
mod readme;

use self::blocks::Language;
use self::chapter::{Step, steps};
use crate::common::data;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
}

#[test]
fn commands_and_edits_do_what_the_chapters_say() {
    run_chapters("plain", |text| !needs_data(text), None);
}

#[test]
#[ignore = "needs the measured data: YOULA_DATA or ../shared/data"]
fn chapters_on_measured_data_do_what_they_say() {
    run_chapters("measured", needs_data, None);
}

#[test]
#[ignore = "needs python3 with scipy"]
fn python_blocks_run() {
    run_chapters("python", |text| text.contains("```python\n") && !needs_data(text), Some(Language::Python));
}

#[test]
#[ignore = "needs octave-cli with the package control"]
fn matlab_blocks_run() {
    run_chapters("matlab", |text| text.contains("```matlab") && !needs_data(text), Some(Language::Matlab));
}

#[test]
#[ignore = "needs gcc"]
fn c_blocks_compile() {
    run_chapters("c", |text| text.contains("```c\n") && !needs_data(text), Some(Language::C));
}

/// The pages that are wanted, README.md included; blocks in other languages than `language` are not run.
fn run_chapters(set: &str, wanted: impl Fn(&str) -> bool, language: Option<Language>) {
    let docs = docs();
    for page in pages(&docs).into_iter().chain(["../README.md".to_owned()]) {
        let text = fs::read_to_string(docs.join(&page)).expect("readable");
        let steps = steps(&text);
        if steps.is_empty() || !wanted(&text) {
            continue;
        }
        let name = page.trim_start_matches("../").trim_end_matches(".md");
        let folder = folder_of(&format!("{set}/{name}"));
        if name == "README" || name == "book/signals" {
            readme::write_scene(&folder);
        }
        if name == "book/signals" {
            fs::write(folder.join("run.toml"), run_of_readme()).expect("written");
        }
        run_chapter(&folder, name, &steps, language);
    }
}

/// The run.toml that README.md shows.
fn run_of_readme() -> String {
    let text = fs::read_to_string(docs().join("../README.md")).expect("readable");
    let shown = steps(&text).into_iter().find_map(|step| match step {
        Step::Write { file, text } => (file == "run.toml").then_some(text),
        _ => None,
    });
    shown.expect("a run.toml")
}

/// README.md runs on a log of its own.
fn needs_data(text: &str) -> bool {
    !text.starts_with("# youla\n") && (text.contains("../shared/data") || text.contains("examples/qube"))
}

/// The examples with the place of the measured data in them.
fn examples(project: &Path) -> PathBuf {
    let copies = folder_of("examples");
    for name in ["flexible-drive/run.toml", "flexible-drive/two-inertia.toml", "qube/run.toml"] {
        let text = fs::read_to_string(project.join("examples").join(name)).expect("readable");
        let text = text.replace("../../../shared/data", &data().display().to_string());
        fs::create_dir_all(copies.join(name).parent().expect("a folder")).expect("a temporary folder");
        fs::write(copies.join(name), text).expect("written");
    }
    copies
}

/// A folder of its own, empty.
fn folder_of(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a temporary folder");
    folder
}

/// From the folder of a chapter `../shared/data` and `../../examples` lead to where they lead from the project.
fn run_chapter(folder: &Path, name: &str, steps: &[Step], wanted: Option<Language>) {
    let project = docs().join("..").canonicalize().expect("the project");
    let at = |text: &str| match (text.contains("../../examples"), text.contains("../shared/data")) {
        (true, _) => text.replace("../../examples", &examples(&project).display().to_string()),
        (_, true) => text.replace("../shared/data", &data().display().to_string()),
        _ => text.to_owned(),
    };
    for step in steps {
        match step {
            Step::Run { arguments, code, to } => {
                let arguments: Vec<String> = arguments.iter().map(|a| at(a)).collect();
                let output = Command::new(env!("CARGO_BIN_EXE_youla"))
                    .current_dir(folder)
                    .args(&arguments)
                    .output()
                    .expect("the program starts");
                let errors = String::from_utf8_lossy(&output.stderr);
                assert_eq!(output.status.code(), Some(*code), "{name}: youla {}: {errors}", arguments.join(" "));
                to.iter().for_each(|file| fs::write(folder.join(file), &output.stdout).expect("written"));
            }
            Step::Edit { file, from, to } => {
                let path = folder.join(file);
                let text = fs::read_to_string(&path).expect("readable");
                assert_eq!(text.matches(from.as_str()).count(), 1, "{name}: {from:?} in {file}");
                fs::write(path, text.replace(from, to)).expect("written");
            }
            Step::Example { file, text } => {
                let path = docs().join("../crates/youla-cli/examples").join(file);
                // The line for the linter is of no use to a reader.
                let shown = |line: &&str| !line.starts_with("#![allow(clippy::");
                let example = fs::read_to_string(path).expect("readable");
                let example: Vec<&str> = example.lines().filter(shown).collect();
                let example = example.join("\n").replace("\n\n\n", "\n\n") + "\n";
                assert_eq!(*text, example, "{name}: {file} has changed");
            }
            Step::Excerpt { file, text } => {
                let path = docs().join("../crates/youla-cli/examples").join(file);
                let example = fs::read_to_string(path).expect("readable");
                let flat = |text: &str| text.lines().map(str::trim).collect::<Vec<_>>().join("\n");
                assert!(flat(&example).contains(flat(text).trim()), "{name}: not lines of {file}");
            }
            Step::Other { language, text } if wanted == Some(*language) => blocks::run(name, *language, text, folder),
            Step::Other { .. } => {}
            Step::Keys { file, text } => {
                let read = |text: &str| serde_json::from_str(text).unwrap_or_else(|e| panic!("{name}: {e}"));
                let found = fs::read_to_string(folder.join(file)).expect("readable");
                blocks::keys_are_of(name, &read(text), &read(&found));
            }
            Step::Project { command } => blocks::targets_are_there(name, command, &project),
            Step::Write { file, text } => fs::write(folder.join(file), text).expect("written"),
            Step::Settings(text) => {
                let settings = blocks::run_settings(name, text, &project);
                youla_run::RunSettings::parse(&settings, Path::new(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
            }
        }
    }
}

/// Pages of the book, relative to `docs`, in the order of SUMMARY.md.
fn pages(docs: &Path) -> Vec<String> {
    linked(&fs::read_to_string(docs.join("SUMMARY.md")).expect("readable"))
}

/// Files that a page links.
fn linked(text: &str) -> Vec<String> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let files = targets.map(|target| target.split('#').next().unwrap_or_default().to_owned());
    files.filter(|file| !file.starts_with("http") && !file.is_empty()).collect()
}

/// mdBook makes pages of what SUMMARY.md lists and copies the rest of `docs`; a link out of it would lead nowhere.
#[test]
fn links_lead_to_pages_of_the_book() {
    let docs = docs().canonicalize().expect("the book");
    let pages: Vec<PathBuf> = pages(&docs).into_iter().map(|page| docs.join(page)).collect();
    for page in &pages {
        let text = fs::read_to_string(page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        for target in linked(&text) {
            let found = page.parent().expect("a folder").join(&target).canonicalize();
            let found = found.unwrap_or_else(|e| panic!("{}: {target}: {e}", page.display()));
            let page_of_book = found.extension().is_none_or(|e| e != "md") || pages.contains(&found);
            assert!(found.is_file() && found.starts_with(&docs) && page_of_book, "{}: {target}", page.display());
        }
    }
}

#[test]
fn every_page_is_in_the_book() {
    let docs = docs();
    let pages = pages(&docs);
    for folder in ["", "book/", "decisions/"] {
        for entry in fs::read_dir(docs.join(folder)).expect("the book") {
            let name = entry.expect("readable").file_name().to_string_lossy().into_owned();
            let page = format!("{folder}{name}");
            let listed = !name.ends_with(".md") || name == "SUMMARY.md" || pages.contains(&page);
            assert!(listed, "{page} is not in SUMMARY.md");
        }
    }
}
