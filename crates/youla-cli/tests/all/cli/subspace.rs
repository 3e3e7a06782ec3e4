//! `youla subspace`: a model straight from files.

use crate::common::{empty_folder, log, loop_folder, refused_by, youla};
use std::fs;
use std::path::Path;
use std::process::Command;

const OPTIONS: &str = "horizon = 10\norder = 2\n";

/// The small loop as `numpy.save` writes it, with one number replaced.
fn npy(place: usize, number: f64) -> Vec<u8> {
    let mut values: Vec<f64> = log().concat();
    values[place] = number;
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 4), }}\n", log().len());
    let data = values.into_iter().flat_map(f64::to_le_bytes);
    let start = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()].concat();
    start.into_iter().chain(data).collect()
}

fn folder(name: &str) -> std::path::PathBuf {
    let bytes = npy(0, 0.0);
    loop_folder(name, &[("log.npy", &bytes), ("options.toml", OPTIONS.as_bytes())])
}

fn number(json: &serde_json::Value, key: &str) -> f64 {
    json[key][0][0].as_f64().expect("a number")
}

#[test]
fn text_and_numpy_give_the_same_model() {
    let folder = folder("subspace");
    let text = ["subspace", "log.csv", "--input", "d", "--output", "y", "--time", "t", "--options", "options.toml"];
    let found = youla(&folder, &[&text[..], &["--out", "model.json"]].concat());
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    for line in ["2000 samples, 2 passes", "order 2, data factored by Gram matrix", "fit, simulated", "y  ", "peak"] {
        assert!(found.stdout.contains(line), "{line} is not in: {}", found.stdout);
    }
    let written: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.join("model.json")).expect("written")).expect("JSON");
    assert_eq!(written["ts"], 0.01);
    assert_eq!(written["provenance"]["options"]["horizon"], 10);
    assert_eq!(written["details"]["samples"], 2000);
    let by_number = [
        "subspace",
        "log.npy",
        "--input",
        "#3",
        "--output",
        "#4",
        "--sample-time",
        "0.01",
        "--options",
        "options.toml",
    ];
    let found = youla(&folder, &[&by_number[..], &["--json"]].concat());
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    let printed: serde_json::Value = serde_json::from_str(&found.stdout).expect("JSON");
    for key in ["a", "b", "c"] {
        assert_eq!(number(&written, key), number(&printed, key), "{key}");
    }
    assert_eq!(printed["inputs"][0]["name"], "#3");
    // The same record twice is two experiments.
    let twice = [&by_number[..1], &["log.npy"], &by_number[1..], &["--quiet"]].concat();
    assert_eq!(youla(&folder, &twice).stdout, "");
}

#[test]
fn bad_input_is_refused() {
    let folder = folder("subspace-bad");
    fs::write(folder.join("nan.npy"), npy(4 * 617 + 3, f64::NAN)).expect("written");
    fs::write(folder.join("cut.npy"), &npy(0, 0.0)[..5000]).expect("written");
    fs::write(folder.join("taken.json"), "{}").expect("written");
    fs::write(folder.join("misspelt.toml"), "horizont = 10\n").expect("written");
    let text = fs::read_to_string(folder.join("log.csv")).expect("written");
    fs::write(folder.join("cell.csv"), text.replacen("\n0.50,", "\n0.50,x", 1)).expect("written");
    fs::write(folder.join("gap.csv"), text.replacen("\n0.50,", "\n0.55,", 1)).expect("written");
    let csv = ["--input", "u", "--output", "y", "--time", "t"];
    let array = ["--input", "#2", "--output", "#4", "--sample-time", "0.01"];
    let plus = |more: &[&'static str], all: &[&'static str]| [all, more].concat();
    let cases: [(&str, Vec<&str>, &[&str]); 11] = [
        ("missing.npy", array.to_vec(), &["missing.npy", "no such file"]),
        ("cell.csv", csv.to_vec(), &["cell.csv, line 52", "column u"]),
        ("gap.csv", csv.to_vec(), &["time is not uniform", "row 51"]),
        ("log.csv", plus(&["--options", "misspelt.toml"], &csv), &["misspelt.toml:1", "horizon"]),
        ("log.csv", plus(&["--out", "taken.json"], &csv), &["taken.json", "exists"]),
        ("log.csv", vec!["--input", "uu", "--output", "y", "--time", "t"], &["uu", "known: t, u, d, y"]),
        ("nan.npy", array.to_vec(), &["nan.npy", "#4", "row 618"]),
        ("cut.npy", array.to_vec(), &["cut.npy, byte 5000"]),
        ("log.npy", vec!["--input", "#9", "--output", "#4", "--sample-time", "1"], &["#9", "known: #1, #2, #3, #4"]),
        ("log.npy", vec!["--input", "#2", "--output", "#4", "--sample-time", "-1"], &["sample time", "-1"]),
        ("log.npy", vec!["--input", "#2", "--output", "#4", "--time", "t"], &["log.npy", "sample time is not known"]),
    ];
    for (file, arguments, evidence) in cases {
        let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
        refused_by(command.args(["subspace", file]).args(arguments).args(["--quiet"]), &folder, 2, evidence);
    }
}

#[test]
fn impossible_computations_end_with_code_three() {
    let folder = folder("subspace-numerical");
    // y+ = 1.01 y + u, which an open record does not hold back.
    let mut y = 0.0;
    let log = log();
    let rows = log.iter().take(600).map(|[_, _, d, _]| {
        y = 1.01 * y + d;
        format!("{d:?},{y:?}\n")
    });
    fs::write(folder.join("unstable.csv"), std::iter::once("u,y\n".to_owned()).chain(rows).collect::<String>())
        .unwrap();
    fs::write(folder.join("first.toml"), "horizon = 5\norder = 1\n").expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    command.args(["subspace", "unstable.csv", "--input", "u", "--output", "y", "--sample-time", "1"]);
    command.args(["--options", "first.toml", "--out", "model.json"]);
    refused_by(&mut command, Path::new(&folder), 3, &["must be stable"]);
}

#[test]
fn the_clock_is_asked_for() {
    let found = youla(&empty_folder("subspace-clock"), &["subspace", "x.npy", "--input", "#1", "--output", "#2"]);
    assert_eq!(found.code, Some(2));
    assert!(found.stderr.contains("--sample-time"), "{}", found.stderr);
}
