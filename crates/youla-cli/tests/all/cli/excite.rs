//! `youla excite`: files, limits, ports, refusals.

use crate::common::{Outcome, SETTINGS, demo, empty_folder, loop_folder, settings, youla};
use std::fs;
use std::path::Path;
use std::process::Command;
use youla_io::{ChannelRef, CsvOptions, TimeSource, read_csv, read_mat};

fn done(found: &Outcome) {
    assert!(found.code == Some(0) && found.stderr.is_empty(), "{:?} {}", found.code, found.stderr);
}

/// The small loop without its log; the sample time is stated.
fn folder(name: &str) -> std::path::PathBuf {
    let folder = empty_folder(name);
    fs::write(folder.join("run.toml"), settings("time_column = \"t\"", "sample_time = 0.01")).expect("written");
    folder
}

const USUAL: [&str; 8] = ["excite", "run.toml", "--amplitude", "0.5", "--band", "1,20", "--duration", "20"];

fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    USUAL.iter().copied().chain(more.iter().copied()).collect()
}

#[test]
fn files_read_back_bit_by_bit() {
    let folder = folder("excite");
    done(&youla(&folder, &with(&["--to", "csv,c,mat", "--ramp", "1"])));
    let out = folder.join("excite");
    let time = TimeSource::column(ChannelRef::Name("t".into()));
    let csv = read_csv(out.join("alpha.csv"), &[], &time, &CsvOptions::default()).expect("a record");
    // The excitation that run.toml declares gives its name.
    assert!(csv.samples() == 2000 && csv.channels()[0].name == "d" && csv.time().ts() == 0.01);
    let mat = read_mat(out.join("alpha.mat")).expect("variables");
    assert_eq!(mat.matrix("values").expect("a matrix").as_ref(), csv.data());
    assert_eq!(mat.scalar("ts").expect("a number"), 0.01);
    let text = fs::read_to_string(out.join("alpha.csv")).expect("written");
    assert!(
        text.starts_with("# Excitation of loop, at the plant input ") && text.contains("# Columns: d [V]\n"),
        "{}",
        &text[..400]
    );
}

#[test]
#[ignore = "needs gcc"]
fn the_array_for_firmware_holds_the_sequence() {
    let folder = folder("excite-firmware");
    done(&youla(&folder, &with(&["--to", "csv,c", "--ramp", "1"])));
    let out = folder.join("excite");
    let time = TimeSource::column(ChannelRef::Name("t".into()));
    let csv = read_csv(out.join("alpha.csv"), &[], &time, &CsvOptions::default()).expect("a record");
    assert_eq!(compiled(&out), csv.column("d").expect("a column").to_vec());
}

/// What the array of alpha.h holds.
fn compiled(folder: &Path) -> Vec<f64> {
    const MAIN: &str = "#include <stdio.h>\n#include \"alpha.h\"\nint main(void)\n{\n    for (int k = 0; k < alpha_samples; k++) {\n        \
        for (int j = 0; j < alpha_inputs; j++) {\n            printf(\"%.17g\\n\", (double)alpha_values[k][j]);\n        }\n    }\n    return 0;\n}\n";
    fs::write(folder.join("main.c"), MAIN).expect("written");
    let flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "main.c", "-o", "program"];
    let compile = |more: &[&str]| Command::new("gcc").current_dir(folder).args(flags).args(more).output();
    let output = compile(&["-DYOULA_REAL=float"]).expect("gcc");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(compile(&[]).expect("gcc").status.success());
    let output = Command::new(folder.join("program")).output().expect("runs");
    String::from_utf8(output.stdout).expect("text").lines().map(|line| line.parse().expect("a number")).collect()
}

#[test]
fn a_limit_refuses_or_scales() {
    let folder = folder("excite-limit");
    let found = youla(&folder, &with(&["--limit-output", "0.05"]));
    assert!(found.code == Some(2) && found.stdout.is_empty(), "{:?}", found.code);
    assert!(
        found.stderr.contains("the predicted magnitude of y is ")
            && found.stderr.contains("above its limit of 0.05 um; the largest permitted amplitude is "),
        "{}",
        found.stderr
    );
    assert!(!folder.join("excite").exists());
    let found = youla(&folder, &with(&["--limit-output", "0.05", "--scale-to-limit", "--json"]));
    done(&found);
    let about: serde_json::Value = serde_json::from_str(&found.stdout).expect("JSON");
    let peak = about["predicted"][1]["peak"].as_f64().expect("a number");
    assert!((peak / 0.05 - 1.0).abs() < 1e-9 && about["scaled_by"].as_f64().expect("a number") < 1.0, "{about}");
    assert_eq!((about["files"][0].as_str(), about["port"].as_str()), (Some("excite/alpha.csv"), Some("input")));
    let found = youla(&folder, &with(&[]));
    assert!(found.code == Some(2) && found.stderr.contains("alpha.csv exists already"), "{}", found.stderr);
    let found = youla(&folder, &with(&["--force"]));
    done(&found);
    for words in ["energy in the band", "predicted, nominal loop", "with a model off by 10 %", "come on top of it"] {
        assert!(found.stdout.contains(words), "{words}: {}", found.stdout);
    }
}

/// The demo: two inputs, an observer, lightly damped modes, a sequence around the speed of the shaft.
#[test]
fn the_bearing_is_excited_through_its_observer() {
    let folder = empty_folder("excite-bearing");
    let run = demo().join("run.toml");
    let mut arguments =
        vec!["excite", run.to_str().expect("text"), "--amplitude", "0.5", "--band", "20,400", "--duration", "2"];
    arguments.extend([
        "--notch-rpm",
        "2500",
        "--ramp",
        "0.5",
        "--noise",
        "0.3",
        "--damping-deviation",
        "0.002",
        "--limit-output",
        "30",
    ]);
    let found = youla(&folder, &[&arguments[..], &["--json"]].concat());
    done(&found);
    let about: serde_json::Value = serde_json::from_str(&found.stdout).expect("JSON");
    assert_eq!((about["port"].as_str(), about["inputs"].as_array().map(Vec::len)), (Some("alpha"), Some(2)));
    assert!(about["notches"][0]["decibels"][0].as_f64().expect("a number") < -15.0, "{about}");
    assert_eq!(about["modes"].as_array().map(Vec::len), Some(2));
    assert!(about["needed"].as_f64().is_some_and(|s| s > 0.0), "{about}");
    done(&youla(&folder, &[&arguments[..], &["--force", "--shape", "prbs", "--one-at-a-time", "--quiet"]].concat()));
    let text = youla(&folder, &[&arguments[..], &["--force"]].concat()).stdout;
    for words in [
        "port alpha of the controller",
        "left from 39.67 to 43.67 Hz",
        "length for +- 0.002",
        "lines of their own in turn",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn what_is_missing_or_wrong_is_named() {
    let folder = folder("excite-bad");
    fs::write(folder.join("timed.toml"), SETTINGS).expect("written");
    let passage = "feedback = \"negative\"";
    fs::write(
        folder.join("sign.toml"),
        settings(passage, "feedback = \"positive\"").replace("time_column = \"t\"", "sample_time = 0.01"),
    )
    .expect("written");
    let other = |file: &'static str| USUAL.map(|word| if word == "run.toml" { file } else { word }).to_vec();
    let cases: [(Vec<&str>, i32, &str); 10] = [
        (other("timed.toml"), 2, "states no sample_time, and the records, which would show it, cannot be read: "),
        (other("sign.toml"), 2, "the controller does not stabilise the nominal model: the closed loop has the pole "),
        (other("none.toml"), 2, "none.toml: no such file"),
        (with(&["--port", "alpha"]), 2, "(or take the port input): "),
        (with(&["--damping-deviation", "1e-3"]), 2, "the number of noise levels"),
        (with(&["--noise-record", "quiet.csv"]), 2, "quiet.csv"),
        (with(&["--to", "xml"]), 2, "known are csv, c, mat"),
        (with(&["--limit-input", "1,2"]), 2, "the number of limits of the inputs is 2, but must be 1"),
        (
            vec!["excite", "run.toml", "--amplitude", "0.5", "--band", "1,20", "--samples", "10"],
            2,
            "in periods of its lowest frequency is 0.1, but must be at least 1; make the excitation longer",
        ),
        (with(&["--ramp", "11"]), 2, "the ramp in seconds is 11, but must be "),
    ];
    for (arguments, code, sentence) in cases {
        let found = youla(&folder, &arguments);
        assert!(
            found.code == Some(code) && found.stderr.contains(sentence),
            "{arguments:?}: {:?} {}",
            found.code,
            found.stderr
        );
    }
    assert!(!folder.join("excite").exists());
}

/// An amplitude of another unit shows beside the log.
#[test]
fn a_huge_amplitude_is_said() {
    let folder = loop_folder("excite-huge", &[]);
    let of = |amplitude: &str| {
        let arguments = USUAL.map(|word| if word == "0.5" { amplitude } else { word });
        youla(&folder, &[&arguments[..], &["--force"]].concat()).stdout
    };
    assert!(!of("0.5").contains("caution"));
    let told = of("500");
    assert!(told.contains("caution: u [V] is predicted to reach ") && told.contains("check --amplitude"), "{told}");
}
