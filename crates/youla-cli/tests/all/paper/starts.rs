//! `youla study starts` on few items: its files, stopped and gone on with, and what it refuses.

use crate::common::{empty_folder, outcome};
use std::fs;
use std::path::Path;
use std::process::Command;

fn study(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    command.current_dir(folder).args(["study", "starts"]).args(arguments);
    command
}

const SMALL: [&str; 6] = ["--cases", "periodic,slow-squares", "--items", "2", "--out", "small"];

#[test]
fn a_small_study_is_written_continued_and_kept_apart() {
    let folder = empty_folder("starts-small");
    let done = outcome(study(&folder, &SMALL).env("RAYON_NUM_THREADS", "1"));
    assert_eq!((done.code, done.stderr.as_str()), (Some(0), ""), "{}", done.stdout);
    assert!(done.stdout.contains("periodic      PEM from subspace       2 of    2 converged"), "{}", done.stdout);
    let results = ["periodic.csv", "slow-squares.csv", "summary.json", "figures/starts.svg", "tables/counts.csv"];
    let read = |name: &str| fs::read(folder.join("small").join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let before: Vec<Vec<u8>> = results.iter().map(|name| read(name)).collect();
    let rows = String::from_utf8(before[0].clone()).expect("text");
    assert_eq!(rows.lines().count(), 1 + 2 * 4, "{rows}");
    assert!(rows.starts_with("item,setting,search,status,fit_horizontal"), "{rows}");
    assert!(String::from_utf8(read("report.html")).expect("text").contains("Convergence from different starts"));
    let summary: serde_json::Value = serde_json::from_slice(&before[2]).expect("JSON");
    let counts = summary["counts"].as_array().expect("counts");
    assert_eq!(counts.len(), 8);
    assert!(counts.iter().filter(|c| c["search"] == "truth").all(|c| c["converged"] == 2), "{summary}");

    // Cut off within the second item, and gone on with on another number of threads.
    fs::write(folder.join("small/periodic.csv"), &before[0][..before[0].len() * 7 / 10]).expect("written");
    fs::remove_file(folder.join("small/report.html")).expect("removed");
    let again = outcome(study(&folder, &SMALL).env("RAYON_NUM_THREADS", "2"));
    assert_eq!(again.code, Some(0), "{}", again.stderr);
    let told = ["periodic.csv: 1 items are there already", "slow-squares.csv: 2 items are there already"];
    assert!(told.iter().all(|text| again.stderr.contains(text)), "{}", again.stderr);
    for (name, before) in results.iter().zip(&before) {
        assert!(read(name) == *before, "{name} differs");
    }
    assert!(folder.join("small/report.html").exists());

    let other = outcome(study(&folder, &SMALL).args(["--seed", "2"]));
    assert_eq!(other.code, Some(2), "{}", other.stderr);
    assert!(other.stderr.contains("paper.seed is 1 there and 2 here"), "{}", other.stderr);
}

#[test]
fn values_without_meaning_are_refused() {
    let folder = empty_folder("starts-bad");
    for (arguments, words) in [
        (["--cases", "periodik", "--out", "x"], "known are loop-0.2, loop-1.0, light-damping"),
        (["--items", "0", "--out", "x"], "the number of items of a case is 0"),
        (["--cases", "periodic,periodic", "--out", "x"], "the number of times that the case periodic is named is 2"),
    ] {
        let refused = outcome(&mut study(&folder, &arguments));
        assert_eq!(refused.code, Some(2), "{}", refused.stderr);
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
    assert!(!folder.join("x").exists());
}
