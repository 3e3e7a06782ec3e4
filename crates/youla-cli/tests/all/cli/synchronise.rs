//! Channels with their own time stamps, brought to one clock.

use crate::common::{empty_folder, youla};
use std::fmt::Write;
use std::fs;

/// Two files with stamps in microseconds, one row in fifty missing, and one file with a row for each sample of any channel.
fn logs(name: &str) -> std::path::PathBuf {
    let folder = empty_folder(name);
    let (mut u, mut y, mut wide) =
        (String::from("timestamp,u\n"), String::from("timestamp,y,state\n"), String::from("t,u,y\n"));
    let (mut x, mut noise) = (0.0, 1u32);
    for k in 0..3000_u32 {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let d = if (noise >> 31) == 0 { 1.0 } else { -1.0 };
        let scatter = f64::from(noise >> 20) / 4096.0 * 500.0;
        let at = 5e6 + 2500.0 * f64::from(k) + scatter;
        let v = d - 0.8 * x;
        if k < 5 || k % 50 != 7 {
            writeln!(y, "{},{x},armed", at.round()).unwrap();
            writeln!(wide, "{},,{x}", at.round() / 1e6).unwrap();
        }
        writeln!(u, "{},{v}", (at + 600.0).round()).unwrap();
        writeln!(wide, "{},{v},", (at + 600.0).round() / 1e6).unwrap();
        x = 0.9 * x + 0.1 * v;
    }
    for (file, text) in [("u.csv", u), ("y.csv", y), ("wide.csv", wide)] {
        fs::write(folder.join(file), text).unwrap();
    }
    folder
}

const CHOSEN: [&str; 6] = ["--input", "u", "--output", "y", "--sample-time", "0.0025"];

#[test]
fn files_and_rows_with_empty_cells_give_the_same_log() {
    let folder = logs("synchronise");
    let files = ["synchronise", "u.csv", "y.csv", "--time", "timestamp", "--time-unit", "us", "--out", "a.csv"];
    let found = youla(&folder, &[&files[..], &CHOSEN].concat());
    assert_eq!((found.code, found.stderr.as_str()), (Some(0), ""));
    let table: Vec<&str> = found.stdout.lines().collect();
    assert!(table[0].starts_with("channel") && table[2].starts_with("y ") && table[2].contains("sampled"), "{table:?}");
    assert!(found.stdout.contains("3000 rows of 0.0025 s, 0 left out"), "{}", found.stdout);
    let wide = ["synchronise", "wide.csv", "--time", "t", "--out", "b.csv", "--json"];
    let found = youla(&folder, &[&wide[..], &CHOSEN].concat());
    let summary: serde_json::Value = serde_json::from_str(&found.stdout).unwrap();
    assert_eq!((&summary["channels"][1]["filled"], &summary["rows"][0]), (&60.into(), &3000.into()));
    let values = |file: &str| -> Vec<String> {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        text.lines().map(|line| line.split_once(',').unwrap().1.to_owned()).collect()
    };
    // Times may differ by a microsecond's rounding; the samples may not.
    let (a, b) = (values("a.csv"), values("b.csv"));
    assert_eq!((a.len(), &a), (3001, &b));
    // The record is one that `check` takes.
    let found = youla(&folder, &["check", "a.csv", "--input", "u", "--output", "y", "--time", "t"]);
    assert_eq!(found.code, Some(0), "{}", found.stdout);
}

#[test]
fn what_cannot_be_one_log_is_refused() {
    let folder = logs("synchronise-refused");
    let refused = |arguments: &[&str], says: &[&str]| {
        let found = youla(&folder, &[&["synchronise"], arguments].concat());
        assert_eq!((found.code, found.stdout.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(says.iter().all(|word| found.stderr.contains(word)), "{}", found.stderr);
    };
    let files = ["u.csv", "y.csv", "--time", "timestamp"];
    let with = |more: &[&'static str]| [&files[..], &CHOSEN, more].concat();
    refused(&with(&[]), &["median step", "unit of the time"]);
    refused(&with(&["--time-unit", "us", "--changes-only", "r"]), &["--changes-only names r"]);
    refused(&with(&["--time-unit", "us", "--reference", "r"]), &["\"r\"", "known: u, y"]);
    refused(&[&["wide.csv", "u.csv", "--time", "t"][..], &CHOSEN].concat(), &["u.csv", "\"t\""]);
    fs::copy(folder.join("u.csv"), folder.join("u2.csv")).unwrap();
    refused(&[&["u2.csv"][..], &with(&["--time-unit", "us"])].concat(), &["several files", "u2:u or u:u"]);
    fs::write(folder.join("there.csv"), "mine").unwrap();
    refused(&with(&["--time-unit", "us", "--out", "there.csv"]), &["there.csv exists already"]);
    assert_eq!(fs::read_to_string(folder.join("there.csv")).unwrap(), "mine");
    let found = youla(
        &folder,
        &[&["synchronise"], &with(&["--time-unit", "us", "--out", "there.csv", "--force"])[..]].concat(),
    );
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    // A reader of one clock says where to go.
    let found = youla(&folder, &["check", "wide.csv", "--input", "u", "--output", "y", "--time", "t"]);
    assert!(found.stderr.contains("youla synchronise"), "{}", found.stderr);
}

/// Logs of machines are named, with the way to read them.
#[test]
fn a_log_of_a_machine_says_how_it_is_read() {
    let folder = empty_folder("synchronise-loggers");
    for (bytes, name) in [
        (&b"ULog\x01\x12\x35\x01\0\0"[..], "ULog of PX4"),
        (b"H Product:Blackbox flight data recorder\n", "Betaflight"),
        (b"\xa3\x95\x80\x80\x59FMT\0", "ArduPilot"),
        (b"WPILOG\0\x01", "WPILib"),
        (b"MDF     4.10    ", "ASAM MDF"),
        (b"TDSm\x0e\0\0\0", "TDMS"),
    ] {
        fs::write(folder.join("log"), bytes).unwrap();
        for verb in [&["check", "log", "--input", "u", "--output", "y", "--sample-time", "1"][..], &["init", "log"]] {
            let found = youla(&folder, verb);
            let says = found.stderr.contains(name) && found.stderr.contains("youla.Channels.read");
            assert!(found.code == Some(2) && says, "{verb:?}: {}", found.stderr);
        }
    }
}
