//! What programs may rely on: summary.json, artefacts, signals, and the same result for the same seed.

mod loops;
mod reproduction;

use crate::common::demo;
use crate::schema::problem;
use serde_json::{Map, Value};
use std::fs;
use std::path::Path;
use youla_run::{Summary, summary_schema};

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("readable")).expect("JSON")
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().expect("an object").keys().map(String::as_str).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|x| x.as_f64().expect("a number")).collect()
}

#[test]
fn summary_has_the_documented_structure() {
    let summary = json(&demo().join("summary.json"));
    let mut expected = ["schema", "name", "nominal", "methods", "refused", "bezout_residual"].to_vec();
    expected.extend([
        "certificate",
        "channel_scales",
        "controller_mismatch",
        "data",
        "doubts",
        "recommended",
        "redesign",
        "reduction",
        "seconds",
        "true_plant",
    ]);
    expected.sort_unstable();
    assert_eq!(keys(&summary), expected);
    assert_eq!(summary["schema"], 4);
    assert_eq!(summary["refused"], Value::Object(Map::new()));
    for fit in [&summary["nominal"]["fit"], &summary["true_plant"]["fit"]] {
        assert_eq!(keys(fit), ["verification"]);
        assert_eq!(numbers(&fit["verification"]).len(), 2);
    }
    assert!(summary["bezout_residual"].as_f64().expect("a number") < 1e-12);
    assert!(summary["controller_mismatch"].as_f64().expect("a number") < 1e-9);
    let stages = [
        "certify", "check", "factor", "identify", "record", "redesign", "reduce", "report", "signals", "validate",
        "write",
    ];
    assert_eq!(keys(&summary["seconds"]), stages);
    assert!(stages.iter().all(|s| summary["seconds"][s].as_f64().is_some_and(|t| t >= 0.0)));
}

/// The contract on the recommended model; its file is a model, and its deviations have one number per frequency, output and input.
#[test]
fn summary_recommends_one_model() {
    let recommended = &json(&demo().join("summary.json"))["recommended"];
    let first = [
        "bands",
        "dead_time",
        "description",
        "entry_bands",
        "evidence",
        "file",
        "loop_ratio",
        "loop_ratio_hz",
        "method",
    ];
    let rest = ["modes", "order", "parts", "real_poles", "reasons", "response_deviation", "tests", "trusted"];
    assert_eq!(keys(recommended), [&first[..], &rest[..]].concat());
    assert_eq!(recommended["description"], true);
    assert_eq!(keys(&recommended["parts"]), ["choice", "distortion", "noise", "variation"]);
    assert!(recommended["loop_ratio"].as_f64().is_some_and(|r| 0.0 < r && r <= 0.5), "{}", recommended["loop_ratio"]);
    let outcomes = recommended["tests"].as_array().expect("an array").iter().map(|t| t["outcome"].as_str());
    assert!(outcomes.into_iter().all(|o| o == Some("passed")), "{}", recommended["tests"]);
    assert!(recommended["method"] == "likelihood" && recommended["trusted"] == true, "{:?}", recommended["reasons"]);
    let model = json(&demo().join(recommended["file"].as_str().expect("a path")));
    for matrix in ["a", "b", "c", "d", "ts"] {
        assert!(!model[matrix].is_null(), "{matrix}");
    }
    let deviation = &recommended["response_deviation"];
    let hz = numbers(&deviation["hz"]);
    let absolute = deviation["absolute"].as_array().expect("an array");
    assert!(hz.windows(2).all(|w| w[0] < w[1]) && absolute.len() == hz.len());
    let positive = |row: &Value| numbers(row).len() == 2 && numbers(row).iter().all(|s| *s > 0.0);
    assert!(absolute.iter().all(|at| at.as_array().is_some_and(|rows| rows.len() == 2 && rows.iter().all(positive))));
    for e in recommended["evidence"].as_array().expect("an array") {
        assert!(e["question"].as_str().is_some_and(|q| q.ends_with(')')) && e["limit"].is_number(), "{e}");
    }
}

/// The file fits the schema that `summary_schema` states, and the type reads it back.
#[test]
fn summary_fits_its_schema() {
    let summary = json(&demo().join("summary.json"));
    let schema = summary_schema();
    assert_eq!(problem(&schema, &schema, &summary, "summary.json"), None);
    let mut wrong = summary.clone();
    wrong["methods"]["hansen"]["order"] = "sixteen".into();
    assert!(problem(&schema, &schema, &wrong, "summary.json").is_some());
    let read = Summary::read(demo()).expect("a summary");
    assert_eq!(serde_json::to_value(&read).expect("JSON"), summary);
}

#[test]
fn summary_describes_every_method() {
    let summary = json(&demo().join("summary.json"));
    assert_eq!(keys(&summary["methods"]), ["direct", "hansen", "hansen_reduced", "likelihood"]);
    let expected = [
        "closed_loop_poles",
        "fit",
        "modes",
        "modes_above_nyquist",
        "modes_cancelled",
        "order",
        "poles",
        "real_poles",
        "residuals",
        "robustness",
        "stabilised_by_controller",
        "vaf",
        "zeros",
    ];
    for (name, order) in [("direct", 6), ("hansen", 16), ("hansen_reduced", 6), ("likelihood", 6)] {
        let method = &summary["methods"][name];
        assert_eq!(keys(method), expected, "{name}");
        assert_eq!(method["order"], order, "{name}");
        assert!(method["stabilised_by_controller"].is_boolean());
        assert!(numbers(&method["fit"]["verification"]).iter().all(|f| (20.0..100.0).contains(f)), "{name}");
        let poles = method["poles"].as_array().expect("an array");
        assert_eq!(poles.len(), order);
        assert!(poles.iter().all(|p| numbers(p).len() == 2));
        let modes = method["modes"].as_array().expect("an array");
        let with_deviations =
            ["hz", "hz_deviation", "hz_interval", "residue", "zeta", "zeta_deviation", "zeta_interval"];
        let known = name == "likelihood";
        let of_mode = if known { &with_deviations[..] } else { &["hz", "residue", "zeta"] };
        assert!(!modes.is_empty() && modes.iter().all(|m| keys(m) == of_mode), "{name}");
    }
    assert_eq!(keys(&summary["nominal"]), expected);
}

#[test]
fn frequency_responses_share_one_grid() {
    let response = &json(&demo().join("response.json"));
    assert_eq!(keys(response), ["bands", "deviations", "hz", "indirect", "lines", "models", "singular"]);
    let hz = numbers(&response["hz"]);
    assert!(hz.len() > 100 && hz.windows(2).all(|w| w[0] < w[1]));
    // Two inputs and two outputs of six models.
    let array = |value: &Value| value.as_array().expect("an array").clone();
    let models = array(&response["models"]);
    let of = |method: &str| models.iter().filter(|m| m["method"] == method).count();
    let all = ["direct", "hansen", "hansen_reduced", "likelihood", "nominal", "true_plant"];
    assert_eq!((models.len(), all.map(of)), (24, [4; 6]));
    assert!(models.iter().all(|m| ["magnitude_db", "phase_deg"].iter().all(|key| numbers(&m[*key]).len() == hz.len())));
    let indirect = array(&response["indirect"]);
    assert_eq!(indirect.len(), 4);
    for entry in &indirect {
        let coherence = numbers(&entry["coherence"]);
        assert_eq!(coherence.len(), numbers(&entry["hz"]).len());
        assert!(coherence.iter().all(|c| (0.0..=1.0 + 1e-12).contains(c)));
    }
}
