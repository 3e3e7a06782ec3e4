//! `youla compare`: what two runs have in common, and what not.

use crate::common::{demo, empty_folder, loop_folder, settings, youla};
use std::fs;
use std::path::{Path, PathBuf};

/// The small loop, identified with S of order 3 and of order 2.
fn two_orders(name: &str) -> PathBuf {
    let folder = loop_folder(name, &[]);
    let other = settings("order = 3", "order = 2");
    fs::write(folder.join("other.toml"), other).expect("written");
    for (file, out) in [("run.toml", "three"), ("other.toml", "two")] {
        assert_eq!(youla(&folder, &["identify", file, "--out", out, "--quiet"]).code, Some(0));
    }
    folder
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(path).expect("written")).expect("JSON")
}

#[test]
fn two_runs_stand_side_by_side() {
    let folder = two_orders("compare");
    let found = youla(&folder, &["compare", "three", "two"]);
    assert!(found.code == Some(0) && found.stderr.is_empty(), "{:?} {}", found.code, found.stderr);
    for text in ["Runs", "Distance of the models", "hansen.order", "report: comparison.html"] {
        assert!(found.stdout.contains(text), "{text} is missing in\n{}", found.stdout);
    }
    let data = json(&folder.join("comparison.json"));
    let summary = |run: &str| json(&folder.join(run).join("report.json"));
    let fit = |report: &serde_json::Value, method: &str| {
        let fits = report["fits"].as_array().expect("fits");
        fits.iter().find(|f| f["method"] == method).expect("a fit")["fit"].as_f64().expect("a number")
    };
    for (key, run) in [("run1", "three"), ("run2", "two")] {
        assert_eq!(fit(&data["report"], key), fit(&summary(run), "likelihood"));
    }
    let gap = data["distances"][0]["nu_gap"].as_f64().expect("a gap");
    assert!(gap > 0.0 && gap < 1.0, "{gap}");
    let differing = data["report"]["overview"][3]["rows"].as_array().expect("rows");
    assert_eq!(differing.len(), 1, "{differing:?}");
    let predictions = &data["report"]["verification"][0]["outputs"][0]["predictions"];
    assert_eq!(predictions.as_array().map(Vec::len), Some(2), "both runs were verified on the same samples");
    let page = fs::read_to_string(folder.join("comparison.html")).expect("written");
    assert!(page.contains("Differences of modes") && !page.contains("Can I trust it?"));
    let other = fs::read_to_string(folder.join("two/report.json")).expect("written");
    let other = other
        .replace(r#"{"name":"u","unit":"V"}"#, r#"{"name":"v","unit":"V"}"#)
        .replace("\"sample_time\":0.01", "\"sample_time\":0.02");
    fs::write(folder.join("two/report.json"), other).expect("written");
    let found = youla(&folder, &["compare", "three", "two", "--force"]).stdout;
    for text in [
        "two has the channels v [V], y [um], three has u [V], y [um]:",
        "two has a sample time of 0.02 s, three has 0.01 s:",
    ] {
        assert!(found.contains(text), "{text} is missing in\n{found}");
    }
}

#[test]
fn a_run_does_not_differ_from_itself() {
    let folder = empty_folder("compare-same");
    let run = demo().to_str().expect("text");
    assert_eq!(youla(&folder, &["compare", run, run, "--quiet"]).code, Some(0));
    let data = json(&folder.join("comparison.json"));
    let gap = data["distances"][0]["nu_gap"].as_f64().expect("a gap");
    assert!(gap < 1e-6, "{gap}");
    assert_eq!(data["report"]["overview"][3]["rows"].as_array().map(Vec::len), Some(0), "settings");
    for row in data["report"]["overview"][1]["rows"].as_array().expect("modes") {
        assert!(row[1].as_str().expect("text").starts_with("+0.00 Hz (+0.00 %), \u{3b6} +0.0000"), "{row}");
    }
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = two_orders("compare-refused");
    let bearing = demo().to_str().expect("text");
    for (arguments, words) in [
        (&["compare", "three", bearing][..], "the number of inputs of"),
        (&["compare", "three", "nowhere"], "nowhere"),
        (&["compare", "three", "two", "--model", "grey_box"], "grey_box"),
        (&["compare", "three", "two", "--out", "both.json"], "ends in .html"),
        (&["compare", "three", "two", "--out", "run.toml"], "run.toml"),
    ] {
        let found = youla(&folder, arguments);
        assert_eq!(found.code, Some(2), "{arguments:?}: {}", found.stderr);
        assert!(found.stderr.contains(words) && found.stderr.lines().count() == 1, "{}", found.stderr);
        assert!(!folder.join("comparison.html").exists());
    }
    assert_eq!(youla(&folder, &["compare", "three"]).code, Some(2));
}

/// The recommended model needs no scheme: a controller of the wrong sign leaves no S.
#[test]
fn runs_without_the_scheme_are_compared() {
    let wrong = settings("feedback = \"negative\"\nnumerator = [2.0]", "feedback = \"positive\"\nnumerator = [20.0]");
    let folder = loop_folder("compare-no-scheme", &[("run.toml", wrong.as_bytes())]);
    for out in ["one", "two"] {
        assert_eq!(youla(&folder, &["identify", "run.toml", "--out", out, "--quiet"]).code, Some(0));
    }
    let found = youla(&folder, &["compare", "one", "two"]);
    assert!(found.code == Some(0), "{}", found.stderr);
    let refused = youla(&folder, &["compare", "one", "two", "--model", "hansen", "--force"]);
    assert!(refused.code == Some(2) && refused.stderr.contains("recommended"), "{}", refused.stderr);
    assert!(youla(&folder, &["export", "--help"]).stdout.contains("recommended by default"));
}
