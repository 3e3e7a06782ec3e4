//! What the program does beside finding: text, files, exit codes, refusals.

use super::records::folder;
use crate::common::uniform;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_youla"))
        .current_dir(folder)
        .arg("check")
        .args(arguments)
        .output()
        .expect("it starts")
}

/// White input through a first-order lag, white noise; rows `t, u, y`.
fn log(rows: usize) -> Vec<[f64; 3]> {
    let mut uniform = uniform(1);
    let mut random = || uniform() - 0.5;
    let mut x = 0.0;
    (0..rows)
        .map(|k| {
            let u = random();
            let row = [k as f64 * 0.01, u, x + 0.05 * random()];
            x = 0.8 * x + u;
            row
        })
        .collect()
}

fn csv(rows: &[[f64; 3]]) -> String {
    let lines = rows.iter().map(|[t, u, y]| format!("{t:.2},{u:?},{y:?}\n"));
    std::iter::once("t,u,y\n".to_owned()).chain(lines).collect()
}

const CHANNELS: [&str; 6] = ["--input", "u", "--output", "y", "--time", "t"];

#[test]
fn a_clean_log_is_clean_and_nothing_is_written() {
    let folder = folder("program-clean");
    fs::write(folder.join("log.csv"), csv(&log(3000))).expect("written");
    let found = run(&folder, &[&["log.csv"], &CHANNELS[..]].concat());
    let text = String::from_utf8(found.stdout).expect("UTF-8");
    assert_eq!(found.status.code(), Some(0), "{text}");
    assert!(text.contains("1 record: 0 defects, 0 cautions,") && text.contains("note (noise) log, y: "), "{text}");
    assert_eq!(fs::read_dir(&folder).expect("readable").count(), 1);
}

#[test]
fn a_defect_has_a_code_and_a_file() {
    let folder = folder("program-defect");
    let mut rows = log(3000);
    rows.drain(1000..1010);
    fs::write(folder.join("log.csv"), csv(&rows)).expect("written");
    let arguments = [&["log.csv", "--out", "found"], &CHANNELS[..]].concat();
    let found = run(&folder, &arguments);
    let text = String::from_utf8(found.stdout).expect("UTF-8");
    assert_eq!(found.status.code(), Some(1));
    let head = "log, rows 1001 to 2990: 1990 samples, sample time 0.01 s (100 Hz), length 19.9 s\n\ndefect (timing) log, row 1001: 10 samples are missing in 1 gaps.";
    assert!(text.starts_with(head), "{text}");
    let written = fs::read_to_string(folder.join("found/check.json")).expect("written");
    let written: serde_json::Value = serde_json::from_str(&written).expect("JSON");
    assert_eq!((&written["defects"], &written["findings"][0]["numbers"]["missing"]), (&1.into(), &10.0.into()));
    assert_eq!(written["records"][0]["rows"], serde_json::json!([1001, 2990]));
    let again = run(&folder, &arguments);
    assert_eq!(again.status.code(), Some(2), "an existing folder is not touched");
    let quiet = run(&folder, &[&["log.csv", "--quiet"], &CHANNELS[..]].concat());
    assert!(quiet.stdout.is_empty() && quiet.status.code() == Some(1));
}

#[test]
fn what_cannot_be_read_is_refused_in_a_sentence() {
    let folder = folder("program-refused");
    fs::write(folder.join("log.csv"), csv(&log(100))).expect("written");
    fs::write(folder.join("options.toml"), "lags = 10\nsignificanse = 5.0\n").expect("written");
    let cases: [(&[&str], &str); 5] = [
        (&["none.csv"], "none.csv"),
        (&["other.toml", "another.toml"], "must be 1"),
        (&["log.csv", "--input", "v", "--output", "y", "--time", "t"], "\"v\""),
        (&["log.csv", "--input", "u", "--output", "y"], "sample time"),
        (&["log.csv", "--input", "u", "--output", "y", "--time", "t", "--options", "options.toml"], "significan"),
    ];
    for (arguments, evidence) in cases {
        let found = run(&folder, arguments);
        let text = String::from_utf8(found.stderr).expect("UTF-8");
        assert_eq!((found.status.code(), text.lines().count()), (Some(2), 1), "{text}");
        assert!(text.starts_with("error: ") && text.contains(evidence), "{text}");
    }
}
