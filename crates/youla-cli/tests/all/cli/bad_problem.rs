//! Well-formed input on which the scheme is impossible: shapes, poles, ranks, lengths.

use crate::common::{csv, log, loop_folder, refused, settings, settings_refused, youla};
use std::path::Path;

const NOMINAL: &str =
    "[nominal.transfer_function]\ndomain = \"discrete\"\nnumerator = [0.1]\ndenominator = [1.0, -0.9]\n";
const CONTROLLER: &str =
    "[controller.difference_equation]\nfeedback = \"negative\"\nnumerator = [2.0]\ndenominator = [1.0]\n";

#[test]
fn wrong_shapes_of_the_nominal_model() {
    let cases = [
        ("a = [[0.9, 0.1]]\nb = [[0.1]]\nc = [[1.0]]", "[nominal]: the matrix A is 1 x 2, but must be 1 x 1"),
        ("a = [[0.9]]\nb = [[0.1], [2.0]]\nc = [[1.0]]", "[nominal]: the matrix B is 2 x 1, but must be 1 x 1"),
        ("a = [[0.9]]\nb = [[0.1]]\nc = [[1.0, 2.0]]", "[nominal]: the matrix C is 1 x 2, but must be 1 x 1"),
        ("a = [[0.9, 1.0], [0.1]]\nb = [[0.1]]\nc = [[1.0]]", "row 2 of the matrix A is 1 x 1, but must be 1 x 2"),
        ("a = [[0.9]]\nb = [[0.1, 0.2]]\nc = [[1.0]]", "the number of inputs of the nominal model is 2, but must be 1"),
    ];
    for (matrices, sentence) in cases {
        let nominal = format!("[nominal.state_space]\ndomain = \"discrete\"\n{matrices}\n");
        settings_refused("nominal-shape", &settings(NOMINAL, &nominal), &[sentence]);
    }
    let missing = settings(NOMINAL, "[nominal.model_file]\nfile = \"model.mat\"\n");
    settings_refused("nominal-file", &missing, &["[nominal]: model.mat: no such file"]);
}

#[test]
fn wrong_shapes_of_the_controller() {
    let cases = [
        (
            "state_space",
            "a = [[0.5]]\nb = [[1.0, 2.0]]\nc = [[1.0]]\nd = [[0.0]]",
            "[controller]: the matrix B is 1 x 2, but must be 1 x 1",
        ),
        (
            "state_space",
            "a = [[0.5]]\nb = [[1.0, 2.0]]\nc = [[1.0]]\nd = [[0.0, 1.0]]",
            "the number of inputs of the controller is 2, but must be 1",
        ),
        (
            "observer",
            "state_feedback = [[0.5, 1.0]]\nobserver_gain = [[1.0]]",
            "[controller]: state_feedback is 1 x 2, but must be 1 x 1",
        ),
        ("difference_equation", "numerator = [1.0]\ndenominator = [0.0]", "[controller]: the transfer function"),
    ];
    for (form, keys, sentence) in cases {
        let controller = format!("[controller.{form}]\nfeedback = \"negative\"\n{keys}\n");
        settings_refused("controller-shape", &settings(CONTROLLER, &controller), &[sentence]);
    }
}

#[test]
fn controller_that_does_not_stabilise() {
    let sentence = ["the controller does not stabilise the nominal model", "pole 2.900000", "check the sign"];
    let wrong_sign =
        settings("feedback = \"negative\"\nnumerator = [2.0]", "feedback = \"positive\"\nnumerator = [20.0]");
    scheme_refused("wrong-sign", &wrong_sign, &sentence);
    let gains = "[controller.observer]\nfeedback = \"positive\"\nstate_feedback = [[5.0]]\nobserver_gain = [[-0.1]]\n";
    scheme_refused(
        "wrong-gain",
        &settings(CONTROLLER, gains),
        &[
            "does not stabilise the nominal model",
            "pole 1.4",
            "state_feedback in [controller.observer]",
            "check the sign",
        ],
    );
}

/// The run ends well without the scheme: its reason is printed, the recommended model is there, but not trusted.
fn scheme_refused(name: &str, settings: &str, sentences: &[&str]) {
    let folder = loop_folder(name, &[("run.toml", settings.as_bytes())]);
    recommended_without_scheme(&folder, "factors", sentences);
}

fn recommended_without_scheme(folder: &Path, key: &str, sentences: &[&str]) {
    let found = youla(folder, &["identify", "run.toml", "--out", "out"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let summary = std::fs::read_to_string(folder.join("out/summary.json")).expect("written");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let reason = summary["refused"][key].as_str().expect("the reason");
    for sentence in sentences {
        assert!(reason.contains(sentence) && found.stdout.contains(sentence), "{sentence}: {reason}");
    }
    assert!(summary["methods"].get("hansen").is_none() && summary["methods"]["likelihood"]["order"].is_u64());
    assert_eq!(summary["recommended"]["trusted"], false);
}

#[test]
fn too_few_samples() {
    let few = settings("take = 1200", "take = 45");
    settings_refused("few", &few, &["[hansen] S from alpha to beta", "samples are too few, at least", "horizon of 10"]);
    let fewer = settings("take = 1200", "take = 12");
    settings_refused("few", &fewer, &["record log", "12 samples are too few, at least 21", "`settle` in [factors]"]);
    let order = settings("order = 3", "order = 30");
    settings_refused(
        "few",
        &order,
        &["a model of order 30 was asked for", "9 = (horizon - 1) x outputs", "horizon = 10"],
    );
    let skip = settings("[hansen]", "[verification]\nskip = 100000\n\n[hansen]");
    settings_refused("few", &skip, &["record rest", "800 samples are too few", "`skip` in [verification]"]);
}

#[test]
fn excitation_that_is_constant_or_poor() {
    let constant: Vec<[f64; 4]> = log().iter().map(|row| [row[0], 0.5, 0.5, 0.5]).collect();
    let kept = settings("estimation =", "detrend = \"none\"\nestimation =");
    let files = [("log.csv", csv(&constant).into_bytes()), ("run.toml", kept.into_bytes())];
    let files = files.each_ref().map(|(name, bytes)| (*name, bytes.as_slice()));
    refused(&loop_folder("constant", &files), 2, &["[hansen] S from alpha to beta", "rank ", "of 20;"]);
    refused(&loop_folder("constant", &files[..1]), 2, &["[hansen] S from alpha to beta", "channel 1 is constant"]);
    let sine = |k: usize| (0.3 * k as f64).sin();
    let lines: Vec<[f64; 4]> =
        log().iter().enumerate().map(|(k, row)| [row[0], sine(k), 0.0, 0.5 * sine(k + 3)]).collect();
    let folder = loop_folder("one-line", &[("log.csv", csv(&lines).as_bytes())]);
    recommended_without_scheme(&folder, "hansen", &["does not excite enough", "20 block rows", "rank ", "of 20;"]);
}

#[test]
fn unstable_estimate() {
    let steep = settings("order = 3", "order = 9");
    let log = unstable_log();
    let folder = loop_folder("unstable", &[("run.toml", steep.as_bytes()), ("log.csv", log.as_bytes())]);
    recommended_without_scheme(
        &folder,
        "hansen",
        &["[hansen] S from alpha to beta", "must be stable, but has the pole"],
    );
}

/// A plant that the stated controller does not stabilise: y grows although u and d are logged truly.
fn unstable_log() -> String {
    let mut y = 0.0;
    let rows: Vec<[f64; 4]> = log()
        .iter()
        .map(|&[t, _, d, _]| {
            let row = [t, d - 2.0 * y, d, y];
            y = 1.01 * y + 0.1 * d;
            row
        })
        .collect();
    csv(&rows)
}

#[test]
fn side_evidence_that_is_impossible_does_not_end_the_run() {
    let long = settings("window = 256", "window = 100000");
    let folder = loop_folder("long-window", &[("run.toml", long.as_bytes())]);
    let found = youla(&folder, &["identify", "run.toml", "--out", "out"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    assert!(found.stdout.contains("no indirect frequency response: the window"), "{}", found.stdout);
    let summary = std::fs::read_to_string(folder.join("out/summary.json")).expect("written");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    assert!(summary["refused"]["indirect"].as_str().is_some_and(|reason| reason.contains("100000")));
    assert!(summary.get("frequency_response").is_none());
    let response = std::fs::read_to_string(folder.join("out/response.json")).expect("written");
    let response: serde_json::Value = serde_json::from_str(&response).expect("JSON");
    assert!(response["hz"].is_array() && response["indirect"].as_array().is_some_and(Vec::is_empty));
    // The default fits a record of 1200 samples.
    let short = settings("[frequency_response]\nwindow = 256\n", "");
    let folder = loop_folder("default-window", &[("run.toml", short.as_bytes())]);
    let found = youla(&folder, &["identify", "run.toml", "--out", "out"]);
    assert!(found.code == Some(0) && !found.stdout.contains("no indirect"), "{}{}", found.stdout, found.stderr);
}
