//! run.toml that cannot be used: line, column, what is wrong, what would be right.

use crate::common::{SETTINGS, loop_folder, refused, refused_by, settings, settings_refused};
use std::process::Command;

#[test]
fn missing_file() {
    let folder = loop_folder("missing-toml", &[]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_youla"));
    refused_by(command.args(["identify", "nope.toml"]), &folder, 2, &["nope.toml: no such file"]);
}

#[test]
fn misspelt_keys_at_every_level() {
    let cases: [(&str, &str, &[&str]); 13] = [
        ("name = \"loop\"", "nam = \"loop\"", &["run.toml:1:1:", "`nam`", "top level", "did you mean `name`?"]),
        ("[hansen]", "[hansn]", &["run.toml:21:2:", "`hansn` is not a key of the top level", "did you mean `hansen`?"]),
        ("time_column", "time_colum", &["run.toml:4:1:", "`time_colum`", "[data]", "`time_column`"]),
        ("unit = \"um\"", "unt = \"um\"", &["run.toml:6:26:", "`unt`", "`outputs` in [data]", "`unit`"]),
        ("take = 1200", "tak = 1200", &["run.toml:8:35:", "`tak`", "`estimation` in [data]", "`take`"]),
        ("denominator = [1.0, -0.9]", "denominater = [1.0]", &["run.toml:14:1:", "`denominater`", "`denominator`"]),
        (
            "feedback = \"negative\"",
            "feedback = \"negative\"\ngain = 2.0",
            &["run.toml:18:1:", "`gain` is not a key of [controller.difference_equation]; the keys are feedback"],
        ),
        (
            "[controller.difference_equation]",
            "[controller.difference_equations]",
            &["run.toml:16:13:", "`difference_equations` is not a key of [controller]", "`difference_equation`?"],
        ),
        (
            "horizon = 10",
            "sample_time = 0.01",
            &["run.toml:22:1: `sample_time` is not a key of [hansen]", "; `sample_time` is a key of [data]"],
        ),
        (
            "[controller.difference_equation]",
            "[controller]\nsample_time = 0.01\n[controller.difference_equation]",
            &["[controller] must hold exactly one of", "; `sample_time` is a key of [data]"],
        ),
        ("horizon = 10", "horizn = 10", &["run.toml:22:1:", "`horizn`", "[hansen]", "`horizon`"]),
        ("order = 3", "order = \"autp\"", &["run.toml:23:9:", "`order` in [hansen]", "\"auto\""]),
        (
            "[nominal.transfer_function]",
            "[[data.verification]]\nfile = \"log.csv\"\nskp = 3\n\n[nominal.transfer_function]",
            &["run.toml:", "verification"],
        ),
    ];
    for (passage, replacement, evidence) in cases {
        settings_refused("misspelt-key", &settings(passage, replacement), evidence);
    }
    let lists = settings("estimation = [{ file = \"log.csv\", take = 1200 }]\n", "")
        .replace("[nominal", "[[data.estimation]]\nfile = \"log.csv\"\nskp = 3\n\n[nominal");
    settings_refused("misspelt-key", &lists, &["run.toml:12:1:", "`skp`", "[data.estimation]", "did you mean `skip`?"]);
}

#[test]
fn misspelt_choices() {
    let method = settings("horizon = 10", "horizon = 10\nmethod = \"moespp\"");
    settings_refused(
        "choice",
        &method,
        &["run.toml:23:10:", "`moespp` is not a choice of `method` in [hansen]", "`moesp`", "n4sid, cva"],
    );
    let sign = settings("feedback = \"negative\"", "feedback = \"minus\"");
    settings_refused("choice", &sign, &["run.toml:17:12:", "`minus`", "`feedback`", "negative, positive"]);
}

#[test]
fn missing_keys_and_tables() {
    let cases: [(&str, &str, &str); 5] = [
        ("inputs = [{ name = \"u\", unit = \"V\" }]\n", "run.toml:3:1:", "[data] lacks `inputs`"),
        (
            "feedback = \"negative\"\n",
            "run.toml:16:1:",
            "[controller.difference_equation] lacks `feedback`: \"negative\" is u = K (r - y)",
        ),
        ("file = \"log.csv\", take", "run.toml:8:15:", "`estimation` in [data] lacks `file`"),
        ("name = \"loop\"\n", "run.toml:1:1:", "the top level lacks `name`"),
        ("time_column = \"t\"\n", "run.toml: [data]", "neither sample_time nor time_column"),
    ];
    for (passage, place, sentence) in cases {
        let replacement = if passage.starts_with("file") { "take" } else { "" };
        settings_refused("missing-key", &settings(passage, replacement), &[place, sentence]);
    }
    let two = SETTINGS.to_owned() + "[nominal.model_file]\nfile = \"model.json\"\n";
    settings_refused("missing-key", &two, &["[nominal] must hold exactly one of transfer_function", "more than one"]);
}

#[test]
fn wrong_types() {
    let whole = "but must be a whole number, zero or positive";
    let cases: [(&str, &str, &[&str]); 10] = [
        ("take = 1200", "take = \"many\"", &["run.toml:8:42:", "`take` in [data] is \"many\"", whole]),
        ("take = 1200", "take = -5", &["run.toml:8:42:", "`take` in [data] is -5", whole]),
        ("horizon = 10", "horizon = 1.5", &["run.toml:22:11:", "`horizon` in [hansen] is 1.5", whole]),
        (
            "[{ name = \"u\", unit = \"V\" }]",
            "\"u\"",
            &["run.toml:5:10:", "`inputs` in [data]", "must be a list such as [{name = \"u\"}]"],
        ),
        ("numerator = [0.1]", "numerator = 0.1", &["run.toml:13:13:", "`numerator`", "a list of coefficients"]),
        ("unit = \"um\"", "from = 1.5", &["run.toml:6:33:", "`from` in [data] is 1.5", "name, or the number"]),
        ("name = \"loop\"", "name = 5", &["run.toml:1:8:", "`name` at the top level is 5", "text in quotes"]),
        (
            "order = 3",
            "order = 1.5",
            &["run.toml:23:9:", "`order` in [hansen] is 1.5", "zero or positive, or \"auto\""],
        ),
        ("order = 3", "order = \"al\"", &["run.toml:23:9:", "`order` in [hansen] is \"al\"", "\"auto\""]),
        ("order = 3", "order = {fixed = 3, auto = {}}", &["run.toml:23:9:", "`order` in [hansen]", "whole number"]),
    ];
    for (passage, replacement, evidence) in cases {
        settings_refused("wrong-type", &settings(passage, replacement), evidence);
    }
}

#[test]
fn text_that_is_not_toml() {
    let cases: [(&str, &str, &[&str]); 7] = [
        ("[data]", "[data", &["run.toml:3:6:", "this is not TOML", "expected `]`"]),
        ("time_column = \"t\"", "time_column = \"t", &["run.toml:4:17:", "this is not TOML"]),
        ("time_column = \"t\"", "time_column = t", &["run.toml:4:15:", "this is not TOML"]),
        ("time_column = \"t\"", "time_column = \u{201c}t\u{201d}", &["run.toml:4:15:", "typographic"]),
        ("time_column = \"t\"", "sample_time = 0,001", &["run.toml:4:", "decimal point"]),
        ("time_column = \"t\"", "time_column = \"C:\\logs\"", &["run.toml:4:", "write / in a path"]),
        ("domain = \"discrete\"", "domain = \"discrete\"\ndomain = \"discrete\"", &["`domain` is given twice"]),
    ];
    for (passage, replacement, evidence) in cases {
        settings_refused("not-toml", &settings(passage, replacement), evidence);
    }
    let folder = loop_folder("not-toml", &[("run.toml", b"name = \"\xff\"\n")]);
    refused(&folder, 2, &["run.toml:1:9:", "UTF-8"]);
}

#[test]
fn numbers_out_of_range() {
    let cases = [
        ("time_column = \"t\"", "sample_time = -1.0", "[data] sample_time is -1, but must be a positive"),
        ("window = 256", "window = 256\nfrom_hz = -2.0", "[frequency_response] from_hz is -2"),
        ("window = 256", "window = 256\nfrom_hz = 1e9", "Nyquist frequency of 50"),
        ("window = 256", "window = 256\nfrom_hz = 49.99", "must be below 0.999 of it"),
        ("window = 256", "window = 2", "[frequency_response] window is 2"),
        (
            "order = 3",
            "order = 3\nscaling = \"none\"",
            "run.toml:24:1: `scaling` is not a key of [hansen]; the keys are method",
        ),
        (
            "horizon = 10",
            "horizon = \"auto\"\npast = 3",
            "`horizon` in [hansen] is \"auto\", but must be a whole number",
        ),
        ("[hansen]", "[factors]\ninput_weight = -1.0\n[hansen]", "[factors] input_weight is -1"),
        ("horizon = 10", "horizon = 1", "horizon is 1, but must be at least 2"),
        ("take = 1200", "take = 100000", "is 100000"),
    ];
    for (passage, replacement, evidence) in cases {
        settings_refused("range", &settings(passage, replacement), &[evidence]);
    }
}

#[test]
fn names_and_numbers_of_channels() {
    settings_refused("twice", &settings("\"rest\"", "\"log\""), &["two records are named \"log\""]);
    settings_refused("slash", &settings("\"rest\"", "\"a/b\""), &["\"a/b\" cannot be a file name"]);
    let same = settings("inputs = [{ name = \"u\"", "inputs = [{ name = \"u\" }, { name = \"u\"");
    settings_refused("same-channel", &same, &["more than one channel named \"u\""]);
    let reference = settings("estimation =", "reference = [{ name = \"r\" }, { name = \"s\" }]\nestimation =");
    settings_refused("reference-count", &reference, &["[data] reference", "outputs (1)", "lists 2"]);
    let undriven = settings("input_excitation = [{ name = \"d\", unit = \"V\" }]\n", "")
        + "[verification]\nprediction = \"closed-loop\"\n";
    settings_refused("undriven", &undriven, &["[verification] prediction = \"closed-loop\" needs"]);
}

#[test]
fn structures_that_cannot_be_used() {
    let structure = "a = [[\"-rate\"]]\nb = [[\"gain\"]]\nc = [[1]]\n";
    let rate = "parameters.rate = { initial = 10.0, min = 0.0 }\n";
    let gain = "parameters.gain = { initial = 6.0 }\n";
    let cases: [(String, &[&str]); 4] = [
        (
            format!("{structure}{rate}"),
            &["run.toml: [grey_box.structure]", "row 1, column 1 of the matrix b", "\"gain\"", "rate"],
        ),
        (
            format!("{structure}{gain}parameters.rate = {{ initial = 10.0, min = 20.0, max = 5.0 }}\n"),
            &["[grey_box.structure]", "rate", "20", "5"],
        ),
        (format!("{structure}{gain}{rate}parameters.mass = {{ initial = 1.0 }}\n"), &["[grey_box.structure]", "mass"]),
        (
            format!("{structure}{gain}{rate}").replace("[[\"gain\"]]", "[[\"gain\", 1]]"),
            &["[grey_box.structure]", "2 inputs and 1 outputs", "1 and 1"],
        ),
    ];
    for (declared, evidence) in cases {
        settings_refused("structure", &format!("{SETTINGS}\n[grey_box.structure]\n{declared}"), evidence);
    }
}
