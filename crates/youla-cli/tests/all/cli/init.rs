//! `youla init`: from a log to a run.toml.

use crate::common::{listing, loop_folder, outcome, refused_by, youla};
use std::fs;
use std::process::Command;

const KNOWN: [&str; 8] = ["init", "log.csv", "--input", "u", "--output", "y", "--time", "t"];

fn init(more: &[&'static str]) -> Vec<&'static str> {
    [&KNOWN[..], &["--out", "new.toml"], more].concat()
}

#[test]
fn what_is_not_said_is_not_guessed() {
    let folder = loop_folder("init-silent", &[]);
    let before = listing(&folder);
    let found = youla(&folder, &["init", "log.csv", "--input", "u", "--out", "new.toml"]);
    assert_eq!(found.code, Some(2));
    assert!(found.stderr.contains("--output, --time or --sample-time, --feedback or --open-loop"), "{}", found.stderr);
    for part in ["column", "t ", "even steps of 1.000000e-2", "2000"] {
        assert!(found.stdout.contains(part), "{part:?} is not in: {}", found.stdout);
    }
    assert_eq!(listing(&folder), before);
}

#[test]
fn a_log_without_a_controller_runs_at_once() {
    let folder = loop_folder("init-open", &[]);
    // From d to y the log is that of a stable system without feedback.
    let arguments =
        ["init", "log.csv", "--input", "d", "--output", "y", "--time", "t", "--open-loop", "--estimate", "1500"];
    let found = youla(&folder, &[&arguments[..], &["--out", "new.toml"]].concat());
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    let found = youla(&folder, &["identify", "new.toml", "--out", "run", "--json"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let summary: serde_json::Value = serde_json::from_str(&found.stdout).expect("JSON");
    let fit = summary["methods"]["likelihood"]["fit"]["log-rest"][0].as_f64().expect("a fit");
    assert!(fit > 80.0, "{fit}");
    let report = fs::read_to_string(folder.join("run/report.json")).expect("written");
    for (words, said) in [
        ("No controller ran.", true),
        ("in open loop", true),
        ("the recommended model is stable", true),
        ("The controller that ran", false),
        ("No excitation from outside", false),
        ("peak sensitivity of the loop", false),
        ("the declared controller", false),
    ] {
        assert_eq!(report.contains(words), said, "{words}");
    }
}

#[test]
fn what_is_to_be_filled_in_is_named_with_its_line() {
    let folder = loop_folder("init-closed", &[]);
    let found = youla(&folder, &init(&["--excitation", "d", "--feedback", "negative"]));
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    let text = fs::read_to_string(folder.join("new.toml")).expect("written");
    let unfilled = youla(&folder, &["identify", "new.toml"]);
    assert_eq!(unfilled.code, Some(2));
    assert!(unfilled.stderr.contains("new.toml") && unfilled.stderr.contains("numerator"), "{}", unfilled.stderr);
    let filled = text
        .replace("# numerator = [5.5, 0.3, -5.2]", "numerator = [2.0]")
        .replace("# denominator = [1.0, -1.1, 0.4]", "denominator = [1.0]");
    fs::write(folder.join("new.toml"), filled).expect("written");
    let found = youla(&folder, &["identify", "new.toml", "--out", "run", "--quiet"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
}

#[test]
fn what_does_not_fit_the_log_is_refused() {
    let folder = loop_folder("init-refused", &[]);
    let refuse = |arguments: &[&str], evidence: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
        refused_by(command.args(arguments).arg("--quiet"), &folder, 2, evidence);
    };
    refuse(&init(&["--reference", "v", "--open-loop"]), &["no column \"v\"", "t, u, d, y"]);
    refuse(&init(&["--reference", "u", "--open-loop"]), &["named twice"]);
    refuse(&init(&["--open-loop", "--estimate", "2000"]), &["the log has 2000"]);
    refuse(&["init", "log.csv", "--out", "run.toml"], &["run.toml", "--force"]);
    let found = outcome(Command::new(env!("CARGO_BIN_EXE_youla")).current_dir(&folder).args(["init", "none.csv"]));
    assert_eq!(found.code, Some(2));
}

/// A line of units and decimal commas, with the flags that the message names; the run.toml that is written reads the log.
#[test]
fn a_log_with_units_and_decimal_commas_is_read() {
    let rows: String = (0..600).map(|k| format!("0,{k:03};{};{}\n", k % 7, (k * k) % 11)).collect();
    let text = format!("t;u;y\ns;V;mm\n{rows}");
    let folder = loop_folder("init-units", &[("units.csv", text.as_bytes())]);
    let log = ["init", "units.csv", "--input", "u", "--output", "y", "--time", "t", "--open-loop", "--out", "new.toml"];
    let refused = youla(&folder, &log);
    assert_eq!(refused.code, Some(2), "{}", refused.stdout);
    for flag in ["--decimal comma", "--skip-lines"] {
        assert!(refused.stderr.contains(flag), "{}", refused.stderr);
    }
    let read = youla(&folder, &[&log[..], &["--decimal", "comma", "--skip-lines", "2"]].concat());
    assert_eq!(read.code, Some(0), "{}", read.stderr);
    let checked = youla(&folder, &["check", "new.toml"]);
    assert!(
        checked.stdout.contains("sample time 0.001 s (1000 Hz), length 0.4 s"),
        "{}{}",
        checked.stdout,
        checked.stderr
    );
}

/// 240 kB of names: as many lines as a person reads, and a column in milliseconds is refused.
#[test]
fn hostile_names_are_cut() {
    let names: Vec<String> =
        (0..48_000).map(|k| format!("x{k:04}")).chain(["t_ms".into(), "y".repeat(60_000)]).collect();
    let row = |value: &str| vec![value; names.len()].join(",");
    let text = format!("{}\n{}\n{}\n{}\n", names.join(","), row("1"), row("2"), row("4"));
    let folder = loop_folder("init-names", &[("wide.csv", text.as_bytes())]);
    let found =
        youla(&folder, &["init", "wide.csv", "--input", "x0001", "--output", "x0002", "--time", "none", "--open-loop"]);
    assert_eq!(found.code, Some(2));
    assert!(found.stdout.len() + found.stderr.len() < 20_000, "{} bytes", found.stdout.len() + found.stderr.len());
    let folder = loop_folder("init-ms", &[("ms.csv", b"t_ms,u,y\n0,1,2\n1,2,3\n2,1,4\n")]);
    let found = youla(
        &folder,
        &["init", "ms.csv", "--input", "u", "--output", "y", "--time", "t_ms", "--open-loop", "--out", "new.toml"],
    );
    assert!(
        found.code == Some(2) && found.stderr.contains("in milliseconds") && found.stderr.contains("ms.csv"),
        "{}",
        found.stderr
    );
}

/// A Parquet file is recognised, and the message names the two ways around it.
#[test]
fn a_parquet_log_is_refused() {
    let folder = loop_folder("init-parquet", &[]);
    fs::write(folder.join("log.parquet"), b"PAR1\0\0PAR1").expect("written");
    let found =
        youla(&folder, &["init", "log.parquet", "--input", "u", "--output", "y", "--open-loop", "--out", "new.toml"]);
    assert_eq!(found.code, Some(2));
    for part in ["a Parquet file cannot be read", "CSV or NPZ", "Python"] {
        assert!(found.stderr.contains(part), "{part:?} is not in: {}", found.stderr);
    }
}
