//! A paper of few models and short records, computed once.

use crate::common::{Outcome, empty_folder, outcome};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use youla_paper::study::PaperSettings;

/// The files that hold results, and thus depend on nothing but the configuration.
pub(crate) const LOOPS: [&str; 2] = ["study.csv", "crossover.csv"];

/// The shipped settings with short records, few models and a map of four cells.
pub(crate) fn settings() -> String {
    let replaced = [
        ("models = 500", "models = 5"),
        ("samples = 5000 #", "samples = 900 #"),
        ("verification_samples = 5000 #", "verification_samples = 600 #"),
        ("noise = [0.05, 0.2, 0.5, 1.0, 3.0]", "noise = [0.1, 1.0]"),
        ("theta = [0.1, 0.3, 0.5, 0.7, 0.9]", "theta = [0.3, 0.7]"),
        ("command_weights = [1.0, 100.0, 3e3]", "command_weights = [100.0]"),
        ("repetitions = 3", "repetitions = 1"),
        ("samples = 20000 #", "samples = 3000 #"),
        ("verification_samples = 10000", "verification_samples = 2000"),
        ("settle = 1000", "settle = 500"),
        ("start_factors = [0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0]", "start_factors = [0.7, 1.0, 1.4]"),
        ("order = 12", "order = 8"),
        ("horizon = 30\norder = 8", "horizon = 20\norder = 8"),
        ("horizon = 30\norder = 6", "horizon = 20\norder = 6"),
    ];
    replaced.into_iter().fold(PaperSettings::TOML.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    })
}

/// The program, asked for the small paper in `folder`, with further arguments.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    fs::write(folder.join("small.toml"), settings()).expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    command.current_dir(folder).args(["paper", "--settings", "small.toml"]).args(arguments);
    command
}

pub(crate) fn paper(folder: &Path, arguments: &[&str]) -> Outcome {
    outcome(&mut command(folder, arguments))
}

/// The results folder of the small paper.
pub(crate) fn whole() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = empty_folder("paper-whole");
        let done = paper(&folder, &["--out", "whole", "--quiet"]);
        assert_eq!((done.code, done.stdout.as_str(), done.stderr.as_str()), (Some(0), "", ""));
        folder.join("whole")
    })
}

/// Copies the named files of the whole paper and its configuration to a new folder.
pub(crate) fn copy_of_whole(name: &str, files: &[&str]) -> PathBuf {
    let folder = empty_folder(name);
    let copy = folder.join("copy");
    fs::create_dir_all(&copy).expect("made");
    for file in ["configuration.toml"].iter().chain(files) {
        fs::copy(whole().join(file), copy.join(file)).expect("copied");
    }
    folder
}

pub(crate) fn assert_same(file: &str, folder: &Path) {
    let read = |folder: &Path| fs::read(folder.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
    assert!(read(folder) == read(whole()), "{file} differs in {}", folder.display());
}
