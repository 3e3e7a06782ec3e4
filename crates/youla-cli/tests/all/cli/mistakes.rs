//! Typical mistakes of a first hour: each message names the place, and the key or flag that mends it.

use crate::common::{SETTINGS, csv, csv_with_line, log, loop_folder, youla};
use std::fs;
use std::path::Path;

/// What is done wrong, and what must be said.
struct Mistake {
    name: &'static str,
    /// Passages of run.toml and what stands in their place.
    settings: &'static [(&'static str, &'static str)],
    /// The log, where it is another one.
    log: Option<fn() -> String>,
    arguments: &'static [&'static str],
    says: &'static [&'static str],
}

const IDENTIFY: &[&str] = &["identify", "run.toml", "--out", "new"];

const fn wrong(
    name: &'static str,
    settings: &'static [(&'static str, &'static str)],
    says: &'static [&'static str],
) -> Mistake {
    Mistake { name, settings, log: None, arguments: IDENTIFY, says }
}

const fn called(name: &'static str, arguments: &'static [&'static str], says: &'static [&'static str]) -> Mistake {
    Mistake { name, settings: &[], log: None, arguments, says }
}

const fn logged(name: &'static str, log: fn() -> String, says: &'static [&'static str]) -> Mistake {
    Mistake { name, settings: &[], log: Some(log), arguments: IDENTIFY, says }
}

const CONTROLLER: &str =
    "[controller.difference_equation]\nfeedback = \"negative\"\nnumerator = [2.0]\ndenominator = [1.0]";
const NOMINAL: &str = "domain = \"discrete\"\nnumerator = [0.1]\ndenominator = [1.0, -0.9]";

const SETTINGS_OF_RUNS: [Mistake; 23] = [
    wrong("a misspelt key", &[("time_column", "time_colum")], &["run.toml:4:1", "`time_colum`", "`time_column`"]),
    wrong("no clock", &[("time_column = \"t\"\n", "")], &["run.toml", "sample_time", "time_column"]),
    wrong(
        "no such file",
        &[("\"log.csv\", take", "\"lag.csv\", take")],
        &["[data] estimation", "lag.csv: no such file"],
    ),
    wrong(
        "no such channel",
        &[("\"y\", unit", "\"Y\", unit")],
        &["log.csv", "\"Y\"", "did you mean \"y\"", "t, u, d, y"],
    ),
    wrong(
        "rows that identify and verify",
        &[("skip = 1200", "skip = 900")],
        &["[[data.verification]] log.csv", "rows 901 to 1200", "skip = 1200"],
    ),
    wrong("two records of one name", &[("\"rest\"", "\"log\"")], &["\"log\"", "another `name`"]),
    wrong(
        "segments and take",
        &[("take = 1200", "take = 9, segments = [[1, 9]]")],
        &["log.csv", "segments", "give one"],
    ),
    wrong(
        "too few excitations",
        &[("outputs = [{", "outputs = [{ name = \"v\" }, {")],
        &["log.csv has no \"v\"", "known"],
    ),
    wrong(
        "two excitations",
        &[("estimation", "alpha = [{ name = \"a\" }]\nestimation")],
        &["alpha", "input_excitation"],
    ),
    wrong(
        "no excitation for the loop",
        &[
            ("input_excitation = [{ name = \"d\", unit = \"V\" }]\n", ""),
            ("[hansen]", "[verification]\nprediction = \"closed-loop\"\n[hansen]"),
        ],
        &["[verification] prediction", "input_excitation, reference or alpha"],
    ),
    wrong(
        "a number for a list",
        &[("numerator = [2.0]", "numerator = 2.0")],
        &["run.toml:18:13", "list of coefficients"],
    ),
    wrong("no sign", &[("feedback = \"negative\"\n", "")], &["[controller.difference_equation] lacks `feedback`"]),
    wrong("an unknown sign", &[("\"negative\"", "\"minus\"")], &["`minus`", "`feedback`", "negative, positive"]),
    wrong(
        "two controllers",
        &[("[hansen]", "[controller.pid]\nfeedback = \"negative\"\ndiscretisation = \"tustin\"\nkp = 2.0\n[hansen]")],
        &["controller", "exactly one of", "difference_equation", "pid"],
    ),
    wrong(
        "a controller in s",
        &[(
            CONTROLLER,
            "[controller.transfer_function]\nfeedback = \"negative\"\ndomain = \"continuous\"\nnumerator = [2.0]\ndenominator = [1.0]",
        )],
        &["[controller]", "hold = \"tustin\"", "hold = \"zoh\""],
    ),
    wrong(
        "Ti in a parallel PID",
        &[(CONTROLLER, "[controller.pid]\nfeedback = \"negative\"\ndiscretisation = \"tustin\"\nkp = 2.0\nti = 1.0")],
        &["`ti` is not a key of [controller.pid]", "kp, ki, kd"],
    ),
    wrong(
        "a derivative that rings",
        &[(CONTROLLER, "[controller.pid]\nfeedback = \"negative\"\ndiscretisation = \"tustin\"\nkp = 2.0\nkd = 1.0")],
        &["[controller]", "derivative_filter", "backward-euler"],
    ),
    wrong("an improper plant", &[("numerator = [0.1]", "numerator = [0.1, 0.0, 0.0]")], &["[nominal]", "numerator"]),
    wrong(
        "an order in words",
        &[("order = 3", "order = \"three\"")],
        &["run.toml:23:9", "`order` in [hansen]", "auto"],
    ),
    wrong(
        "a window above the record",
        &[("window = 256", "window = 2")],
        &["[frequency_response] window", "at least 4"],
    ),
    wrong(
        "a table of an earlier version",
        &[("[hansen]", "[hansen]\nweight = \"cva\"")],
        &["`weight`", "`weight` is not a key of [hansen]"],
    ),
    wrong("more rows than there are", &[("take = 1200", "take = 9000")], &["log.csv", "9000", "2000"]),
    wrong("a second header", &[("[direct]", "[hansen]")], &["run.toml:25", "hansen"]),
];

const LOGS: [Mistake; 7] = [
    logged(
        "a value that is missing",
        || csv_with_line(11, "0.09,1.0,NaN,2.0"),
        &["line 11", "column d", "gaps = \"split\""],
    ),
    logged(
        "an empty cell",
        || csv_with_line(11, "0.09,1.0,1.0,"),
        &["line 11", "column y", "gaps = \"split\"", "every row is read, also those that `segments`"],
    ),
    logged("a word", || csv_with_line(11, "0.09,1.0,off,1.0"), &["line 11", "column d", "\"off\""]),
    logged("a short line", || csv_with_line(11, "0.09,1.0,1.0"), &["line 11", "3 fields", "has 4"]),
    logged("a gap", || csv(&[&log()[..900], &log()[950..]].concat()), &["row 901", "gaps = \"split\"", "`segments`"]),
    logged("no data", || "t,u,d,y\n".into(), &["log.csv", "no line with data"]),
    logged(
        "decimal commas",
        || csv(&log()).replace(',', ";").replace('.', ","),
        &["log.csv, line 2", "decimal = \"comma\""],
    ),
];

const CALLS: [Mistake; 26] = [
    called("a log for a run.toml", &["check", "log.csv"], &["log.csv", "--input", "--output", "youla init"]),
    called("the same to identify", &["identify", "log.csv"], &["log.csv", "--input", "--sample-time", "youla init"]),
    called("the same to signals", &["signals", "log.csv"], &["log.csv: this is no run.toml", "youla init"]),
    called("no clock", &["check", "log.csv", "--input", "u", "--output", "y"], &["log.csv", "--sample-time", "--time"]),
    called(
        "a clock that does not rise",
        &["init", "log.csv", "--input", "u", "--output", "t", "--time", "y", "--open-loop", "--out", "new.toml"],
        &["the column y does not rise from row to row", "is it t?"],
    ),
    called(
        "settings over the log",
        &[
            "init",
            "log.csv",
            "--input",
            "u",
            "--output",
            "y",
            "--time",
            "t",
            "--open-loop",
            "--out",
            "log.csv",
            "--force",
        ],
        &["log.csv is not replaced: the data are read from it"],
    ),
    called(
        "a log on one clock over itself",
        &[
            "synchronise",
            "log.csv",
            "--time",
            "t",
            "--input",
            "u",
            "--output",
            "y",
            "--sample-time",
            "0.01",
            "--out",
            "log.csv",
            "--force",
        ],
        &["log.csv is not replaced: the data are read from it"],
    ),
    called(
        "a folder for a model",
        &["export", "g.json", "--to", "python", "--out", "mine", "--force"],
        &["mine", "a folder"],
    ),
    called("inputs alone", &["check", "log.csv", "--input", "u"], &["--output <NAME>"]),
    called(
        "no controller",
        &["identify", "log.csv", "--input", "u", "--output", "y", "--time", "t"],
        &["log.csv", "--controller FILE", "--open-loop"],
    ),
    called(
        "no sign of a controller",
        &[
            "identify",
            "log.csv",
            "--input",
            "u",
            "--output",
            "y",
            "--time",
            "t",
            "--nominal",
            "g.json",
            "--controller",
            "g.json",
        ],
        &["g.json", "--feedback negative for u = K (r - y)", "--feedback positive for u = K (y - r)", "the log"],
    ),
    called(
        "a sign twice",
        &[
            "identify",
            "log.csv",
            "--input",
            "u",
            "--output",
            "y",
            "--time",
            "t",
            "--nominal",
            "g.json",
            "--controller",
            "pid.json",
            "--feedback",
            "negative",
        ],
        &["pid.json", "`feedback`", "leave --feedback out"],
    ),
    called("a flag that does not exist", &["identify", "run.toml", "--ouput", "x"], &["'--ouput'", "--output"]),
    called("a key as a flag", &["identify", "run.toml", "--order", "4"], &["'--order'", "key of [recommended] and "]),
    called("a folder as an output", &["identify", "run.toml", "--output", "new"], &["--out is the folder of the run"]),
    called("a stream for a folder", &["identify", "run.toml", "--out", "-"], &["'-'", "file or folder", "--json"]),
    called("a stream for a file", &["export", "g.json", "--to", "c", "--out=-"], &["'-'", "file or folder", "--json"]),
    called(
        "a page over settings",
        &["compare", "mine", "mine", "--out", "run.toml", "--force"],
        &["run.toml is not replaced: it is a file of settings"],
    ),
    called(
        "a page over a file of the runs",
        &["compare", "mine", "mine", "--out", "mine/thesis.tex", "--force"],
        &["mine/thesis.tex is not replaced: the data are read from it"],
    ),
    called(
        "a model over itself",
        &["export", "g.json", "--to", "json", "--out", "g.json", "--force"],
        &["g.json is not replaced: the data are read from it"],
    ),
    called("a verb that does not exist", &["idenfity", "run.toml"], &["'idenfity'", "'identify'"]),
    called(
        "a folder of one's own",
        &["identify", "run.toml", "--out", "mine"],
        &["mine", "choose another output folder"],
    ),
    called(
        "the same with --force",
        &["identify", "run.toml", "--out", "mine", "--force"],
        &["mine is not replaced", "choose another place"],
    ),
    called(
        "a folder below a file",
        &["identify", "run.toml", "--out", "log.csv/x"],
        &["log.csv/x", "choose another place by --out"],
    ),
    called("a log to export", &["export", "log.csv", "--to", "python"], &["log.csv", "no model", "run folder"]),
    called("a log to report", &["report", "log.csv"], &["log.csv", "folder of a run"]),
];

fn found(folder: &Path, mistake: &Mistake, text: &str) {
    for word in mistake.says {
        assert!(text.contains(word), "{} in {}: {word:?} is not in: {text}", mistake.name, folder.display());
    }
    for noise in ["panicked", "os error 2)\n\n", "Some("] {
        assert!(!text.contains(noise), "{}: {text}", mistake.name);
    }
}

#[test]
fn mistakes_are_refused_with_place_and_remedy() {
    let all = || SETTINGS_OF_RUNS.iter().chain(&LOGS).chain(&CALLS);
    assert!(all().count() >= 40);
    for (k, mistake) in all().enumerate() {
        let mut settings = SETTINGS.to_owned();
        for (passage, replacement) in mistake.settings {
            assert!(settings.contains(passage), "{}", mistake.name);
            settings = settings.replacen(passage, replacement, 1);
        }
        let log = mistake.log.map_or_else(|| csv(&log()), |log| log());
        let folder =
            loop_folder(&format!("mistake-{k}"), &[("run.toml", settings.as_bytes()), ("log.csv", log.as_bytes())]);
        fs::create_dir(folder.join("mine")).expect("made");
        fs::write(folder.join("mine/thesis.tex"), "years of work").expect("written");
        let pid = r#"{"pid": {"feedback": "negative", "discretisation": "tustin", "kp": 2.0}}"#;
        fs::write(folder.join("pid.json"), pid).expect("written");
        fs::write(folder.join("g.json"), r#"{"ts": 0.01, "a": [[0.9]], "b": [[1]], "c": [[0.1]], "d": [[0]]}"#)
            .expect("written");
        let outcome = youla(&folder, mistake.arguments);
        assert_eq!(outcome.code, Some(2), "{}: {}{}", mistake.name, outcome.stdout, outcome.stderr);
        assert!(outcome.stderr.starts_with("error: "), "{}: {}", mistake.name, outcome.stderr);
        found(&folder, mistake, &outcome.stderr);
    }
}

/// Mistakes that cost the scheme its line and not the run: the reason has a figure and the most likely cause.
#[test]
fn mistakes_in_the_loop_name_the_likely_cause() {
    const CONTINUOUS: &str = "domain = \"continuous\"\nnumerator = [10.0]\ndenominator = [1.0, 10.0]";
    let cases: [Mistake; 3] = [
        wrong(
            "the sign",
            &[("\"negative\"", "\"positive\""), ("[0.1]", "[0.2]")],
            &["pole 1.3", "opposite sign", "`feedback`"],
        ),
        wrong("the units", &[("numerator = [2.0]", "numerator = [200.0]")], &["pole -19.1", "5.623e-2 times", "units"]),
        wrong(
            "milliseconds for seconds",
            &[("time_column = \"t\"", "sample_time = 1e-5"), (NOMINAL, CONTINUOUS)],
            &["0.012 s long", "check sample_time", "`settle`"],
        ),
    ];
    for (k, mistake) in cases.iter().enumerate() {
        let text = mistake.settings.iter().fold(SETTINGS.to_owned(), |text, (a, b)| text.replacen(a, b, 1));
        let folder = loop_folder(&format!("likely-{k}"), &[("run.toml", text.as_bytes())]);
        let outcome = youla(&folder, mistake.arguments);
        assert_eq!(outcome.code, Some(0), "{}: {}", mistake.name, outcome.stderr);
        found(&folder, mistake, &outcome.stdout);
    }
}
