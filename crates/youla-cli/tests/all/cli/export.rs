//! `youla export`: files, names, refusals.

use crate::common::{Outcome, demo, empty_folder, youla};
use std::fs;
use youla_io::export::read_model;

fn done(found: &Outcome) {
    assert!(found.code == Some(0) && found.stderr.is_empty(), "{:?} {}", found.code, found.stderr);
}

#[test]
fn a_run_is_exported_in_every_format_and_reads_back() {
    let folder = empty_folder("export");
    let run = demo().to_str().expect("text");
    let hansen = read_model(demo().join("4-identify/recommended.json")).expect("a model");
    let files = [
        ("mat", "recommended.mat"),
        ("json", "recommended.json"),
        ("npz", "recommended.npz"),
        ("python", "recommended.py"),
        ("matlab", "recommended.m"),
        ("c", "recommended.h"),
    ];
    for (format, file) in files {
        let found = youla(&folder, &["export", run, "--to", format]);
        done(&found);
        assert_eq!(found.stdout.trim(), file);
        let bytes = fs::read(folder.join(file)).expect("written");
        if ["mat", "json", "npz"].contains(&format) {
            let back = youla_io::export::model_from_bytes(&bytes, file).expect("a model");
            assert_eq!(back.system, hansen.system, "{format}");
        } else {
            let text = String::from_utf8(bytes).expect("text");
            assert!(text.contains("4-identify/recommended.json, SHA-256 "), "{text}");
        }
    }
    let original = fs::read(demo().join("4-identify/recommended.json")).expect("readable");
    let (original, copy): (serde_json::Value, serde_json::Value) = (
        serde_json::from_slice(&original).expect("JSON"),
        serde_json::from_slice(&fs::read(folder.join("recommended.json")).expect("written")).expect("JSON"),
    );
    assert_eq!(original, copy, "a model of a run keeps its details and provenance");
}

/// What the run says against its model stands on the terminal and in the file.
#[test]
fn a_model_that_is_not_trusted_is_exported_with_a_caution() {
    let folder = empty_folder("export-untrusted");
    fs::create_dir_all(folder.join("run/4-identify")).expect("made");
    for file in ["4-identify/recommended.json", "4-identify/recommended.mat"] {
        fs::copy(demo().join(file), folder.join("run").join(file)).expect("copied");
    }
    let text = fs::read_to_string(demo().join("summary.json")).expect("written");
    let mut summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    summary["recommended"]["trusted"] = false.into();
    fs::write(folder.join("run/summary.json"), summary.to_string()).expect("written");
    let found = youla(&folder, &["export", "run", "--to", "python"]);
    done(&found);
    assert!(found.stdout.contains("caution: the recommended model of this run is not trusted"), "{}", found.stdout);
    let text = fs::read_to_string(folder.join("recommended.py")).expect("written");
    assert!(text.contains("CAUTION: the recommended model of this run is not trusted"), "{text}");
}

#[test]
fn files_are_exported_too_and_say_where_they_come_from() {
    let folder = empty_folder("export-file");
    let run = demo().to_str().expect("text");
    for arguments in [
        &["export", run, "--to", "npz", "--model", "nominal", "--out", "g.npz"][..],
        &["export", "g.npz", "--to", "json", "--quiet"],
        &["export", "g.json", "--to", "mat", "--out", "g.mat"],
    ] {
        done(&youla(&folder, arguments));
    }
    let nominal = read_model(demo().join("2-factor/nominal.json")).expect("a model");
    assert_eq!(read_model(folder.join("g.mat")).expect("a model").system, nominal.system);
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.join("g.json")).expect("written")).expect("JSON");
    assert_eq!(json["provenance"]["sources"][0]["path"], "g.npz");
    assert_eq!(json["provenance"]["sources"][0]["sha256"].as_str().map(str::len), Some(64));
}

#[test]
fn the_controller_of_a_run_goes_to_firmware() {
    let folder = empty_folder("export-controller");
    let run = demo().to_str().expect("text");
    let found = youla(&folder, &["export", run, "--to", "c-controller", "--json"]);
    done(&found);
    let about: serde_json::Value = serde_json::from_str(&found.stdout).expect("JSON");
    let error = about["single_precision_error"].as_f64().expect("a number");
    assert!(about["file"] == "controller.h" && error > 0.0 && error < 1e-4, "{about}");
    let header = fs::read_to_string(folder.join("controller.h")).expect("written");
    assert!(header.contains("controller_command") && header.contains(&format!("at most {error:.1e} of")), "{header}");

    let deviation = demo().join("4-identify/deviation.json");
    let q = ["export", run, "--to", "c-controller", "--q", deviation.to_str().expect("text"), "--out", "q.h"];
    done(&youla(&folder, &q));
    assert!(fs::read_to_string(folder.join("q.h")).expect("written").contains("Controller J_K(Q) with a Q of "));

    done(&youla(&folder, &["export", run, "--to", "c-loop"]));
    assert!(fs::read_to_string(folder.join("loop.h")).expect("written").contains("loop_switch_q"));
}

#[test]
fn what_cannot_be_exported_is_refused_and_leaves_nothing() {
    let folder = empty_folder("export-refused");
    let run = demo().to_str().expect("text");
    fs::write(folder.join("recommended.npz"), "mine").expect("writable");
    fs::write(folder.join("odd.json"), "{\"refused\": \"too few samples\"}").expect("writable");
    // The same run with a controller that is no observer.
    fs::create_dir_all(folder.join("other/2-factor")).expect("writable");
    for file in ["summary.json", "2-factor/nominal.json"] {
        fs::copy(demo().join(file), folder.join("other").join(file)).expect("writable");
    }
    let settings = fs::read_to_string(demo().join("run.toml")).expect("written");
    let (head, _) = settings.split_once("[controller").expect("a controller");
    let other = "[controller.state_space]\ndomain = \"discrete\"\nfeedback = \"positive\"\na = []\nb = []\nc = [[]]\nd = [[-1.0]]\n";
    fs::write(folder.join("other/run.toml"), head.to_owned() + other).expect("writable");
    let cases: [(&[&str], &str); 11] = [
        (
            &["export", run, "--to", "npz"],
            "recommended.npz exists already; choose another file, or replace it with --force",
        ),
        (
            &["export", run, "--to", "npz", "--model", "hansn"],
            "has no \"hansn\" (did you mean \"hansen\"?); known: recommended, hansen, ",
        ),
        (&["export", ".", "--to", "npz"], "this is no run folder (there is no summary.json in it)"),
        (&["export", "none.json", "--to", "npz"], "none.json: no such file"),
        (&["export", "odd.json", "--to", "npz"], "there is no model; it was refused: too few samples"),
        (&["export", "odd.json", "--to", "npz", "--model", "hansen"], "a model is chosen by name in a run folder only"),
        (&["export", "odd.json", "--to", "c-controller"], "this is no run folder"),
        (&["export", "other", "--to", "c-loop"], "needs [controller.observer]"),
        (&["export", "odd.json", "--to", "c-loop"], "neither a run folder nor the controller.json"),
        (&["export", run, "--to", "c-loop", "--model", "nominal"], "--model does not serve --to c-loop"),
        (&["export", run, "--to", "c", "--q", "odd.json"], "--q serves --to c-controller only"),
    ];
    for (arguments, sentence) in cases {
        let Outcome { code, stderr, .. } = youla(&folder, arguments);
        assert!(code == Some(2) && stderr.contains(sentence), "{arguments:?}: {code:?} {stderr}");
    }
    let Outcome { code, stderr, .. } = youla(&folder, &["export", run, "--to", "fortran"]);
    assert!(
        code == Some(2) && stderr.contains("there is no such format; known are mat, json, npz, python, "),
        "{stderr}"
    );
    let mut left: Vec<_> = fs::read_dir(&folder).expect("there").map(|e| e.expect("readable").file_name()).collect();
    left.sort();
    assert_eq!(left, ["odd.json", "other", "recommended.npz"]);
    assert_eq!(fs::read(folder.join("recommended.npz")).expect("there"), b"mine");
    done(&youla(&folder, &["export", run, "--to", "npz", "--force"]));
    assert!(read_model(folder.join("recommended.npz")).is_ok());
}
