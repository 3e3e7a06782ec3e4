//! Channels that are computed in run.toml: a controller of two degrees of freedom, refusals.

use crate::common::{log, loop_folder, settings, settings_refused, youla};
use std::fmt::Write;
use std::fs;

const DECLARED: &str = "input_excitation = [{ name = \"d\", unit = \"V\" }]\n";

/// The recommended model of a run.toml on a log: its matrices, and what the run says of the controller.
fn identified(name: &str, settings: &str, log: &str) -> (Vec<f64>, String) {
    let folder = loop_folder(name, &[("run.toml", settings.as_bytes()), ("log.csv", log.as_bytes())]);
    let found = youla(&folder, &["identify", "run.toml", "--out", "out"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let model = fs::read(folder.join("out/4-identify/recommended.json")).expect("written");
    let model: serde_json::Value = serde_json::from_slice(&model).expect("JSON");
    let numbers =
        |key: &str| model[key].as_array().expect("a matrix").iter().flat_map(|row| row.as_array().expect("a row"));
    let all = ["a", "b", "c"].into_iter().flat_map(numbers).map(|x| x.as_f64().expect("a number")).collect();
    (all, youla(&folder, &["check", "run.toml"]).stdout)
}

/// `u = K_r r - K_y y` with `K_r = 0.4 / (1 - 0.6 z^-1)`: with K_r declared as a filter of r the model is that with K_r r logged, to 1e-6
/// (the log has finite digits). Taken through K_y, as a `reference` is, r does not explain the input.
#[test]
fn a_controller_of_two_degrees_of_freedom_is_declared_by_a_filter() {
    let rows = log();
    let (mut logged, mut with_r) = (String::from("t,u,d,y\n"), String::from("t,u,r,y\n"));
    for (k, [t, u, d, y]) in rows.iter().enumerate() {
        let r = (d - 0.6 * rows[k.saturating_sub(1)][2]) / 0.4;
        writeln!(logged, "{t:?},{u:?},{d:?},{y:?}").expect("text");
        writeln!(with_r, "{t:?},{u:?},{r:?},{y:?}").expect("text");
    }
    let of_filter = "input_excitation = [{ name = \"K_r r\", from = \"prefilter\", unit = \"V\" }]\n";
    let computed = "[data.computed]\nprefilter = \"filter(r, [0.4], [1, -0.6])\"\n\n[nominal.transfer_function]";
    let two = settings(DECLARED, of_filter).replacen("[nominal.transfer_function]", computed, 1);
    let reference = settings(DECLARED, "reference = [{ name = \"r\", unit = \"um\" }]\n");
    let (one_model, one_check) = identified("one-degree", &settings(DECLARED, DECLARED), &logged);
    let (two_model, two_check) = identified("two-degrees", &two, &with_r);
    assert_eq!(one_model.len(), two_model.len());
    for (one, two) in one_model.iter().zip(&two_model) {
        assert!((one - two).abs() < 1e-6 * (1.0 + one.abs()), "{one} {two}");
    }
    let agrees = |text: &str| text.contains("the declared controller agrees");
    let (_, wrong) = identified("two-degrees-wrong", &reference, &with_r);
    assert_eq!(
        [&one_check, &two_check, &wrong].map(|t| agrees(t)),
        [true, true, false],
        "{one_check}{two_check}{wrong}"
    );
}

#[test]
fn a_computed_channel_that_is_none_is_refused() {
    let with = |text: &str| {
        let computed = format!("[data.computed]\nd = '{text}'\n\n[nominal.transfer_function]");
        settings("[nominal.transfer_function]", &computed)
    };
    settings_refused("computed", &with("2 * uu"), &["log.csv", "\"uu\"", "\"u\""]);
    settings_refused("computed", &with("1 / (t - 0.05)"), &["[data.computed] d", "is inf in row 6", "t = 0.05"]);
    settings_refused("computed", &with("2 * d"), &["run.toml", "[data.computed] d need each other"]);
    settings_refused("computed", &with("u +"), &["[data.computed] d", "character 4"]);
}

/// Without a known excitation nothing shows these errors: the model is not trusted, and the run says what it could not notice.
#[test]
fn without_an_excitation_the_verdict_says_what_was_not_noticed() {
    for (name, text) in
        [("blind", settings(DECLARED, "")), ("blind-gain", settings(DECLARED, "").replace("[2.0]", "[3.0]"))]
    {
        let folder = loop_folder(name, &[("run.toml", text.as_bytes())]);
        let found = youla(&folder, &["identify", "run.toml", "--out", "out"]);
        assert_eq!(found.code, Some(0), "{}", found.stderr);
        let words = (found.stdout + &found.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("these errors could not be noticed: a wrong gain, sign or delay"), "{words}");
        assert!(
            words.contains("Not trusted: the recommended model does not pass 2 of the 8 required tests"),
            "{words}"
        );
    }
}

/// A time column in milliseconds, made seconds by a formula: earlier `check` read it and `identify` found no such column.
#[test]
fn a_computed_time_column_is_read_by_every_verb() {
    let (mut seconds, mut millis) = (String::from("t,u,d,y\n"), String::from("ms,u,d,y\n"));
    for [t, u, d, y] in log() {
        writeln!(seconds, "{t:?},{u:?},{d:?},{y:?}").expect("text");
        writeln!(millis, "{:?},{u:?},{d:?},{y:?}", 1000.0 * t).expect("text");
    }
    let computed = settings("time_column = \"t\"", "time_column = \"s\"").replacen(
        "[nominal.transfer_function]",
        "[data.computed]\ns = \"ms / 1000\"\n\n[nominal.transfer_function]",
        1,
    );
    let (one, check) = identified("seconds", &settings(DECLARED, DECLARED), &seconds);
    let (two, check_computed) = identified("milliseconds", &computed, &millis);
    let line = |text: &str| text.lines().next().unwrap_or_default().to_owned();
    assert_eq!(line(&check), line(&check_computed));
    assert_eq!(one.len(), two.len());
    assert!(one.iter().zip(&two).all(|(a, b)| (a - b).abs() < 1e-6 * (1.0 + a.abs())), "{one:?} {two:?}");
}
