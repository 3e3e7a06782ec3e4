//! What must end, and must not reach the terminal: pipes and devices, short records, loops that nothing excites, names with commands.

use crate::common::{csv, log, loop_folder, refused, settings, settings_refused, youla};
#[cfg(unix)]
use std::process::Command;

/// A pipe without a writer would block for ever, a device has no end.
#[cfg(unix)]
#[test]
fn pipes_and_devices() {
    let what = "a pipe, a socket or a device cannot be read";
    let zero = settings("\"log.csv\", take", "\"/dev/zero\", take");
    settings_refused("device", &zero, &["/dev/zero", what]);
    let pipe = settings("\"log.csv\", take", "\"pipe\", take");
    let folder = loop_folder("pipe", &[("run.toml", pipe.as_bytes())]);
    let made = Command::new("mkfifo").arg(folder.join("pipe")).status().expect("mkfifo is there");
    assert!(made.success());
    refused(&folder, 2, &["pipe", what]);
    for arguments in
        [&["check", "/dev/zero"][..], &["init", "pipe"], &["report", "/dev"], &["export", "pipe", "--to", "npz"]]
    {
        let found = youla(&folder, arguments);
        assert_eq!(found.code, Some(2), "{arguments:?}: {}", found.stderr);
    }
    assert!(youla(&folder, &["check", "/dev/zero"]).stderr.contains(what));
}

/// Readers of settings beside run.toml: campaign, parameters, loops, Q.
#[cfg(unix)]
#[test]
fn pipes_and_devices_of_every_reader() {
    let what = "a pipe, a socket or a device cannot be read";
    let folder = loop_folder("pipe-readers", &[]);
    let machine = "udp://127.0.0.1:9";
    for verb in [
        &["commission", "/dev/zero", "--out", "o"][..],
        &["rig", "load", machine, "/dev/zero"],
        &["rig", "load", machine, "/dev/zero", "--speed", "100"],
        &["rig", "record", machine, "--out", "new/x.csv", "--duration", "1", "--settings", "/dev/zero"],
        &["rig", "twin", "/dev/zero", "--bearing", "linear", "--port", "0", "--duration", "0.5"],
        &["paper", "--settings", "/dev/zero", "--out", "o"],
        &["paper", "--rig", "/dev/zero", "--out", "o"],
    ] {
        let found = youla(&folder, verb);
        assert_eq!(found.code, Some(2), "{verb:?}: {}", found.stderr);
        assert!(found.stderr.contains(what), "{verb:?}: {}", found.stderr);
    }
}

/// Names are cut, lists end after ten of them, and no table ends in a panic.
#[test]
fn messages_stay_short() {
    let long = "x".repeat(70_000);
    let wide: Vec<String> = (0..3000).map(|k| format!("c{k}")).collect();
    let row = |count: usize| vec!["1.5"; count].join(",");
    let folder = loop_folder(
        "long-names",
        &[
            ("long.csv", format!("{long},u,y\n{}\n{}\n", row(3), row(3)).as_bytes()),
            ("wide.csv", format!("{}\n{}\n{}\n", wide.join(","), row(3000), row(3000)).as_bytes()),
            ("key.toml", format!("{long} = 1\n").as_bytes()),
        ],
    );
    for verb in [
        &["init", "long.csv", "--input", "q", "--output", "y", "--sample-time", "1", "--open-loop", "--out", "n.toml"]
            [..],
        &["init", "wide.csv", "--input", "q", "--output", "y", "--sample-time", "1", "--open-loop", "--out", "n.toml"],
        &["check", "long.csv", "--input", "q", "--output", "y", "--sample-time", "1"],
        &["identify", "key.toml", "--out", "o"],
    ] {
        let found = youla(&folder, verb);
        assert_eq!(found.code, Some(2), "{verb:?}: {:.2000}", found.stderr);
        assert!(found.stderr.len() < 2000, "{verb:?}: {} bytes: {:.2000}", found.stderr.len(), found.stderr);
    }
}

/// Numbers near the largest one are refused or of no consequence.
#[test]
fn horizons_and_rows_near_the_largest_number() {
    let largest = "18446744073709551615";
    let horizon = format!("[hansen]\nhorizon = {largest}\n[direct]\nhorizon = {largest}\n");
    for (place, text) in [("skip = 1200", format!("skip = {largest}")), ("[nominal", format!("{horizon}[nominal"))] {
        let folder = loop_folder("largest", &[("run.toml", settings(place, &text).as_bytes())]);
        for verb in [&["check", "run.toml"][..], &["identify", "run.toml", "--out", "run", "--force"]] {
            let found = youla(&folder, verb);
            assert!(matches!(found.code, Some(0..=3)), "{text}: {verb:?}: {:?} {}", found.code, found.stderr);
        }
    }
}

/// Values whose squares overflow are refused where they are read, in few digits.
#[test]
fn values_of_1e300() {
    let rows: Vec<[f64; 4]> = log().into_iter().map(|[t, u, d, y]| [t, u, d, 1e300 * y]).collect();
    let folder = loop_folder("overflow", &[("log.csv", csv(&rows).as_bytes())]);
    for verb in [&["check", "run.toml"][..], &["identify", "run.toml", "--out", "run"]] {
        let found = youla(&folder, verb);
        assert_eq!(found.code, Some(2), "{}", found.stderr);
        let few = found.stderr.len() < 400;
        assert!(few && found.stderr.contains("at most 1e100 in magnitude"), "{}", found.stderr);
    }
}

#[test]
fn verification_records_of_few_rows() {
    for rows in [1, 2, 10, 29, 30, 31, 41, 60] {
        let short = settings("skip = 1200", &format!("skip = {}", 2000 - rows));
        let folder = loop_folder(&format!("short-{rows}"), &[("run.toml", short.as_bytes())]);
        let found = youla(&folder, &["identify", "run.toml", "--out", "run"]);
        assert!(matches!(found.code, Some(0 | 2)), "{rows}: {}", found.stderr);
        assert!(!found.stderr.contains("panicked"), "{rows}: {}", found.stderr);
    }
}

/// An excitation of zero says nothing of the controller, and is a defect of the data.
#[test]
fn an_excitation_of_zero() {
    let rows: Vec<[f64; 4]> = log().into_iter().map(|[t, u, _, y]| [t, u, 0.0, y]).collect();
    let folder = loop_folder("zero", &[("log.csv", csv(&rows).as_bytes())]);
    let found = youla(&folder, &["identify", "run.toml", "--out", "run"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    assert!(!found.stdout.contains("inf"), "{}", found.stdout);
    let summary = std::fs::read_to_string(folder.join("run/summary.json")).expect("written");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    assert!(summary["controller_mismatch"].is_null() && summary["recommended"]["trusted"] == false, "{summary}");
    assert_eq!(youla(&folder, &["check", "run.toml"]).code, Some(1));
}

/// u = K y exactly: noise alone goes round the loop.
#[test]
fn a_loop_that_nothing_excites() {
    let mut state = [0.0; 2];
    let rows: Vec<[f64; 4]> = log()
        .into_iter()
        .map(|[t, _, d, _]| {
            let y = state[0] + 0.1 * d;
            let u = -2.0 * y;
            state = [1.5 * state[0] - 0.56 * state[1] + 0.06 * u, state[0]];
            [t, u, 0.0, y]
        })
        .collect();
    let unknown = settings("input_excitation = [{ name = \"d\", unit = \"V\" }]\n", "");
    let files = [("log.csv", csv(&rows).into_bytes()), ("run.toml", unknown.into_bytes())];
    let folder = loop_folder("quiet", &files.each_ref().map(|(name, bytes)| (*name, bytes.as_slice())));
    let found = youla(&folder, &["check", "run.toml"]);
    assert_eq!(found.code, Some(1), "{}", found.stdout);
    assert!(found.stdout.contains("nothing but the controller moves the loop"), "{}", found.stdout);
    let identified = youla(&folder, &["identify", "run.toml", "--out", "run", "--json"]);
    if identified.code == Some(0) {
        let summary: serde_json::Value = serde_json::from_str(&identified.stdout).expect("JSON");
        assert_ne!(summary["recommended"]["trusted"], true);
    }
}

/// Names come from a file: none of them commands the terminal.
#[test]
fn names_with_commands_for_the_terminal() {
    let named = settings("name = \"loop\"", "name = \"a\\u001b[2Jb\\u202ec\"");
    let folder = loop_folder("escape", &[("run.toml", named.as_bytes())]);
    let found = youla(&folder, &["identify", "run.toml", "--out", "run"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let bad = |c: char| c == '\u{202e}' || (c.is_control() && c != '\n');
    assert!(!found.stdout.contains(bad) && found.stdout.contains("a\\u001b[2Jb\\u202ec"), "{}", found.stdout);
    let json = youla(&folder, &["identify", "run.toml", "--out", "other", "--json"]).stdout;
    let summary: serde_json::Value = serde_json::from_str(&json).expect("still JSON");
    assert_eq!(summary["name"], "a\u{1b}[2Jb\u{202e}c");
}
